"""One line above a table, which is painted again only where it has changed."""

from __future__ import annotations

from textual.widgets import Static


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
