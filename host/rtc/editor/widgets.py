"""Widgets of editors: rows with a cursor, a question, and a choice."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, ClassVar, Final, Generic, NamedTuple, TypeVar

from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.content import Content
from textual.events import Blur, Click, Focus
from textual.message import Message
from textual.screen import ModalScreen
from textual.widgets import Input, Label

from tickrig.host.tui import Line, LineView, line_text, line_width

_T = TypeVar("_T")


class CursorRow(NamedTuple, Generic[_T]):
    """Row of a `CursorView`: a line of text for an item, such as a parameter.

    Attributes:
        key: unique key of the item, which does not change while the item exists.
        line: text of the line, with styles.
        item: item that the row represents.
    """

    key: str
    line: Line
    item: _T


_FOCUSED: Final = "reverse"
_ELSEWHERE: Final = "underline"
_MARGIN: Final = 2
"""Number of columns at the left in which a click opens or folds a row."""


class FramedView(LineView):
    """Widget with titles in its frame, which is drawn again when the keyboard focus changes."""

    def paint(self) -> None:
        """Show the content and the cursor."""
        raise NotImplementedError

    def on_focus(self, event: Focus) -> None:
        """Show that the view has the keyboard focus."""
        self.paint()

    def on_blur(self, event: Blur) -> None:
        """Show that the view does not have the keyboard focus."""
        self.paint()

    def frame(self, title: str, below: str = "") -> None:
        """Update the frame only after a change, because this paints the whole view again."""
        if str(self.border_title or "") != title:
            self.border_title = Content(title)
        if str(self.border_subtitle or "") != below:
            self.border_subtitle = Content(below) if below else None


class CursorView(FramedView, Generic[_T]):
    """Widget that shows a list of rows with a cursor.

    The cursor stays on its item while other rows are added or removed. If the row under the cursor
    is too wide for the widget, its last part is shown below the rows.

    Attributes:
        rows_shown: rows of the list.
        cursor: index of the row under the cursor.
        title: title in the upper border.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up", "move(-1)", show=False),
        Binding("down", "move(1)", show=False),
        Binding("pageup", "page(-1)", show=False),
        Binding("pagedown", "page(1)", show=False),
        Binding("home", "move(-1_000_000)", show=False),
        Binding("end", "move(1_000_000)", show=False),
        Binding("enter", "enter", "open / write"),
    ]

    class Moved(Message):
        """Message of a `CursorView`: another row is under the cursor, or other rows are visible."""

    class Entered(Message):
        """Message that a `CursorView` sends when the user chooses the row under the cursor.

        Attributes:
            view: view that contains the row.
        """

        def __init__(self, view: CursorView[_T]) -> None:
            super().__init__()
            self.view = view

    def __init__(self, id: str) -> None:  # noqa: A002 - Textual's name
        super().__init__(id)
        self.rows_shown: list[CursorRow[_T]] = []
        self.cursor = 0
        self.title = id

    @property
    def row(self) -> CursorRow[_T] | None:
        """The row under the cursor, or None if there is none."""
        return self.rows_shown[self.cursor] if self.rows_shown else None

    @property
    def in_view(self) -> Sequence[CursorRow[_T]]:
        """The rows that are on the screen."""
        return self.rows_shown[self.top : self.top + max(1, self.rows)]

    def offer(self, rows: Sequence[CursorRow[_T]]) -> None:
        """Show rows."""
        before = self.row
        self.rows_shown = list(rows)
        keys = [row.key for row in rows]
        if before is not None and before.key in keys:
            self.cursor = keys.index(before.key)
        self.cursor = max(0, min(self.cursor, len(rows) - 1))
        self.paint()

    def paint(self) -> None:
        """Show the rows and the cursor."""
        lines = [row.line for row in self.rows_shown]
        cut = ""
        if lines:
            line = lines[self.cursor]
            cut = line[-1][0].strip() if line_width(line) > self._columns else ""
            lines[self.cursor] = self._under_cursor(line)
        self.frame(self.title, cut)
        self.show(lines)

    @property
    def _columns(self) -> int:
        return int(self.scrollable_content_region.width)

    def put_cursor(self, number: int) -> None:
        """Put the cursor on a row, and scroll the row into view."""
        self.cursor = max(0, min(number, len(self.rows_shown) - 1))
        if self.cursor < self.top:
            self.scroll_to(y=self.cursor, animate=False, immediate=True)
        elif self.cursor >= self.top + self.rows:
            self.scroll_to(y=self.cursor - self.rows + 1, animate=False, immediate=True)
        self.paint()
        self.post_message(self.Moved())

    def action_move(self, rows: int) -> None:
        """Move the cursor."""
        self.put_cursor(self.cursor + rows)

    def action_page(self, pages: int) -> None:
        """Move the cursor by pages of the visible rows."""
        self.put_cursor(self.cursor + pages * max(1, self.rows - 1))

    def action_enter(self) -> None:
        """Choose the row under the cursor."""
        if self.rows_shown:
            self.post_message(self.Entered(self))

    def on_click(self, event: Click) -> None:
        """Move the cursor to the clicked row.

        A double click, or a click at the left margin, chooses the row.
        """
        at = event.get_content_offset(self)
        if at is not None and self.top + at.y < len(self.rows_shown):
            self.put_cursor(self.top + at.y)
            if at.x < _MARGIN or event.chain == 2:
                self.action_enter()

    def _under_cursor(self, line: Line) -> Line:
        style = _FOCUSED if self.has_focus else _ELSEWHERE
        rest = (" " * max(0, self.size.width - line_width(line)), "")
        return tuple((text, f"{own} {style}".strip()) for text, own in (*line, rest) if text)


