"""The tab of the statistics of all identifiers: rates, gaps, jitter, missed cycles and bits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar, Final

from textual.app import ComposeResult
from textual.binding import Binding, BindingType

from tickrig.host.canmon.model.top_model import UNBOUNDED, RowOrder
from tickrig.host.canmon.tui.panels.panel import Panel, ansi_line, read_help
from tickrig.host.canmon.tui.panels.trace_panel import CHANGED
from tickrig.host.canmon.tui.session import Model, Session
from tickrig.host.canmon.workspace import choice, truth
from tickrig.host.tui import Line, LineView, plain

_STYLES: Final = {"7": CHANGED}
"""Reversed text has changed."""

_TITLE: Final = "CAN-ID"
"""Text in the last line above the rows."""


class StatisticsPanel(Panel):
    """The table of `canmon top`."""

    title = "statistics"
    section = "statistics"
    HELP = read_help(__file__)
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("space", "press(' ')", "hold"),
        Binding("b", "press('b')", "bits"),
        Binding("d", "press('d')", "decode"),
        Binding("n", "press('n')", "notch"),
        Binding("s", "press('s')", "sort"),
        Binding("c", "press('c')", "clear"),
    ]

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self._heads: list[Line] = []
        self._lines: list[Line] = []

    def compose(self) -> ComposeResult:
        """Lay out the headers, which do not scroll, and the rows."""
        heads = LineView(id="heads")
        heads.can_focus = False
        yield heads
        yield LineView(id="rows")

    def snapshot(self, model: Model) -> None:
        """Copy the whole table, as wide as the screen."""
        top = model.top
        top.view = replace(top.view, keys=False)
        lines = top.lines(model.now_us, model.lost, self.size.width, UNBOUNDED, model.unread)
        heads = next((number for number, line in enumerate(lines, 1) if _TITLE in line), 0)
        self._heads = [plain(line, "bold") for line in lines[:heads]]
        self._lines = [ansi_line(line, _STYLES) for line in lines[heads:]]

    def paint(self) -> None:
        """Show the snapshot."""
        heads = self.query_one("#heads", LineView)
        heads.styles.height = max(1, len(self._heads))
        heads.show(self._heads)
        self.query_one("#rows", LineView).show(self._lines)

    def load(self, settings: Mapping[str, Any]) -> None:
        """Load the order and the displayed columns."""
        top = self.session.model.top
        order = choice(settings, "sort", top.view.order, list(RowOrder))
        bits = truth(settings, "bits", top.view.bits)
        top.view = replace(top.view, order=RowOrder(order), bits=bits)
        if truth(settings, "decode", False):
            top.press("d")

    def save(self) -> dict[str, Any]:
        """Return the order and the displayed columns."""
        view = self.session.model.top.view
        decode = view.meaning is not None
        return {"sort": str(view.order), "bits": view.bits, "decode": decode}

    def action_press(self, key: str) -> None:
        """Process a key as `canmon top` does."""
        self.change(lambda: self.session.model.top.press(key))
