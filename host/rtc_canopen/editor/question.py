"""A question that is answered with a line of text."""

from __future__ import annotations

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Input, Label


class Question(ModalScreen[str | None]):
    """Asks for a line; None is no answer.

    Args:
        text: the question.
        answer: what stands there to begin with.
    """

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "leave", "leave")]
    CSS = """
    Question { align: center middle; }
    Question Vertical {
        width: 80%; max-width: 76; height: auto;
        border: round $accent; background: $surface; padding: 0 1;
    }
    """

    def __init__(self, text: str, answer: str) -> None:
        super().__init__()
        self._text, self._answer = text, answer

    def compose(self) -> ComposeResult:
        """Lay it out."""
        with Vertical():
            yield Label(self._text, markup=False)
            yield Input(self._answer, select_on_focus=True, compact=True)
            yield Label("enter: take it    escape: leave it", classes="dim")

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Take the answer."""
        self.dismiss(event.value)

    def action_leave(self) -> None:
        """Take no answer."""
        self.dismiss(None)
