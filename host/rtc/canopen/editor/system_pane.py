"""The tree of nodes, components and their connections."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from functools import lru_cache
from typing import ClassVar, Final

from textual.binding import Binding, BindingType

from tickrig.host.rtc.canopen.definition import PdoLink, PdoName, RtConnection, ServerRefused
from tickrig.host.rtc.canopen.served_node import NodePhase
from tickrig.host.rtc.canopen.view import (
    NOT_HEARD,
    ComponentView,
    NodeView,
    PdoView,
    PortView,
    ServerView,
    SystemView,
)
from tickrig.host.rtc.editor.styles import ALARM, DIM, LIT, STATES
from tickrig.host.rtc.editor.widgets import CursorRow, CursorView
from tickrig.host.rtc.system.dot import Box, Edge
from tickrig.host.tui import Line

Item = NodeView | ComponentView | PdoView | PortView | PdoLink | RtConnection
_SystemRow = CursorRow[Item]
_Owner = NodeView | ComponentView


_KEPT_ROWS: Final = 4_096
"""Number of cached rows. 127 nodes have fewer rows, and an unchanged row is not written again."""

_FOLDED: Final = "▸ "
_OPEN: Final = "▾ "


def _system_rows(
    system: SystemView, folded: Collection[str] = (), marked: str = ""
) -> list[_SystemRow]:
    """Return the rows of the tree.

    Args:
        system: the system to show.
        folded: keys of nodes and components whose ports and PDOs are hidden.
        marked: key of the port or PDO that is to be connected.
    """
    sources = {link.target: link.source for link in system.links}
    rows: list[_SystemRow] = []
    for node in system.nodes:
        rows.append(_node(node, folded))
        if rows[-1].key not in folded:
            rows += (_pdo(pdo, sources.get(pdo.name), marked) for pdo in node.pdos)
            rows += (_port(port, marked) for port in node.ports)
    for component in system.components:
        rows.append(_component(component, folded))
        if rows[-1].key not in folded:
            rows += (_port(port, marked) for port in component.ports)
    return [*rows, *_joints(system)]


def _node(node: NodeView, folded: Collection[str]) -> _SystemRow:
    key = f"node {node.node_id}"
    age = "" if node.heartbeat_age_us == NOT_HEARD else f"{node.heartbeat_age_us // 1_000} ms"
    nmt = node.nmt_state.replace("_", "-").capitalize()
    line = (
        (_fold(key, folded), ""),
        (f"{node.node_id:>3} {node.name:<12} ", "bold"),
        _state(node.proxy_state),
        (f" {nmt:<15} ", ""),
        (f"{age:>8}", ALARM if node.late else ""),
        _phase(node),
    )
    return CursorRow(key, line, node)


def _phase(node: NodeView) -> tuple[str, str]:
    if node.phase is NodePhase.READY:
        return "", ""
    problem = f": {node.problem}" if node.problem else ""
    return f"  {node.phase.value}{problem}", ALARM if problem else DIM


def _component(component: ComponentView, folded: Collection[str]) -> _SystemRow:
    key = f"component {component.name}"
    line = (
        (_fold(key, folded), ""),
        (f"    {component.name:<12} ", "bold"),
        _state(component.state),
        (f" {component.type_name}", DIM),
    )
    return CursorRow(key, line, component)


def _fold(key: str, folded: Collection[str]) -> str:
    return _FOLDED if key in folded else _OPEN


def _state(state: str) -> tuple[str, str]:
    return f"{state.capitalize():<8}", STATES.get(state, DIM)


@lru_cache(_KEPT_ROWS)
def _pdo(pdo: PdoView, source: PdoName | None, marked: str) -> _SystemRow:
    key = f"pdo {pdo.name}"
    linked = f" ← {source}" if source else ""
    text = f"{pdo.cob_id:03X}h {pdo.bits:>2} bits  {pdo.index:04X}h ↔ {pdo.proxy_index:04X}h"
    line: Line = (
        (f"      {pdo.name!s:<12} ", _style(key, marked)),
        (text, DIM),
        (linked, "green"),
    )
    return CursorRow(key, line, pdo)


@lru_cache(_KEPT_ROWS)
def _port(port: PortView, marked: str) -> _SystemRow:
    key = f"port {port.name}"
    way = "out" if port.out else "in "
    peers = f" {'→' if port.out else '←'} {', '.join(port.peers)}" if port.peers else ""
    line: Line = (
        (f"      {way} {port.name:<20} ", _style(key, marked)),
        (port.data_type, DIM),
        (peers, "green"),
    )
    return CursorRow(key, line, port)


def _style(key: str, marked: str) -> str:
    return LIT if key == marked else ""


def _joints(system: SystemView) -> Iterator[_SystemRow]:
    for link in system.links:
        text = f"{link.source} → {link.target}"
        yield CursorRow(f"link {text}", (("  PDO link   ", DIM), (text, "green")), link)
    for entry in system.connections:
        text = f"{entry.source} → {entry.target}"
        waits = (("  waits for its ports", DIM),) if entry in system.waiting else ()
        yield CursorRow(
            f"connection {text}", (("  through PC ", DIM), (text, "green"), *waits), entry
        )


def boxes_and_edges(system: SystemView) -> tuple[list[Box], list[Edge]]:
    """Return the boxes (nodes, components) and edges (connections, PDO links) of a picture."""
    boxes, port_of = list[Box](), dict[PdoName, str]()
    owners: tuple[_Owner, ...] = (*system.nodes, *system.components)
    for one in owners:
        sides: tuple[list[str], list[str]] = [], []
        for port in one.ports:
            sides[port.out].append(port.name.rpartition(".")[2])
            if port.pdo is not None:
                port_of.setdefault(port.pdo, port.name)
        if isinstance(one, NodeView):
            title, state = f"node {one.node_id}", one.proxy_state or one.phase.value
            names = {pdo.name: f"{one.name}.{pdo.name.pdo}" for pdo in one.pdos}
            port_of = names | port_of  # a PDO without a port has a place all the same
        else:
            title, state = one.type_name, one.state
        boxes.append(Box(one.name, title, tuple(sides[False]), tuple(sides[True]), state))
    edges = [Edge(entry.source, entry.target) for entry in system.connections]
    edges += [
        Edge(port_of[link.source], port_of[link.target], dashed=True)
        for link in system.links
        if link.source in port_of and link.target in port_of
    ]
    return boxes, edges


def joints(system: SystemView, port: PortView) -> list[PdoLink | RtConnection]:
    """Return the connections and links of a port."""
    return [
        *(one for one in system.connections if port.name in (one.source, one.target)),
        *(one for one in system.links if port.pdo in (one.source, one.target)),
    ]


def connect(view: ServerView, first: Item, second: Item) -> None:
    """Connect two ports through the PC. Either port may be given first.

    Raise ServerRefused or RtcRefused if the ports do not fit.
    """
    if not (isinstance(first, PortView) and isinstance(second, PortView)):
        raise ServerRefused("through the PC go ports: mark one, go to another")
    out, in_ = (first, second) if first.out else (second, first)
    view.connect(out.name, in_.name)


def link(view: ServerView, first: Item, second: Item) -> None:
    """Link a TPDO of a node directly with an RPDO of another node. Either may be given first.

    Raise ServerRefused if the PDOs do not fit.
    """
    ends = [
        one.pdo if isinstance(one, PortView) else one.name
        for one in (first, second)
        if isinstance(one, PdoView | PortView)
    ]
    names = [one for one in ends if one is not None]
    if len(names) != 2:
        raise ServerRefused("linked are PDOs: mark one, go to another")
    source, target = sorted(names, key=lambda name: name.pdo[0] != "t")
    if (source.pdo[0], target.pdo[0]) != ("t", "r"):
        raise ServerRefused(f"{source} and {target}: a TPDO is linked with an RPDO")
    view.link(source, target)


def remove(view: ServerView, item: Item) -> None:
    """End a link or connection. Raise ServerRefused for any other item."""
    match item:
        case PdoLink(source, target):
            view.unlink(source, target)
        case RtConnection(first, second):
            view.disconnect(first, second)
        case _:
            raise ServerRefused("links and connections are removed: they are at the end")


class SystemPane(CursorView[Item]):
    """Pane of the CANopen editor that lists the nodes of a system with their ports, PDOs and links.

    Commands apply to the row under the cursor.

    Attributes:
        folded: keys of rows whose sub-rows are hidden.
        marked: port or PDO that the user marked for a connection.
        node_id: node whose rows contained the cursor last, or 0 for no node.
    """

    HELP = """
    # System

    Nodes with the state of the proxy, that of NMT, and how long ago the heartbeat was; their
    PDOs and ports; other components; at the end what joins them.

    To join two: mark a port or PDO, go to another, then connect them through the PC (ports) or
    link them without it (PDOs). To end it: go to it at the end, and remove it.

    A click moves the cursor; a double click, or one at the margin, opens and folds.
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("left", "fold(True)", "fold", show=False),
        Binding("right", "fold(False)", "open", show=False),
    ]

    def __init__(self) -> None:
        super().__init__("system")
        self.forget()

    def forget(self) -> None:
        """Clear the pane for another system."""
        self.folded: set[str] = set()
        self.marked: _SystemRow | None = None
        self.node_id, self.cursor = 0, 0

    @property
    def owner(self) -> _Owner | None:
        """The node or component whose rows contain the cursor, or None for connections."""
        if self.row is None or isinstance(self.row.item, PdoLink | RtConnection):
            return None
        above = (row.item for row in reversed(self.rows_shown[: self.cursor + 1]))
        return next(item for item in above if isinstance(item, _Owner))

    def look(self, system: SystemView) -> None:
        """Show the present state."""
        self.offer(_system_rows(system, self.folded, self.marked.key if self.marked else ""))
        match self.owner:
            case NodeView() as node:
                self.node_id = node.node_id
            case ComponentView():
                self.node_id = 0

    def go_to(self, name: str) -> None:
        """Put the cursor on a node, component or port by its name."""
        for number, row in enumerate(self.rows_shown):
            if isinstance(row.item, NodeView | ComponentView | PortView) and row.item.name == name:
                self.put_cursor(number)
                return

    def mark(self) -> bool:
        """Mark the port or PDO under the cursor for a connection, or remove its mark.

        Return False if the row under the cursor is neither a port nor a PDO.
        """
        row = self.row
        if row is None or not isinstance(row.item, PdoView | PortView):
            return False
        self.marked = None if self.marked and self.marked.key == row.key else row
        return True

    def action_enter(self) -> None:
        """Fold or open the item under the cursor."""
        if self.row is not None:
            self.action_fold(self.row.key not in self.folded)

    def action_fold(self, folded: bool) -> None:
        """Hide or show the rows below the node or component under the cursor."""
        if self.row is not None and isinstance(self.row.item, _Owner):
            (self.folded.add if folded else self.folded.discard)(self.row.key)
            self.post_message(self.Entered(self))
