"""Small widgets of which panels are made: a title, a list, a question, a picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import ClassVar, Final

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.events import Click
from textual.message import Message
from textual.widget import Widget
from textual.widgets import Input, Static

from tickrig.host.tui import Line, LineView


class TitleLine(Static):
    """Shows a text in one line.

    Args:
        name: its id.
    """

    DEFAULT_CSS = "TitleLine { height: 1; }"

    def __init__(self, name: str) -> None:
        super().__init__(id=name, markup=False)

    def show(self, text: str) -> None:
        """Show another text; nothing moves for that."""
        if self.content != text:
            self.update(text, layout=False)


_CHOSEN: Final = "reverse"


class ChoiceView(LineView):
    """Shows lines, the chosen one reversed.

    Attributes:
        chosen: the number of the chosen line, from 0.
    """

    class Chosen(Message):
        """Somebody has chosen a line."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up", "choose(-1)", "up", show=False),
        Binding("down", "choose(1)", "down", show=False),
        Binding("pageup", "choose_page(-1)", "page up", show=False),
        Binding("pagedown", "choose_page(1)", "page down", show=False),
        Binding("home", "choose_end(False)", "first", show=False),
        Binding("end", "choose_end(True)", "last", show=False),
    ]

    def __init__(self, id: str | None = None) -> None:  # noqa: A002 - Textual's name
        super().__init__(id=id)
        self.chosen = 0
        self._rows: list[Line] = []

    def show(self, lines: Sequence[Line], begin: int = 0, total: int | None = None) -> None:
        """Show lines, all of which are there."""
        self._rows = list(lines)
        self.chosen = min(self.chosen, max(0, len(lines) - 1))
        marked = [
            tuple((text, f"{style} {_CHOSEN}".strip()) for text, style in line)
            if number == self.chosen
            else line
            for number, line in enumerate(lines)
        ]
        super().show(marked)

    def choose(self, number: int) -> None:
        """Choose a line, and bring it into view."""
        self.chosen = min(max(0, number), max(0, len(self._rows) - 1))
        self.show(self._rows)
        if not self.top <= self.chosen < self.top + self.rows:
            top = self.chosen if self.chosen < self.top else self.chosen - self.rows + 1
            self.scroll_to(y=top, animate=False, immediate=True, force=True)
        self.post_message(self.Chosen())

    def action_choose(self, steps: int) -> None:
        """Choose a line further down, or up."""
        self.choose(self.chosen + steps)

    def action_choose_page(self, pages: int) -> None:
        """Choose a line a screen further."""
        self.choose(self.chosen + pages * max(1, self.rows))

    def action_choose_end(self, last: bool) -> None:
        """Choose the first or the last line."""
        self.choose(len(self._rows) if last else 0)

    def on_click(self, event: Click) -> None:
        """Choose the line under the mouse."""
        self.choose(self.top + event.y)


_Take = Callable[[str], None]
"""Takes an answer; ValueError says what is wrong with it."""


class PromptLine(Vertical):
    """Is hidden until something is asked; Enter answers, Escape does not."""

    DEFAULT_CSS = """
    PromptLine { display: none; height: auto; }
    PromptLine Static { height: auto; }
    PromptLine #wrong { display: none; color: $error; }
    PromptLine Input { height: 1; border: none; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "leave", "leave", show=False)]

    def __init__(self) -> None:
        super().__init__(id="ask")
        self._take: _Take | None = None
        self._back: Widget | None = None

    def compose(self) -> ComposeResult:
        """Lay out question, answer and what is wrong with it."""
        yield Static(id="question", markup=False)
        yield Input(id="answer", compact=True)
        yield Static(id="wrong", markup=False)

    def prompt(self, question: str, answer: str, take: _Take) -> None:
        """Ask something.

        Args:
            question: for people.
            answer: which they may change.
            take: is told the answer.
        """
        if not self.display:
            self._back = self.screen.focused
        self._take, self.display = take, True
        self.query_one("#question", Static).update(question)
        self.query_one("#wrong").display = False
        field = self.query_one("#answer", Input)
        field.value = answer
        field.focus()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Give the answer; say what is wrong with it."""
        event.stop()
        assert self._take is not None, "something was asked"
        try:
            self._take(event.value.strip())
        except ValueError as error:
            wrong = self.query_one("#wrong", Static)
            wrong.update(str(error))
            wrong.display = True
            return
        self.action_leave()

    def action_leave(self) -> None:
        """Ask no more."""
        self.display = False
        if self._back is not None:
            self._back.focus()


class PictureView(LineView, inherit_bindings=False):
    """Shows a picture; its keys are those of the panel."""

    class Pointed(Message):
        """Somebody has clicked on it.

        Attributes:
            x: in which column of characters.
        """

        def __init__(self, x: int) -> None:
            super().__init__()
            self.x = x

    def on_click(self, event: Click) -> None:
        """Tell where."""
        self.post_message(self.Pointed(event.x))