class _PromptScreen(ModalScreen[_T | None]):
    """A screen whose result is the answer of the user, or None without an answer."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "leave", "leave")]

    def prompt(self, app: App[Any], then: Callable[[_T], object]) -> None:
        """Show the screen, and call a function with the answer, if there is one."""

        def answered(answer: _T | None) -> None:
            if answer is not None:
                then(answer)

        app.push_screen(self, answered)

    def action_leave(self) -> None:
        """Leave without an answer."""
        self.dismiss(None)


class QuestionScreen(_PromptScreen[str]):
    """Dialog that asks the user for a line of text. Its result is None if the user gives no answer.

    Args:
        text: text of the question.
        answer: initial text of the answer.
    """

    CSS = """
    QuestionScreen { align: center middle; }
    QuestionScreen Vertical {
        width: 80%; max-width: 76; height: auto;
        border: round $accent; background: $surface; padding: 0 1;
    }
    """

    def __init__(self, text: str, answer: str) -> None:
        super().__init__()
        self._text, self._answer = text, answer

    def compose(self) -> ComposeResult:
        """Lay out the question."""
        with Vertical():
            yield Label(self._text, markup=False)
            yield Input(self._answer, select_on_focus=True, compact=True)
            yield Label("enter: take it    escape: leave it", classes="dim")

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Accept the answer."""
        self.dismiss(event.value)


class ChoiceScreen(_PromptScreen[_T]):
    """Dialog in which the user chooses a row of a list.

    The dialog has a field for a search text. The list shows only the rows that contain all words of
    this text.

    The result is None if the user chooses no row.

    Args:
        text: text of the question.
        rows: rows to choose from.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up", "move(-1)", show=False, priority=True),
        Binding("down", "move(1)", show=False, priority=True),
        Binding("pageup", "page(-1)", show=False, priority=True),
        Binding("pagedown", "page(1)", show=False, priority=True),
    ]
    CSS = """
    ChoiceScreen { align: center middle; }
    ChoiceScreen Vertical {
        width: 90%; max-width: 90; height: 80%;
        border: round $accent; background: $surface; padding: 0 1;
    }
    ChoiceScreen CursorView { height: 1fr; }
    """

    def __init__(self, text: str, rows: Sequence[CursorRow[_T]]) -> None:
        super().__init__()
        self._text, self._rows = text, rows
        self.choices = CursorView[_T]("choices")

    def compose(self) -> ComposeResult:
        """Lay out the question and the rows."""
        with Vertical():
            yield Label(self._text, markup=False)
            yield Input(placeholder="type to search", compact=True)
            yield self.choices
            yield Label("enter: take it    up, down: move    escape: leave it", classes="dim")

    def on_mount(self) -> None:
        """Show all rows."""
        self.choices.can_focus = False
        self.call_after_refresh(self.choices.offer, self._rows)

    def on_input_changed(self, event: Input.Changed) -> None:
        """Show the rows that contain the typed text."""
        self._search(event.value)

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Choose the row under the cursor."""
        self._search(event.value)
        if self.choices.row is not None:
            self.dismiss(self.choices.row.item)

    def _search(self, text: str) -> None:
        words = text.casefold().split()
        found = [
            row
            for row in self._rows
            if all(word in line_text(row.line).casefold() for word in words)
        ]
        self.choices.offer(found)

    def on_cursor_view_entered(self, event: CursorView.Entered) -> None:
        """Choose the row that was clicked."""
        event.stop()
        if self.choices.row is not None:
            self.dismiss(self.choices.row.item)

    def on_cursor_view_moved(self, event: CursorView.Moved) -> None:
        """Stop the event, so that the screen below does not get it."""
        event.stop()

    def action_move(self, rows: int) -> None:
        """Move the cursor."""
        self.choices.action_move(rows)

    def action_page(self, pages: int) -> None:
        """Move the cursor by pages of the visible rows."""
        self.choices.action_page(pages)
