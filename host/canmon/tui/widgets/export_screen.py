"""Asks for a file."""

from __future__ import annotations

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.screen import ModalScreen
from textual.widgets import Input


class ExportScreen(ModalScreen[str]):
    """A field for the name of a file; Escape leaves without one.

    Args:
        name: what stands in the field.
    """

    DEFAULT_CSS = """
    ExportScreen { align: center middle; }
    ExportScreen Input { width: 60; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "leave", "leave")]

    def __init__(self, name: str) -> None:
        super().__init__()
        self._text = name

    def compose(self) -> ComposeResult:
        """Lay out the field."""
        field = Input(self._text, placeholder="bench.toml")
        field.border_title = "keep all settings in"
        yield field

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Take the name."""
        self.dismiss(event.value.strip())

    def action_leave(self) -> None:
        """Take none."""
        self.dismiss("")
