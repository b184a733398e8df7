"""The tab of the object dictionary: the objects of one node, read and written by SDO."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Final

from textual.app import ComposeResult
from textual.binding import Binding, BindingType

from tickrig.host.canmon.model.decode.sdo.transfer import write_entry
from tickrig.host.canmon.model.dictionary.node_dictionary import (
    ObjectRow,
    encode_value,
    render_dictionary,
)
from tickrig.host.canmon.risks import write_risk
from tickrig.host.canmon.tui.controls import ChoiceView, PromptLine, TitleLine
from tickrig.host.canmon.tui.panels.panel import Panel
from tickrig.host.canmon.tui.settings import text_of
from tickrig.host.canmon.tui.tasks.dictionary_task import DictionaryTask, Node
from tickrig.host.canmon.tui.tasks.session import Model, Session
from tickrig.host.canmon.workspace import SettingError
from tickrig.host.tui.line_view import Line, plain

MARK: Final = "* "
"""Before an object that is watched."""


class DictionaryPanel(Panel):
    """Objects that the EDS names or that were heard, with their latest values."""

    title = "objects"
    section = "objects"
    HELP = """
    # Objects of a node

    What the EDS names, and what was heard of the node: each object with its latest value, where
    that is from (eds: its power-on value, sdo, pdo) and its age. Why a transfer failed stands
    behind it. Values come from the traffic, whoever asked for them.

    Reading and writing need the monitor armed (A); they use the default SDO of the node (1200h).
    A value is written as it is shown, in the same unit; bytes in hex where the type is not known.
    """
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
        self.node: Node | None = None
        self.filter_text = ""
        self._wanted_node = 0
        self._known: list[Node] = []
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
        """Keep the objects of the node."""
        self._known = [(row.channel, row.node) for row in model.board.rows()]
        if self.node is None and self._known:
            matching = [node for node in self._known if node[1] == self._wanted_node]
            self._choose((matching or self._known)[0])
        self._width = self.query_one(ChoiceView).scrollable_content_region.width - len(MARK)
        self._rows = []
        if self.node is not None:
            self._rows = self.client.objects(self.node).rows(self.filter_text)
        self._lines = render_dictionary(self._rows, model.now_us, self._width)
        left = f"{self.client.left} transfers left" if self.client.left else self.client.result
        self._state = "   ".join([self._title(), *filter(None, [left])])

    def paint(self) -> None:
        """Show them."""
        head, *_ = self._lines
        self.query_one("#node", TitleLine).show(self._state)
        self.query_one("#head", TitleLine).show(" " * len(MARK) + head)
        lines = [
            self._line(row, text) for row, text in zip(self._rows, self._lines[1:], strict=True)
        ]
        self.query_one(ChoiceView).show(lines or [plain("no object: give --eds, or g and a node")])

    def load(self, settings: Mapping[str, Any]) -> None:
        """Take node and filter."""
        node = settings.get("node", 0)
        if type(node) is not int or not 0 <= node <= 127:
            raise SettingError(("node",), f"{node!r} is no node-ID 1 to 127, nor 0 for any")
        self._wanted_node = node
        self.filter_text = text_of(settings, "filter", "")

    def save(self) -> dict[str, Any]:
        """Return them."""
        return {"node": self._wanted_node, "filter": self.filter_text}

    def action_next_node(self, steps: int) -> None:
        """Show the next node that was heard or has an EDS."""
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
        """Read all objects that are shown."""
        if self.may_send():
            self.change(lambda: self._read(*self._rows))

    def action_watch(self) -> None:
        """Read the chosen object each second, or no more."""
        self._transfer(lambda row: self.client.watch(self.session.now_us, row.entry))

    def action_write(self) -> None:
        """Ask for a value of the chosen object, and write it."""
        row = self._chosen()
        if row is not None and self.may_send():
            kind = ", ".join(filter(None, [row.kind or "bytes in hex", row.text.unit]))
            question = f"{write_entry(row.entry)} {row.text.name} ({kind})"
            if risk := self._risk(row):
                question += f"\n{risk}. Enter writes it, Escape does not"
            self.query_one(PromptLine).prompt(question, "", lambda text: self._write(row, text))

    def action_filter(self) -> None:
        """Ask for a part of a name, or the begin of an index."""
        self.query_one(PromptLine).prompt("name or index", self.filter_text, self._filter)

    def show_node(self, node: Node) -> None:
        """Show the objects of a node."""
        self._wanted_node = node[1]
        self.change(lambda: self._choose(node))

    def _choose(self, node: Node) -> None:
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
            return "no node was heard"
        wanted = f"   filter {self.filter_text}" if self.filter_text else ""
        return f"{self.node[0]} node {self.node[1]}{wanted}"

    def _line(self, row: ObjectRow, text: str) -> Line:
        mark = MARK if row.entry in self.client.watched else " " * len(MARK)
        return plain(mark + text, "red" if row.trouble else "")
