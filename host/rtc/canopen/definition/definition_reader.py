"""Read a System Definition (ours: K16); YAML, so JSON is read as well."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection
from pathlib import Path
from typing import Any, Final

import yaml

from tickrig.host.rtc.canopen.definition.definition import (
    PDO_COUNT,
    BusEntry,
    MasterEntry,
    NodeEntry,
    PdoEntry,
    PdoLink,
    PdoName,
    Role,
    RtConnection,
    SdoEntry,
    SdoPortEntry,
    StartEntry,
    SystemDefinition,
)
from tickrig.host.rtc.canopen.definition.marked_yaml import (
    Reader,
    children,
    compose,
    flag,
    many,
    mapping,
    matching,
    once,
    one_of,
    rate,
    read_table,
    refuse,
    table,
    text,
    whole,
)
from tickrig.host.rtc.canopen.errors import DefinitionError
from tickrig.wire.canopen.pdo import MAX_PDO_BITS, MappedObject
from tickrig.wire.rtc_canopen.port_types import PORT_TYPES
from tickrig.wire.rtc_canopen.profile import PortDirection

LEAVE: Final = ("pre_operational", "stopped")
SIZES: Final = (1, 2, 4, 8)

_U8: Final = whole(0, 0xFF)
_U16: Final = whole(0, 0xFFFF)
_NODE_ID: Final = whole(1, 127)
_NAME: Final = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_PDO: Final = re.compile(r"[tr]pdo[1-9][0-9]{0,2}", re.ASCII)
_NODE_PDO: Final = re.compile(r"([1-9][0-9]{0,2})\.([tr]pdo[1-9][0-9]{0,2})", re.ASCII)
_PORT: Final = re.compile(r"[A-Za-z_]\w*\.\w+", re.ASCII)


def read_definition(path: Path) -> SystemDefinition:
    """Read a System Definition.

    Raises:
        OSError: the file cannot be read.
        DefinitionError: it cannot be used; the line says where and why.
    """
    try:
        return parse_definition(path.read_text("utf-8"))
    except UnicodeDecodeError as error:
        raise DefinitionError(f"{path}: byte {error.start} is not UTF-8") from error
    except ValueError as error:
        raise DefinitionError(f"{path}: {error}") from error


def parse_definition(content: str) -> SystemDefinition:
    """Read a System Definition.

    Raises:
        DefinitionError: what is wrong, with its line.
    """
    root = compose(content)
    known = children(root, "the file")
    ids: dict[int, NodeEntry] = {}
    if "nodes" in known:  # first: the rest refers to them
        for node in _read_nodes(known["nodes"][1]):
            ids[node.id] = node
    values = read_table(root, "the file", _fields(ids), ("nodes",))
    return SystemDefinition(**{**values, "nodes": tuple(ids.values())})


def _fields(ids: Collection[int]) -> dict[str, Reader]:
    return {
        "bus": _bus,
        "master": lambda node, place: _master(node, place, ids),
        "nodes": lambda node, place: None,
        "sdo": many(lambda node, place: _sdo(node, place, ids)),
        "pdo_links": once(
            lambda node, place: _link(node, place, ids),
            lambda link: f"{link.target} is linked",
        ),
        "rt_connections": many(_rt_connection),
        "start": lambda node, place: _start(node, place, ids),
    }


def _bus(node: yaml.Node, place: str) -> BusEntry:
    fields = {"channel": text, "interface": text, "bitrate": whole(1, 1_000_000)}
    return BusEntry(**read_table(node, place, fields))


def _master(node: yaml.Node, place: str, ids: Collection[int]) -> MasterEntry:
    fields: dict[str, Reader] = {
        "node": _NODE_ID,
        "heartbeat_ms": _U16,
        "sync_ms": _U16,
        "rate_hz": rate,
        "remove_ms": whole(0, 3_600_000),
        "reconnect": flag,
        "leave": one_of(*LEAVE),
    }
    values = read_table(node, place, fields)
    if "remove_ms" in values:
        values["remove_after_ms"] = values.pop("remove_ms")
    master = MasterEntry(**values)
    if master.node in ids:
        refuse(node, f"{place}: node {master.node} is one of the nodes")
    return master


def _read_nodes(node: yaml.Node) -> tuple[NodeEntry, ...]:
    seen: set[int | str] = set()

    def read(node: yaml.Node, place: str) -> NodeEntry:
        entry = _node(node, "a node")
        for word in (entry.id, entry.name):
            if word in seen:
                refuse(node, f"{place}: {word} is there twice")
            seen.add(word)
        return entry

    entries: tuple[NodeEntry, ...] = many(read)(node, "nodes")
    return entries


def _node(node: yaml.Node, place: str) -> NodeEntry:
    pdo = matching(_PDO, "tpdo2")
    fields: dict[str, Reader] = {
        "id": _NODE_ID,
        "name": matching(_NAME, "Palette0"),
        "eds": text,
        "role": one_of(*Role),
        "heartbeat_ms": whole(1, 0xFFFF),
        "restart": _U16,
        "ports": _ports,
        "pdos": mapping(pdo, _pdo),
        "sdo_ports": mapping(matching(_NAME, "label"), _sdo_port),
    }
    values = read_table(node, place, fields, ("id", "name", "eds"))
    if "role" in values:
        values["role"] = Role(values["role"])
    for name in values.get("sdo_ports", ()):
        if name in values.get("ports", {}).values():
            refuse(node, f"{place}: 2 ports are called {name}")
    for name in (*values.get("ports", ()), *values.get("pdos", ())):
        _check_number(node, place, name)
    return NodeEntry(**values)


def _ports(node: yaml.Node, place: str) -> dict[str, str]:
    names: dict[str, str] = mapping(matching(_PDO, "tpdo2"), matching(_NAME, "ai"))(node, place)
    for name, count in Counter(names.values()).items():
        if count > 1:
            refuse(node, f"{place}: {count} ports are called {name}")
    return names


def _pdo(node: yaml.Node, place: str) -> PdoEntry:
    fields: dict[str, Reader] = {
        "mapping": _mapping,
        "cob_id": whole(0x181, 0x6DF),
        "type": _U8,
        "inhibit_100us": _U16,
        "event_ms": _U16,
    }
    return PdoEntry(**read_table(node, place, fields))


def _sdo_port(node: yaml.Node, place: str) -> SdoPortEntry:
    fields: dict[str, Reader] = {
        "index": whole(0x1000, 0xFFFF),
        "direction": one_of(*(item.value for item in PortDirection)),
        "type": one_of(*PORT_TYPES),
    }
    values = read_table(node, place, fields, ("index", "direction"))
    return SdoPortEntry(**{**values, "direction": PortDirection(values["direction"])})


def _mapping(node: yaml.Node, place: str) -> tuple[MappedObject, ...]:
    entries = many(whole(0, 0xFFFF_FFFF))(node, place)
    mapped = tuple(MappedObject.parse(entry) for entry in entries)
    if (bits := sum(entry.bits for entry in mapped)) > MAX_PDO_BITS:
        refuse(node, f"{place}: {bits} bits, a PDO has {MAX_PDO_BITS}")
    return mapped


def _sdo(node: yaml.Node, place: str, ids: Collection[int]) -> SdoEntry:
    fields: dict[str, Reader] = {
        "node": _NODE_ID,
        "index": _U16,
        "sub": _U8,
        "value": whole(-(1 << 63), (1 << 64) - 1),
        "size": whole(1, 8),
    }
    entry = SdoEntry(**read_table(node, place, fields, fields))
    _check_known(node, place, entry.node, ids)
    if entry.size not in SIZES:
        refuse(node, f"{place}: size {entry.size} is none of: 1, 2, 4, 8")
    if not -(1 << 8 * entry.size - 1) <= entry.value < 1 << 8 * entry.size:
        refuse(node, f"{place}: {entry.value} does not fit into size {entry.size}")
    return entry


def _link(node: yaml.Node, place: str, ids: Collection[int]) -> PdoLink:
    def end(node: yaml.Node, place: str, kind: str) -> PdoName:
        match = _NODE_PDO.fullmatch(text(node, place))
        if match is None or match[2][:4] != kind:
            refuse(node, f"{place}: {node.value!r} is not like 16.{kind}2")
        _check_number(node, place, match[2])
        name = PdoName(int(match[1]), match[2])
        _check_known(node, place, name.node, ids)
        return name

    fields: dict[str, Reader] = {
        "from": lambda node, place: end(node, place, "tpdo"),
        "to": lambda node, place: end(node, place, "rpdo"),
    }
    ends = read_table(node, place, fields, fields)
    return PdoLink(ends["from"], ends["to"])


def _rt_connection(node: yaml.Node, place: str) -> RtConnection:
    port = matching(_PORT, "Palette0.ai")
    properties = mapping(text, text)
    fields: dict[str, Reader] = {"from": port, "to": port, "properties": properties}
    values: dict[str, Any] = read_table(node, place, fields, ("from", "to"))
    return RtConnection(values["from"], values["to"], values.get("properties", {}))


def _start(node: yaml.Node, place: str, ids: Collection[int]) -> StartEntry:
    def known(node: yaml.Node, place: str) -> int:
        node_id: int = _NODE_ID(node, place)
        _check_known(node, place, node_id, ids)
        return node_id

    order = once(known, lambda node_id: f"node {node_id} is there")
    return StartEntry(**table({"order": order, "autoactivate": flag})(node, place))


def _check_number(node: yaml.Node, place: str, pdo: str) -> None:
    if int(pdo[4:]) > PDO_COUNT:
        refuse(node, f"{place}: {pdo}, there are {PDO_COUNT} at most")


def _check_known(node: yaml.Node, place: str, node_id: int, ids: Collection[int]) -> None:
    if node_id not in ids:
        refuse(node, f"{place}: node {node_id} is none of: {', '.join(map(str, ids)) or 'none'}")
