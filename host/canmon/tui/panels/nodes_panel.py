"""The tab of the node board: all nodes, one of them in full, and NMT commands."""

from __future__ import annotations

from functools import partial
from typing import ClassVar, Final

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import TabbedContent, TabPane

from tickrig.host.canmon.model.decode.node_board import NodeStatus
from tickrig.host.canmon.model.decode.node_memory import DEVICE_TYPE
from tickrig.host.canmon.risks import nmt_risk
from tickrig.host.canmon.tui.controls import ChoiceView, PromptLine, TitleLine
from tickrig.host.canmon.tui.node_lines import board_lines, card_lines
from tickrig.host.canmon.tui.panels.dictionary_panel import DictionaryPanel
from tickrig.host.canmon.tui.panels.panel import Panel
from tickrig.host.canmon.tui.tasks.node_task import NodeTask
from tickrig.host.canmon.tui.tasks.session import Model, Session
from tickrig.host.tui.line_view import Line, LineView, line_text, plain
from tickrig.wire.canopen.nmt import ALL_NODES, NmtCommand

COMMANDS: Final = {
    "start": NmtCommand.START,
    "stop": NmtCommand.STOP,
    "pre-op": NmtCommand.ENTER_PRE_OPERATIONAL,
    "reset-node": NmtCommand.RESET_NODE,
    "reset-comm": NmtCommand.RESET_COMMUNICATION,
}
"""As `canmon net` calls them."""
YES: Final = ("y", "yes")
SHARE: Final = 0.6
"""The board takes no more of the tab."""


class NodesPanel(Panel):
    """A row for each node, and a card of the chosen one."""

    title = "nodes"
    section = "nodes_view"
    HELP = """
    # Nodes

    A row for each node that was heard or has an EDS: NMT state, heartbeat, boot-ups, drive state,
    and what is wrong, in words. The bar is full when a period of the heartbeat has passed (`~`: the
    period is learnt); LATE is more than one and a half. An arrow shows a state that was commanded
    and is not confirmed yet. A wider window has more columns.

    Below, the chosen node: who it is, what its PDOs carry and where that is known from, and the
    EMCYs of all nodes, the latest first.

    Commands need the monitor armed (A), and ask before they are sent; the small letter is for the
    chosen node, the capital one for all on its bus. Enter shows the objects of the node.
    """
    DEFAULT_CSS = """
    NodesPanel #card { height: 1fr; border-top: solid $foreground 30%; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("s", "command('start')", "start", key_display="s S"),
        Binding("S", "command('start',True)", "start all", show=False),
        Binding("t", "command('stop')", "stop", key_display="t T"),
        Binding("T", "command('stop',True)", "stop all nodes", show=False),
        Binding("p", "command('pre-op')", "pre-op", key_display="p P"),
        Binding("P", "command('pre-op',True)", "pre-op all", show=False),
        Binding("r", "command('reset-node')", "reset", key_display="r R"),
        Binding("R", "command('reset-node',True)", "reset all", show=False),
        Binding("k", "command('reset-comm')", "reset comm", key_display="k K"),
        Binding("K", "command('reset-comm',True)", "reset comm all", show=False),
        Binding("enter", "objects", "objects", key_display="enter"),
    ]

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.master = NodeTask()
        session.tasks.append(self.master)
        self._rows: list[NodeStatus] = []
        self._lines: list[Line] = [()]
        self._card: list[Line] = []

    def compose(self) -> ComposeResult:
        """Lay out the board and the card."""
        yield TitleLine("head")
        yield ChoiceView()
        card = LineView(id="card")
        card.can_focus = False
        yield card
        yield PromptLine()

    @property
    def chosen(self) -> NodeStatus | None:
        """The chosen node; None where there is none."""
        number = self.query_one(ChoiceView).chosen
        return self._rows[number] if number < len(self._rows) else None

    def snapshot(self, model: Model) -> None:
        """Keep the board, and the card of the chosen node."""
        self._rows = model.board.rows()
        width = self.query_one(ChoiceView).scrollable_content_region.width
        self._lines = board_lines(self._rows, model.now_us, width)
        row = self.chosen
        wide = self.query_one("#card", LineView).scrollable_content_region.width
        self._card = [] if row is None else card_lines(row, self._rows, wide)

    def paint(self) -> None:
        """Show them; the board takes no more room than it needs."""
        head, *rows = self._lines
        title, view = self.query_one("#head", TitleLine), self.query_one(ChoiceView)
        title.styles.text_style = "bold"
        title.show(line_text(head) if rows else "")
        view.styles.height = max(1, min(len(rows), int(self.size.height * SHARE)))
        view.show(rows or [plain("no node was heard")])
        self.query_one("#card", LineView).show(self._card)

    def on_choice_view_chosen(self) -> None:
        """Show the card of another node."""
        self.refresh_view()

    def action_objects(self) -> None:
        """Show the objects of the chosen node."""
        row, found = self.chosen, self.screen.query(DictionaryPanel)
        if row is not None and found:
            panel = found.first()
            pane = next(one for one in panel.ancestors if isinstance(one, TabPane))
            self.screen.query_one(TabbedContent).active = pane.id or ""
            panel.show_node((row.channel, row.node))

    def action_command(self, word: str, to_all: bool = False) -> None:
        """Ask whether an NMT command shall be sent to the chosen node, or to all on its bus."""
        row = self.chosen
        if row is None or not self.may_send():
            return
        command, whom = COMMANDS[word], "all nodes" if to_all else f"node {row.node}"
        risk = nmt_risk(command, None if to_all else row.memory.number(*DEVICE_TYPE))
        several = f" on {row.channel}" * (len(self.session.buses) > 1)
        question = f"NMT {word} to {whom}{several}. {risk}. Send it (y or n)?"
        node = ALL_NODES if to_all else row.node
        take = partial(self._answered, row.channel, node, command)
        self.query_one(PromptLine).prompt(question, "", take)

    def _answered(self, channel: str, node: int, command: NmtCommand, answer: str) -> None:
        if answer.lower() in YES and self.may_send():
            self.change(lambda: self.master.command(channel, node, command))
        elif answer.lower() not in (*YES, "n", "no"):
            raise ValueError(f"{answer!r} is neither y nor n")
