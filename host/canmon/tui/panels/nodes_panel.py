"""The tab of the node board."""

from __future__ import annotations

from typing import Final

from textual.app import ComposeResult

from tickrig.host.canmon.tui.panels.panel import Panel
from tickrig.host.canmon.tui.tasks.session import Model
from tickrig.host.monitor.decode.board_text import render_board
from tickrig.host.tui.line_view import Line, LineView, plain

WIDE: Final = 400
MANY: Final = 1_000
ALARMING: Final = ("LATE", "unasked", "fault")


class NodesPanel(Panel):
    """State of each node, and the latest EMCYs."""

    title = "nodes"
    section = "nodes_view"
    HELP = """
    # Nodes

    NMT state, heartbeat (age / period, `~` learnt), boot-ups, drive state, EMCY and SDO errors of
    each node that was heard or has an EDS. An arrow shows a state that was commanded and is not
    confirmed yet. Below are the EMCYs, the latest first.
    """

    def compose(self) -> ComposeResult:
        """Lay out the board."""
        yield LineView()

    def snapshot(self, model: Model) -> None:
        """Keep the board."""
        self._lines = render_board(model.board, model.now_us, WIDE, MANY)

    def paint(self) -> None:
        """Show it."""
        self.query_one(LineView).show([_styled(line) for line in self._lines])


def _styled(line: str) -> Line:
    if line.startswith(("NODE", "EMCY")):
        return plain(line, "bold")
    return plain(line, "red" if any(word in line for word in ALARMING) else "")
