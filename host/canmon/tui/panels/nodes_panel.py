"""The tab of the node board, with all nodes, details of one node, and NMT commands."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from textwrap import wrap
from typing import ClassVar, Final, NamedTuple

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import TabbedContent, TabPane

from tickrig.host.canmon.model.decode import node_board
from tickrig.host.canmon.model.decode.node_board import told_identity
from tickrig.host.canmon.model.decode.node_memory import DEVICE_TYPE
from tickrig.host.canmon.model.frames import Record, Stamp
from tickrig.host.canmon.risks import NMT_WORDS, nmt_risk
from tickrig.host.canmon.tui.panels.dictionary_panel import DictionaryPanel
from tickrig.host.canmon.tui.panels.panel import ChoiceView, Panel, PromptLine, TitleLine, read_help
from tickrig.host.canmon.tui.session import DecodedFrame, Model, Session, Task
from tickrig.host.tui import Line, LineView, line_text, line_width, plain
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.canopen.emcy import describe
from tickrig.wire.canopen.nmt import ALL_NODES, NMT_COB_ID, NmtCommand, NmtState
from tickrig.wire.canopen.sdo_frame import REQUEST_COB_ID, RESPONSE_COB_ID
from tickrig.wire.instant import NEVER

# Nodes as lines with styles: a board with a row for each, and a card of one.

GOOD: Final = "bold green"
WARNING: Final = "yellow"
BAD: Final = "bold red"
_DIM: Final = "dim"
_HEAD: Final = "bold"
_STATE_STYLES: Final[dict[int | None, str]] = {
    NmtState.OPERATIONAL: GOOD,
    NmtState.PRE_OPERATIONAL: WARNING,
    NmtState.STOPPED: "magenta",
}
FULL, EMPTY = "█", "░"
_GAP: Final = "  "
MIDDLE, WIDE = 110, 160
"""Numbers of columns of the screen from which the board has more columns."""
_LEAST_ERRORS: Final = 12


class _BoardColumn(NamedTuple):
    """A column of the board.

    Attributes:
        title: title of the column.
        cell: function that returns the text for a node at a time, in a board of a given width.
        least: smallest width of a screen that shows the column.
        most: width of the column in characters. Longer texts are cut.
        kept: whether the column is shown even if it is empty for all nodes.
    """

    title: str
    cell: Callable[[node_board.NodeStatus, int, int], Line]
    least: int = 0
    most: int = 40
    kept: bool = False


def board_lines(rows: Sequence[node_board.NodeStatus], now_us: int, width: int) -> list[Line]:
    """Return the table of all CANopen nodes as lines: a header, and a line for each node.

    Args:
        rows: states of the nodes.
        now_us: present time, from which ages are counted.
        width: number of columns of the screen.
    """
    several = len({row.channel for row in rows}) > 1
    node = _BoardColumn("NODE", _bus_node if several else _node, kept=True)
    columns = (node, *(one for one in _COLUMNS if one.least <= width))
    tables = [(one, [one.cell(row, now_us, width) for row in rows]) for one in columns]
    used = [one for one in tables if one[0].kept or any(map(line_width, one[1]))]
    widths = _widths(used, width)
    head = _GAP.join(
        f"{column.title:<{wide}.{wide}}" for (column, _), wide in zip(used, widths, strict=True)
    )
    return [plain(head.rstrip(), _HEAD), *_joined([cells for _, cells in used], widths)]


def _widths(used: Sequence[tuple[_BoardColumn, Sequence[Line]]], width: int) -> list[int]:
    """Return the width of each column. The last column has the remaining width."""
    widths = [
        min(column.most, max(len(column.title), *map(line_width, cells), 0))
        for column, cells in used
    ]
    left = width - sum(widths[:-1]) - len(_GAP) * (len(widths) - 1)
    widths[-1] = max(_LEAST_ERRORS, left)
    return widths


def _joined(columns: Sequence[Sequence[Line]], widths: Sequence[int]) -> Iterator[Line]:
    for cells in zip(*columns, strict=True):
        pieces: list[tuple[str, str]] = []
        for cell, width in zip(cells, widths, strict=True):
            pieces += [
                *_cut(cell, width),
                (" " * (width - min(width, line_width(cell))) + _GAP, ""),
            ]
        yield tuple(pieces[:-1])


def _cut(line: Line, width: int) -> Line:
    """Return a line of at most `most` characters. A cut line ends with an ellipsis.

    >>> _cut((("pre-", "bold"), ("operational", "")), 8)
    (('pre-', 'bold'), ('ope…', ''))
    """
    if line_width(line) <= width:
        return line
    pieces: list[tuple[str, str]] = []
    left = width - 1
    for text, style in line:
        if left <= len(text):
            return (*pieces, (text[:left] + "…", style))
        pieces.append((text, style))
        left -= len(text)
    return tuple(pieces)


def _node(row: node_board.NodeStatus, now_us: int, width: int) -> Line:
    return plain(str(row.node), _HEAD)


def _bus_node(row: node_board.NodeStatus, now_us: int, width: int) -> Line:
    return plain(f"{row.channel} {row.node}", _HEAD)


def _state(row: node_board.NodeStatus, now_us: int, width: int) -> Line:
    if row.is_late(now_us):
        return plain(row.state_text, BAD)
    return plain(row.state_text, _STATE_STYLES.get(row.state, _DIM))


def heartbeat_line(row: node_board.NodeStatus, now_us: int, width: int) -> Line:
    """Return the time since the last heartbeat of a node, as a bar and text.

    The bar grows with this time, and is full when one heartbeat period has passed.
    """
    age_us, period_us = row.age_us(now_us), row.heartbeats.period_us
    if age_us is None:
        return plain("never seen", BAD) if period_us else ()
    if row.doubled:
        return plain(node_board.FROM_TWO_NODES + " LATE" * row.is_late(now_us), BAD)
    if period_us is None:
        return plain(f"none, {age_us / 1e6:.1f} s ago", _DIM)
    cells = 6 if width < MIDDLE else 12 if width < WIDE else 16
    full = min(cells, max(0, age_us) * cells // period_us)
    late = row.is_late(now_us)
    style = BAD if late else WARNING if age_us > period_us else "green"
    about = "~" if row.heartbeats.learnt else ""
    age = f"{age_us // 1_000}" if age_us < 10_000_000 else f"{age_us // 1_000_000} s"
    text = f" {age}/{about}{period_us // 1_000} ms" + " LATE" * late
    bar = (FULL * full, style), (EMPTY * (cells - full), _DIM)
    return tuple(one for one in (*bar, (text, style if late else "")) if one[0])


def _boots(row: node_board.NodeStatus, now_us: int, width: int) -> Line:
    return plain(f"{row.boots}", WARNING if row.unrequested_boots else "") if row.boots else ()


def _error_line(row: node_board.NodeStatus, now_us: int, width: int) -> Line:
    """Return the faults of a node in words, empty for none. The worst fault is first."""
    pieces = [("two nodes have this node-ID", BAD)] * row.doubled
    if row.error_code:
        pieces.append((f"{row.error_code:04X}h {describe(row.error_code)}", BAD))
    if row.unrequested_boots:
        pieces.append((f"{row.unrequested_boots} boot-up unasked", WARNING))
    if row.sdo_errors:
        pieces.append((f"SDO {row.sdo_error}", WARNING))
    if row.late and not row.doubled:
        pieces.append((f"{row.late} late", WARNING))
    if row.emcy_count and not row.error_code:
        pieces.append((f"{row.emcy_count} EMCY, gone", _DIM))
    return tuple(piece for one in pieces for piece in (one, ("; ", "")))[:-1]


def _carried(row: node_board.NodeStatus, now_us: int, width: int) -> Line:
    sent = [name for pdo in node_board.pdo_contents(row) if not pdo.receives for name in pdo.names]
    return plain(", ".join(name.rpartition(".")[2] for name in sent))


_COLUMNS: Final = (
    _BoardColumn("NAME", lambda row, now_us, width: plain(node_board.name_text(row)), most=30),
    _BoardColumn("MAKER", lambda row, now_us, width: plain(node_board.maker_text(row)), WIDE, 26),
    _BoardColumn("NMT STATE", _state, kept=True),
    _BoardColumn("HEARTBEAT", heartbeat_line, kept=True),
    _BoardColumn("BOOT-UPS", _boots, WIDE),
    _BoardColumn("DRIVE", lambda row, now_us, width: plain(row.drive_state), MIDDLE, 22),
    _BoardColumn("TPDOs CARRY", _carried, WIDE, 34),
    _BoardColumn("ERRORS", _error_line, kept=True),
)


_INDENT: Final = 10


def card_lines(
    row: node_board.NodeStatus,
    rows: Sequence[node_board.NodeStatus],
    width: int,
    stamp: Stamp = Stamp.ABSOLUTE,
    origin_us: int = 0,
) -> list[Line]:
    """Return the details of one CANopen node as lines, followed by the EMCY messages of all nodes.

    The latest EMCY is first.

    Args:
        row: state of the node.
        rows: states of all nodes.
        width: number of columns of the screen. A longer text continues on the next line.
        stamp: format of displayed times.
        origin_us: time of the first frame, from which times count.
    """
    name = node_board.name_text(row)
    where = f"{row.channel} node {row.node}" + f": {name}" * bool(name)
    lines = [plain(where, _HEAD)]
    lines += _wrapped(
        "device",
        told_identity(row) or "not known: no EDS, and no read of 1000h or 1018h",
        width,
    )
    for pdo in node_board.pdo_contents(row):
        lines += _wrapped(f"{pdo.kind.upper()} {pdo.can_id:03X}h", pdo.text, width)
    if row.drive_state:
        lines += _wrapped("drive", row.drive_state, width)
    if row.sdo_errors:
        lines += _wrapped("SDO", f"{row.sdo_errors} failed, the latest: {row.sdo_error}", width)
    history = node_board.emcy_history(rows, stamp, origin_us)
    heads = [plain(line, _HEAD) for line in history[:2]]
    return [*lines, *heads, *(part for line in history[2:] for part in _wrapped("", line, width))]


def _wrapped(title: str, text: str, width: int) -> list[Line]:
    indent = _INDENT + 3 if title else 0
    parts = wrap(text, max(20, width - indent), subsequent_indent="" if title else " " * 10)
    first = (f"  {title:<{_INDENT}} ", _DIM) if title else ("", "")
    rest = (" " * indent, "")
    return [((rest if number else first), (part, "")) for number, part in enumerate(parts or [""])]


# Sends NMT commands.

_NOW: Final = 0
"""Due time of commands that have not been sent yet."""


class _NodeTask(Task):
    """Task that sends NMT commands and requests. The traffic shows their results."""

    def __init__(self) -> None:
        self.channel = ""
        self._out: list[CanFrame] = []
        self._asks: deque[CanFrame] = deque()
        self._due_us = NEVER
        self._answered_ids: set[int] = set()

    @property
    def due_us(self) -> int:
        """Time at which the next call is due, even if no frame arrives."""
        return _NOW if self._out else self._due_us

    @property
    def scans(self) -> bool:
        """Whether a scan of node-IDs is running."""
        return bool(self._asks)

    def scan(self, channel: str, now_us: int) -> None:
        """Search a bus for nodes with SDO.

        The task reads the device type of all node-IDs, and the identity of the nodes found.
        """
        self.channel, self._due_us = channel, now_us
        self._answered_ids.clear()
        self._asks = deque(_upload(node, *DEVICE_TYPE) for node in _NODE_IDS)

    def command(self, channel: str, node: int, command: NmtCommand) -> None:
        """Send an NMT command to a node on a bus. Node-ID 0 means all nodes."""
        self.channel = channel
        self._out.append(CanFrame(NMT_COB_ID, bytes((command, node))))

    def tick(self, now_us: int, records: Sequence[DecodedFrame], /) -> Frames:
        """Return the frames to send."""
        out, self._out = self._out, []
        if self._due_us == NEVER:
            return tuple(out)
        for record, decoded in records:
            node = decoded.node or 0
            if _answers(record, node) and node not in self._answered_ids:
                self._answered_ids.add(node)
                self._asks += [_upload(node, *entry) for entry in _IDENTITY]
        if now_us >= self._due_us:
            out += [self._asks.popleft()] if self._asks else []
            self._due_us = now_us + _ASK_US if self._asks else NEVER
        return tuple(out)

    def stop(self) -> None:
        """Drop everything that was not sent yet."""
        self._out.clear()
        self._asks.clear()
        self._due_us = NEVER


def _upload(node: int, index: int, sub: int) -> CanFrame:
    """Return the request to read an object."""
    data = bytes((0x40, index & 0xFF, index >> 8, sub, 0, 0, 0, 0))
    return CanFrame(REQUEST_COB_ID + node, data)


def _answers(record: Record, node: int) -> bool:
    """Return whether a frame is a response to the read of 1000h."""
    frame = record.frame
    return (
        isinstance(frame, CanFrame)
        and frame.can_id == RESPONSE_COB_ID + node
        and frame.data[1:4] == b"\x00\x10\x00"
    )


_NODE_IDS: Final = range(1, 128)
_IDENTITY: Final = tuple((0x1018, sub) for sub in (1, 2, 3))
_ASK_US: Final = 10_000
"""Time between two requests, which is 5 % of a bus of 125 kbit/s, and time for an answer."""
_YES: Final = ("y", "yes")
_SHARE: Final = 0.6
"""Largest share of the tab that the board uses."""


class NodesPanel(Panel):
    """A row for each node, and a card of the chosen node."""

    title = "nodes"
    section = "nodes_view"
    HELP = read_help(__file__)
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
        Binding("f", "scan", "find nodes"),
        Binding("enter", "objects", "objects", key_display="enter"),
    ]

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.master = _NodeTask()
        session.tasks.append(self.master)
        self._rows: list[node_board.NodeStatus] = []
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
    def chosen(self) -> node_board.NodeStatus | None:
        """The chosen node, or None if there is none."""
        number = self.query_one(ChoiceView).chosen
        return self._rows[number] if number < len(self._rows) else None

    def snapshot(self, model: Model) -> None:
        """Copy the board, and the card of the chosen node."""
        self._rows = model.board.rows()
        width = self.query_one(ChoiceView).scrollable_content_region.width
        self._lines = board_lines(self._rows, model.now_us, width)
        row = self.chosen
        wide = self.query_one("#card", LineView).scrollable_content_region.width
        stamp, origin_us = self.session.stamp, self.session.origin_us
        self._card = [] if row is None else card_lines(row, self._rows, wide, stamp, origin_us)

    def paint(self) -> None:
        """Show the snapshot. The board is no higher than its rows require."""
        head, *rows = self._lines
        title, view = self.query_one("#head", TitleLine), self.query_one(ChoiceView)
        title.styles.text_style = "bold"
        title.show(line_text(head) if rows else "")
        view.styles.height = max(1, min(len(rows), int(self.size.height * _SHARE)))
        view.show(rows or [plain(self._hint())])
        self.query_one("#card", LineView).show(self._card)

    def _hint(self) -> str:
        if self.master.scans:
            return "all node-IDs are asked..."
        if not self.session.can_send:
            return "no node has sent a frame"
        return f"no node has sent a frame; f queries all node-IDs, as {self.session.scan_command}"

    @property
    def _bus(self) -> str:
        row = self.chosen
        return row.channel if row else next(iter(self.session.buses), "")

    def action_scan(self) -> None:
        """Ask whether to request the identity of all node-IDs."""
        if not self.session.can_send:
            self.notify("a log has no nodes to be asked")
        elif self.may_send():
            bus = self._bus
            what = (
                f"Read 1000h of node-IDs 1 to 127 on {bus}, and 1018h of each that answers."
                " An SDO transfer of another master may be disturbed"
            )
            self._prompt(what, lambda: self.master.scan(bus, self.session.now_us))

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
        """Ask the user for confirmation, then send an NMT command to the chosen node.

        If `to_all` is set, the command is for all nodes on the bus of that node.
        """
        row = self.chosen
        if row is None or not self.may_send():
            return
        command, whom = NMT_WORDS[word], "all nodes" if to_all else f"node {row.node}"
        risk = nmt_risk(command, None if to_all else row.memory.number(*DEVICE_TYPE))
        several = f" on {row.channel}" * (len(self.session.buses) > 1)
        node = ALL_NODES if to_all else row.node
        send = partial(self.master.command, row.channel, node, command)
        self._prompt(f"NMT {word} to {whom}{several}. {risk}", send)

    def _prompt(self, what: str, act: Callable[[], object]) -> None:
        """Ask whether to send what is described."""
        take = partial(self._answered, act)
        self.query_one(PromptLine).prompt(f"{what}. Send it (y or n)?", "", take)

    def _answered(self, act: Callable[[], object], answer: str) -> None:
        if answer.lower() in _YES and self.may_send():
            self.change(act)
        elif answer.lower() not in (*_YES, "n", "no"):
            raise ValueError(f"{answer!r} is neither y nor n")
