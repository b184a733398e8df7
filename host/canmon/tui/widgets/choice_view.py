"""Lines of which one is chosen, by keys or by mouse."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Final

from textual.binding import Binding, BindingType
from textual.events import Click

from tickrig.host.tui.line_view import Line, LineView

CHOSEN: Final = "reverse"


class ChoiceView(LineView):
    """Shows lines, the chosen one reversed.

    Attributes:
        chosen: the number of the chosen line, from 0.
    """

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
            tuple((text, f"{style} {CHOSEN}".strip()) for text, style in line)
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
