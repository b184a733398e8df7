"""One line in which somebody answers a question."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.widget import Widget
from textual.widgets import Input, Static

Take = Callable[[str], None]
"""Takes an answer; ValueError says what is wrong with it."""


class AskLine(Vertical):
    """Is hidden until something is asked; Enter answers, Escape does not."""

    DEFAULT_CSS = """
    AskLine { display: none; height: auto; }
    AskLine Static { height: auto; }
    AskLine #wrong { display: none; color: $error; }
    AskLine Input { height: 1; border: none; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "leave", "leave", show=False),
    ]

    def __init__(self) -> None:
        super().__init__(id="ask")
        self._take: Take | None = None
        self._back: Widget | None = None

    def compose(self) -> ComposeResult:
        """Lay out question, answer and what is wrong with it."""
        yield Static(id="question", markup=False)
        yield Input(id="answer", compact=True)
        yield Static(id="wrong", markup=False)

    def ask(self, question: str, answer: str, take: Take) -> None:
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
