"""A system as lines of a tree: nodes with their PDOs and ports, then what joins them."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from functools import lru_cache
from typing import Final

from tickrig.host.rtc_canopen.definition.definition import PdoLink, PdoName, RtConnection
from tickrig.host.rtc_canopen.editor.row import Row
from tickrig.host.rtc_canopen.node.served_node import Phase
from tickrig.host.rtc_canopen.view import (
    NOT_HEARD,
    ComponentView,
    NodeView,
    PdoView,
    PortView,
    SystemView,
)
from tickrig.host.tui.line_view import Line

Item = NodeView | ComponentView | PdoView | PortView | PdoLink | RtConnection
SystemRow = Row[Item]

STATES: Final = {
    "ACTIVE": "bold green",
    "INACTIVE": "cyan",
    "ERROR": "bold white on red",
}
DIM: Final = "bright_black"
ALARM: Final = "bold red"
MARK: Final = "bold yellow"

KEPT_ROWS: Final = 4_096
"""More than 127 nodes have; a row that is the same is not written again."""

FOLDED: Final = "▸ "
OPEN: Final = "▾ "


def system_rows(
    system: SystemView, folded: Collection[str] = (), marked: str = ""
) -> list[SystemRow]:
    """Return the rows.

    Args:
        system: what there is.
        folded: keys of nodes and components that are shown without what they have.
        marked: key of the port or PDO that is to be connected.
    """
    sources = {link.target: link.source for link in system.links}
    rows: list[SystemRow] = []
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


def _node(node: NodeView, folded: Collection[str]) -> SystemRow:
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
    return Row(key, line, node)


def _phase(node: NodeView) -> tuple[str, str]:
    if node.phase is Phase.READY:
        return "", ""
    problem = f": {node.problem}" if node.problem else ""
    return f"  {node.phase.value}{problem}", ALARM if problem else DIM


def _component(component: ComponentView, folded: Collection[str]) -> SystemRow:
    key = f"component {component.name}"
    line = (
        (_fold(key, folded), ""),
        (f"    {component.name:<12} ", "bold"),
        _state(component.state),
        (f" {component.type_name}", DIM),
    )
    return Row(key, line, component)


def _fold(key: str, folded: Collection[str]) -> str:
    return FOLDED if key in folded else OPEN


def _state(state: str) -> tuple[str, str]:
    return f"{state.capitalize():<8}", STATES.get(state, DIM)


@lru_cache(KEPT_ROWS)
def _pdo(pdo: PdoView, source: PdoName | None, marked: str) -> SystemRow:
    key = f"pdo {pdo.name}"
    linked = f" ← {source}" if source else ""
    text = f"{pdo.cob_id:03X}h {pdo.bits:>2} bits  {pdo.index:04X}h ↔ {pdo.proxy_index:04X}h"
    line: Line = ((f"      {pdo.name!s:<12} ", _style(key, marked)), (text, DIM), (linked, "green"))
    return Row(key, line, pdo)


@lru_cache(KEPT_ROWS)
def _port(port: PortView, marked: str) -> SystemRow:
    key = f"port {port.name}"
    way = "out" if port.out else "in "
    peers = f" {'→' if port.out else '←'} {', '.join(port.peers)}" if port.peers else ""
    line: Line = (
        (f"      {way} {port.name:<20} ", _style(key, marked)),
        (port.data_type, DIM),
        (peers, "green"),
    )
    return Row(key, line, port)


def _style(key: str, marked: str) -> str:
    return MARK if key == marked else ""


def _joints(system: SystemView) -> Iterator[SystemRow]:
    for link in system.links:
        text = f"{link.source} → {link.target}"
        yield Row(f"link {text}", (("  PDO link   ", DIM), (text, "green")), link)
    for entry in system.connections:
        text = f"{entry.source} → {entry.target}"
        waits = (("  waits for its ports", DIM),) if entry in system.waiting else ()
        yield Row(f"connection {text}", (("  through PC ", DIM), (text, "green"), *waits), entry)
