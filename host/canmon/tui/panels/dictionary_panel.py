"""The tab of the object dictionary, with the objects of one node, read and written by SDO."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Final

from textual.app import ComposeResult
from textual.binding import Binding, BindingType

from tickrig.host.canmon.model.decode.decoded import write_entry
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.node_memory import Entry
from tickrig.host.canmon.model.node_dictionary import (
    NodeDictionary,
    ObjectRow,
    encode_value,
    render_dictionary,
)
from tickrig.host.canmon.risks import write_risk
from tickrig.host.canmon.tui.panels.panel import ChoiceView, Panel, PromptLine, TitleLine, read_help
from tickrig.host.canmon.tui.session import DecodedFrame, Model, Session, Task
from tickrig.host.canmon.workspace import SettingError, text_of
from tickrig.host.canopen.dialogue import Dialogue, QueuedScript, Script
from tickrig.host.canopen.sdo_transfer import download, upload
from tickrig.host.tui import Line, plain
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.canopen.sdo_frame import RESPONSE_COB_ID
from tickrig.wire.instant import NEVER

# Reads and writes objects of a node by SDO, and hears the values of all nodes.

_Node = tuple[str, int]
"""Bus and node-ID."""

_NOW: Final = 0
"""Due time of frames that have not been sent yet."""

_WATCH_US: Final = 1_000_000
"""Interval at which watched objects are read."""


class DictionaryTask(Task):
    """Task that reads and writes objects of a node with its default SDO server (1200h).

    The task communicates with one node at a time. The displayed values come from the traffic, so
    answers of the node to other SDO clients are displayed too.

    Args:
        decoder: decoder that knows the objects of the nodes.

    Attributes:
        channel: bus on which the task sends, empty for the first bus.
        result: result of the latest transfer, in words.
        left: pending transfers.
        watched: objects that are read repeatedly.
    """

    def __init__(self, decoder: Decoder) -> None:
        self.channel, self.result, self.left = "", "", 0
        self._decoder = decoder
        self._nodes: dict[_Node, NodeDictionary] = {}
        self._out: list[CanFrame] = []
        self._node: _Node | None = None
        self._dialogue = Dialogue(1, self._send)
        self._dialogues: dict[_Node, Dialogue] = {}
        self.watched: set[Entry] = set()
        self._watch_us = NEVER

    @property
    def due_us(self) -> int:
        """Time at which the next call is due, even if no frame arrives."""
        return _NOW if self._out else min(self._dialogue.due_us, self._watch_us)

    def objects(self, node: _Node) -> NodeDictionary:
        """Return the objects of a node."""
        found = self._nodes.get(node)
        if found is None:
            found = self._nodes[node] = NodeDictionary(self._decoder.memory(*node))
        return found

    def choose(self, node: _Node) -> None:
        """Communicate with another node from now on.

        Transfers with the previous node are dropped.
        """
        if node != self._node:
            self.stop()
            self._node, self.channel = node, node[0]
            if node not in self._dialogues:
                self._dialogues[node] = Dialogue(node[1], self._send)
            self._dialogue = self._dialogues[node]

    def read(self, now_us: int, entry: Entry) -> None:
        """Read an object of the chosen node."""
        self._start(now_us, f"read {write_entry(entry)}", upload(*entry))

    def write(self, now_us: int, entry: Entry, data: bytes) -> None:
        """Write an object of the chosen node."""
        self._start(now_us, f"write {write_entry(entry)}", download(*entry, data))

    def watch(self, now_us: int, entry: Entry) -> None:
        """Start to read an object of the chosen node each second, or stop these readings."""
        self.watched ^= {entry}
        self._watch_us = now_us if self.watched else NEVER

    def tick(self, now_us: int, records: Sequence[DecodedFrame], /) -> Frames:
        """Process values and answers. Return requests."""
        for one, decoded in records:
            if decoded.node is None:
                continue
            node = one.channel, decoded.node
            if decoded.transfers or decoded.kind[1:4] == "pdo":
                self.objects(node).take(one.at_us, decoded)
            if node == self._node and decoded.kind == "sdo" and isinstance(one.frame, CanFrame):
                self._receive(now_us, one.frame)
        self._dialogue.tick(now_us)
        if now_us >= self._watch_us:
            self._read_watched(now_us)
        out, self._out = tuple(self._out), []
        return out

    def stop(self) -> None:
        """Drop all transfers, and stop watching."""
        self.watched.clear()
        self._watch_us = NEVER
        self._dialogue.clear()
        self._out.clear()
        self.left = 0

    def _read_watched(self, now_us: int) -> None:
        """Read the watched objects, unless earlier transfers are running."""
        self._watch_us += (now_us - self._watch_us) // _WATCH_US * _WATCH_US + _WATCH_US
        if not self.left:
            for entry in sorted(self.watched):
                self.read(now_us, entry)

    def _receive(self, now_us: int, frame: CanFrame) -> None:
        if self._node and frame.can_id == RESPONSE_COB_ID + self._node[1] and not frame.remote:
            self._dialogue.receive_sdo(now_us, frame.data)

    def _send(self, can_id: int, data: bytes) -> None:
        self._out.append(CanFrame(can_id, data))

    def _start(self, now_us: int, what: str, script: Script[object]) -> None:
        def ended(said: object) -> None:
            self.left -= 1
            self.result = str(said)

        self.left += 1
        queued = QueuedScript(what, script, lambda result: ended(f"{what}: done"), ended)
        self._dialogue.start(now_us, queued)


_MARK: Final = "* "
"""Mark in front of a watched object."""


class DictionaryPanel(Panel):
    """Objects of the EDS or of the traffic, with their latest values."""

    title = "objects"
    section = "objects"
    HELP = read_help(__file__)
    DEFAULT_CSS = """
    DictionaryPanel #node { background: $boost; }
    DictionaryPanel #head { text-style: bold; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("n", "next_node(1)", "node", key_display="n N"),
        Binding("N", "next_node(-1)", "node before", show=False),
        Binding("g", "go", "go to node"),
        Binding("enter,r", "read", "read", key_display="r"),
        Binding("R", "read_all", "read all"),
        Binding("e", "write", "write"),
        Binding("space", "watch", "watch"),
        Binding("slash", "filter", "filter", key_display="/"),
    ]

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.client = DictionaryTask(session.model.decoder)
        session.tasks.append(self.client)
        self.node: _Node | None = None
        self.filter_text = ""
        self._wanted_node = 0
        self._known: list[_Node] = []
        self._rows: list[ObjectRow] = []
        self._lines: list[str] = []
        self._state, self._width = "", 0

    def compose(self) -> ComposeResult:
        """Lay out node, titles and objects."""
        yield TitleLine("node")
        yield TitleLine("head")
        yield ChoiceView()
        yield PromptLine()

    def snapshot(self, model: Model) -> None:
        """Copy the objects of the node."""
        self._known = [(row.channel, row.node) for row in model.board.rows()]
        if self.node is None and self._known:
            matching = [node for node in self._known if node[1] == self._wanted_node]
            self._choose((matching or self._known)[0])
        self._width = self.query_one(ChoiceView).scrollable_content_region.width - len(_MARK)
        self._rows = []
        if self.node is not None:
            self._rows = self.client.objects(self.node).rows(self.filter_text)
        self._lines = render_dictionary(self._rows, model.now_us, self._width)
        left = f"{self.client.left} transfers left" if self.client.left else self.client.result
        self._state = "   ".join([self._title(), *filter(None, [left])])

    def paint(self) -> None:
        """Show the snapshot."""
        head, *_ = self._lines
        self.query_one("#node", TitleLine).show(self._state)
        self.query_one("#head", TitleLine).show(" " * len(_MARK) + head)
        lines = [
            self._line(row, text) for row, text in zip(self._rows, self._lines[1:], strict=True)
        ]
        self.query_one(ChoiceView).show(lines or [plain("no object: give --eds, or g and a node")])

    def load(self, settings: Mapping[str, Any]) -> None:
        """Load node and filter."""
        node = settings.get("node", 0)
        if type(node) is not int or not 0 <= node <= 127:
            raise SettingError(("node",), f"{node!r} is no node-ID 1 to 127, nor 0 for any")
        self._wanted_node = node
        self.filter_text = text_of(settings, "filter", "")

    def save(self) -> dict[str, Any]:
        """Return node and filter."""
        return {"node": self._wanted_node, "filter": self.filter_text}

    def action_next_node(self, steps: int) -> None:
        """Show the next node that has sent a frame or has an EDS."""
        if self._known:
            place = self._known.index(self.node) if self.node in self._known else -steps
            self.show_node(self._known[(place + steps) % len(self._known)])

    def action_go(self) -> None:
        """Ask for a node-ID."""
        self.query_one(PromptLine).prompt("node-ID 1 to 127", "", self._go)

    def action_read(self) -> None:
        """Read the chosen object."""
        self._transfer(self._read)

    def action_read_all(self) -> None:
        """Read all visible objects."""
        if self.may_send():
            self.change(lambda: self._read(*self._rows))

    def action_watch(self) -> None:
        """Read the chosen object each second, or stop this."""
        self._transfer(lambda row: self.client.watch(self.session.now_us, row.entry))

    def action_write(self) -> None:
        """Ask for a value of the chosen object, and write the value."""
        row = self._chosen()
        if row is not None and self.may_send():
            kind = ", ".join(filter(None, [row.kind or "bytes in hex", row.text.unit]))
            question = f"{write_entry(row.entry)} {row.text.name} ({kind})"
            if risk := self._risk(row):
                question += f"\n{risk}. Enter writes it, Escape does not"
            self.query_one(PromptLine).prompt(question, "", lambda text: self._write(row, text))

    def action_filter(self) -> None:
        """Ask for a part of a name, or the start of an index."""
        self.query_one(PromptLine).prompt("name or index", self.filter_text, self._filter)

    def show_node(self, node: _Node) -> None:
        """Show the objects of a node."""
        self._wanted_node = node[1]
        self.change(lambda: self._choose(node))

    def _choose(self, node: _Node) -> None:
        self.node = node
        self.client.choose(node)

    def _go(self, text: str) -> None:
        if not text.isdecimal() or not 1 <= int(text) <= 127:
            raise ValueError(f"{text!r} is no node-ID 1 to 127")
        bus = self.node[0] if self.node else self.session.next_bus("")
        self.show_node((bus, int(text)))

    def _risk(self, row: ObjectRow) -> str:
        node = self.node
        drive = node is not None and self.session.model.decoder.memory(*node).is_drive
        return write_risk(drive, [row.entry])

    def _filter(self, text: str) -> None:
        self.filter_text = text
        self.refresh_view()

    def _write(self, row: ObjectRow, text: str) -> None:
        data = encode_value(row.text, text)
        self.change(lambda: self.client.write(self.session.now_us, row.entry, data))

    def _read(self, *rows: ObjectRow) -> None:
        for row in rows:
            self.client.read(self.session.now_us, row.entry)

    def _transfer(self, act: Callable[[ObjectRow], None]) -> None:
        row = self._chosen()
        if row is not None and self.may_send():
            self.change(lambda: act(row))

    def _chosen(self) -> ObjectRow | None:
        number = self.query_one(ChoiceView).chosen
        return self._rows[number] if number < len(self._rows) else None

    def _title(self) -> str:
        if self.node is None:
            return "no node has sent a frame"
        wanted = f"   filter {self.filter_text}" if self.filter_text else ""
        return f"{self.node[0]} node {self.node[1]}{wanted}"

    def _line(self, row: ObjectRow, text: str) -> Line:
        mark = _MARK if row.entry in self.client.watched else " " * len(_MARK)
        return plain(mark + text, "red" if row.trouble else "")
