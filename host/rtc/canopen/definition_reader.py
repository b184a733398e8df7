r"""Read a System Definition (ours: K16). The format is YAML, so JSON is also accepted.

>>> item = _compose("a: 0x10\nb: [1, x]")
>>> _read_table(item, "file", {"a": whole(0, 99), "b": many(whole(0, 9))})
Traceback (most recent call last):
    ...
tickrig.host.rtc.canopen.definition.DefinitionError: line 2: b: 'x' is not a whole number in 0..9
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Collection, Mapping
from enum import Enum
from pathlib import Path
from typing import Any, Final, NoReturn

from tickrig.host.rtc.canopen import definition
from tickrig.host.text.document import FilePlace, Item
from tickrig.host.text.yaml_reader import read_yaml
from tickrig.wire.canopen.nmt import FLAG_30, INVALID
from tickrig.wire.canopen.pdo import MAX_PDO_BITS, MappedObject
from tickrig.wire.rtc_canopen import PORT_TYPES, PortDirection

_Reader = Callable[[Item, str], Any]
"""Function that reads a value of the tree. The text argument names the value in messages."""


def _compose(text: str) -> Item:
    """Read a text into its tree. Raise DefinitionError if it is not YAML, or empty."""
    tree, wrong = read_yaml(text, "")
    for one in wrong:
        if one.rule not in _OF_BUS_FILES:
            raise definition.DefinitionError(one.text, one.place.line)
    if tree is None:
        raise definition.DefinitionError("the file is empty", 1)
    return tree


def _refuse(where: Item | FilePlace, message: str) -> NoReturn:
    """Raise a DefinitionError with the line of a value or of a key."""
    place = where.place if isinstance(where, Item) else where
    raise definition.DefinitionError(message, place.line)


def _read_table(
    node: Item, place: str, fields: Mapping[str, _Reader], needed: Collection[str] = ()
) -> dict[str, Any]:
    """Read a mapping whose keys are known."""
    items = _children(node, place)
    for key, (key_place, _) in items.items():
        if key not in fields:
            _refuse(key_place, f"{place}: {key!r} is not one of: {', '.join(fields)}")
    for key in needed:
        if key not in items:
            _refuse(node, f"{place} has no {key!r}")
    return {key: fields[key](value, key) for key, (_, value) in items.items()}


def _children(node: Item, place: str) -> dict[str, tuple[FilePlace, Item]]:
    """Return the values of a mapping, and the places of their keys, by the text of the key."""
    if not node.is_mapping:
        _refuse(node, f"{place} is written 'key: value', this is not")
    for key in node.fields:
        if isinstance(key, bool) or not isinstance(key, str | int):
            _refuse(node.keys[key], f"{place}: YAML reads a key as {key}; put it into quotes")
    return {str(key): (node.keys[key], value) for key, value in node.fields.items()}


def mapping(key: Callable[[Item, str], str], value: _Reader) -> _Reader:
    """Read a mapping with checked keys."""

    def read(node: Item, place: str) -> dict[str, Any]:
        return {
            key(Item(name, key_place, name), place): value(child, f"{place}.{name}")
            for name, (key_place, child) in _children(node, place).items()
        }

    return read


def many(item: _Reader) -> _Reader:
    """Read a list."""

    def read(node: Item, place: str) -> tuple[Any, ...]:
        if not node.is_list:
            _refuse(node, f"{place} is a list, this is not")
        return tuple(item(child, place) for child in node.items)

    return read


def _once(item: _Reader, twice: Callable[[Any], str]) -> _Reader:
    """Return a reader of a list whose items must differ.

    `twice` makes the text of the error, such as `node 5 is there`.
    """

    def read(node: Item, place: str) -> tuple[Any, ...]:
        seen: set[str] = set()

        def unlike(child: Item, place: str) -> Any:
            value = item(child, place)
            if (words := twice(value)) in seen:
                _refuse(child, f"{place}: {words} twice")
            seen.add(words)
            return value

        values: tuple[Any, ...] = many(unlike)(node, place)
        return values

    return read


def _checked(allows: Callable[[Any], bool], what: str) -> _Reader:
    """Return a reader of a scalar. `what` names the allowed values in messages."""

    def read(node: Item, place: str) -> Any:
        value = _plain(node)
        if not allows(value):
            _refuse(node, f"{place}: {value!r} is not {what}")
        return value

    return read


def whole(low: int, high: int) -> _Reader:
    """Return a function that reads and checks one integer in a definition.

    The number is written in decimal or as 0x...

    Args:
        low: lowest allowed number.
        high: highest allowed number.
    """
    what = f"a whole number in {low}..{high}"
    return _checked(lambda value: type(value) is int and low <= value <= high, what)


def _rate(node: Item, place: str) -> float:
    """Read a number of Hz, above 0 and up to 1 kHz."""
    value = _plain(node)
    if type(value) not in (int, float) or not 0 < value <= 1_000:
        _refuse(node, f"{place}: {value!r} is not a number with 0 < {place} <= 1000")
    return float(value)


def text(node: Item, place: str) -> str:
    """Read a text, quoted or not."""
    value = node.value if isinstance(node.value, str) else node.text
    if not value:
        _refuse(node, f"{place} is a text, this is not")
    return value


def _matching(pattern: re.Pattern[str], like: str) -> Callable[[Item, str], str]:
    """Read a text that matches a pattern. `like` is an example for messages."""

    def read(node: Item, place: str) -> str:
        value = text(node, place)
        if pattern.fullmatch(value) is None:
            _refuse(node, f"{place}: {value!r} is not like {like}")
        return value

    return read


def _one_of(*words: str) -> _Reader:
    """Read one of some words."""

    def read(node: Item, place: str) -> str:
        if (value := text(node, place)) not in words:
            _refuse(node, f"{place}: {value!r} is not one of: {', '.join(words)}")
        return value

    return read


def _member_of(kind: type[Enum]) -> _Reader:
    """Read a member of an enumeration by its value."""
    word = _one_of(*(item.value for item in kind))
    return lambda node, place: kind(word(node, place))


_flag: Final = _checked(lambda value: type(value) is bool, "true or false")


def _plain(node: Item) -> Any:
    """Return the value of a scalar. For a list or mapping, return what it is as a word."""
    if node.is_list:
        return "a list"
    return "a table" if node.is_mapping else node.value


_OF_BUS_FILES: Final = ("yaml-number", "yaml-value")
"""Rules of `read_yaml` for values. The readers in this module report the allowed values."""
_LEAVE: Final = ("pre_operational", "stopped")
_SIZES: Final = (1, 2, 4, 8)

_U8: Final = whole(0, 0xFF)
_U16: Final = whole(0, 0xFFFF)
_NODE_ID: Final = whole(1, 127)
_NAME: Final = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_PDO: Final = re.compile(r"[tr]pdo[1-9][0-9]{0,2}", re.ASCII)
_NODE_PDO: Final = re.compile(r"([1-9][0-9]{0,2})\.([tr]pdo[1-9][0-9]{0,2})", re.ASCII)
_PORT: Final = re.compile(r"[A-Za-z_]\w*\.\w+", re.ASCII)


def read_definition(path: Path) -> definition.SystemDefinition:
    """Read a System Definition (settings of the CANopen server) from a file.

    Raises:
        OSError: the file cannot be read.
        DefinitionError: the definition cannot be used. The error has the line and the reason.
    """
    try:
        return parse_definition(path.read_text("utf-8"))
    except UnicodeDecodeError as error:
        raise definition.DefinitionError(f"{path}: byte {error.start} is not UTF-8") from error
    except ValueError as error:
        raise definition.DefinitionError(f"{path}: {error}") from error


def parse_definition(content: str) -> definition.SystemDefinition:
    """Read a System Definition (settings of the CANopen server) from a YAML or JSON text.

    Raises:
        DefinitionError: the text is not a valid definition. The error has the line and the reason.
    """
    root = _compose(content)
    known = _children(root, "the file")
    ids: dict[int, definition.NodeEntry] = {}
    if "nodes" in known:  # first: the rest refers to them
        for node in _read_nodes(known["nodes"][1]):
            ids[node.id] = node
    values = _read_table(root, "the file", _fields(ids), ("nodes",))
    return definition.SystemDefinition(**{**values, "nodes": tuple(ids.values())})


def _fields(ids: Collection[int]) -> dict[str, _Reader]:
    return {
        "bus": _bus,
        "master": lambda node, place: _master(node, place, ids),
        "nodes": lambda node, place: None,
        "sdo": many(lambda node, place: _sdo(node, place, ids)),
        "pdo_links": _once(
            lambda node, place: _link(node, place, ids), lambda link: f"{link.target} is linked"
        ),
        "rt_connections": many(_rt_connection),
        "start": lambda node, place: _start(node, place, ids),
    }


def _bus(node: Item, place: str) -> definition.BusEntry:
    fields = {"channel": text, "interface": text, "bitrate": whole(1, 1_000_000)}
    return definition.BusEntry(**_read_table(node, place, fields))


def _master(node: Item, place: str, ids: Collection[int]) -> definition.MasterEntry:
    fields: dict[str, _Reader] = {
        "node": _NODE_ID,
        "heartbeat_ms": _U16,
        "sync_ms": _U16,
        "rate_hz": _rate,
        "remove_ms": whole(0, 3_600_000),
        "reconnect": _flag,
        "leave": _one_of(*_LEAVE),
    }
    values = _read_table(node, place, fields)
    if "remove_ms" in values:
        values["remove_after_ms"] = values.pop("remove_ms")
    master = definition.MasterEntry(**values)
    if master.node in ids:
        _refuse(node, f"{place}: node {master.node} is one of the nodes")
    return master


def _read_nodes(node: Item) -> tuple[definition.NodeEntry, ...]:
    seen: set[int | str] = set()

    def read(node: Item, place: str) -> definition.NodeEntry:
        entry = _node(node, "a node")
        for word in (entry.id, entry.name):
            if word in seen:
                _refuse(node, f"{place}: {word} is there twice")
            seen.add(word)
        return entry

    entries: tuple[definition.NodeEntry, ...] = many(read)(node, "nodes")
    return entries


def _node(node: Item, place: str) -> definition.NodeEntry:
    pdo = _matching(_PDO, "tpdo2")
    fields: dict[str, _Reader] = {
        "id": _NODE_ID,
        "name": _matching(_NAME, "Palette0"),
        "eds": text,
        "role": _member_of(definition.Role),
        "heartbeat_ms": whole(1, 0xFFFF),
        "restart": _U16,
        "ports": _ports,
        "pdos": mapping(pdo, _pdo),
        "sdo_ports": mapping(_matching(_NAME, "label"), _sdo_port),
    }
    values = _read_table(node, place, fields, ("id", "name", "eds"))
    for name in values.get("sdo_ports", ()):
        if name in values.get("ports", {}).values():
            _refuse(node, f"{place}: 2 ports are called {name}")
    for name in (*values.get("ports", ()), *values.get("pdos", ())):
        _check_number(node, place, name)
    return definition.NodeEntry(**values)


def _ports(node: Item, place: str) -> dict[str, str]:
    names: dict[str, str] = mapping(_matching(_PDO, "tpdo2"), _matching(_NAME, "ai"))(node, place)
    for name, count in Counter(names.values()).items():
        if count > 1:
            _refuse(node, f"{place}: {count} ports are called {name}")
    return names


def _pdo(node: Item, place: str) -> definition.PdoEntry:
    fields: dict[str, _Reader] = {
        "mapping": _mapping,
        "cob_id": _cob_id,
        "type": _U8,
        "inhibit_100us": _U16,
        "event_ms": _U16,
    }
    return definition.PdoEntry(**_read_table(node, place, fields))


def _cob_id(node: Item, place: str) -> int:
    """Read a CAN-ID of a PDO. Bit 31 means that the PDO is off, bit 30 excludes remote requests."""
    flags = INVALID | FLAG_30
    ids = definition.PDO_CAN_IDS
    number = whole(ids.start, flags | ids.stop - 1)(node, place)
    if number & ~flags not in ids:
        allowed = f"0x{ids.start:X}..0x{ids.stop - 1:X}, with bit 31 if the PDO is off"
        _refuse(node, f"{place}: 0x{number:X} is not {allowed}")
    return int(number)


def _sdo_port(node: Item, place: str) -> definition.SdoPortEntry:
    fields: dict[str, _Reader] = {
        "index": whole(0x1000, 0xFFFF),
        "direction": _member_of(PortDirection),
        "type": _one_of(*PORT_TYPES),
    }
    return definition.SdoPortEntry(**_read_table(node, place, fields, ("index", "direction")))


def _mapping(node: Item, place: str) -> tuple[MappedObject, ...]:
    entries = many(whole(0, 0xFFFF_FFFF))(node, place)
    mapped = tuple(MappedObject.parse(entry) for entry in entries)
    if (bits := sum(entry.bits for entry in mapped)) > MAX_PDO_BITS:
        _refuse(node, f"{place}: {bits} bits, a PDO has {MAX_PDO_BITS}")
    return mapped


def _sdo(node: Item, place: str, ids: Collection[int]) -> definition.SdoEntry:
    fields: dict[str, _Reader] = {
        "node": _NODE_ID,
        "index": _U16,
        "sub": _U8,
        "value": whole(-(1 << 63), (1 << 64) - 1),
        "size": whole(1, 8),
    }
    entry = definition.SdoEntry(**_read_table(node, place, fields, fields))
    _check_known(node, place, entry.node, ids)
    if entry.size not in _SIZES:
        _refuse(node, f"{place}: size {entry.size} is not one of: 1, 2, 4, 8")
    if not -(1 << 8 * entry.size - 1) <= entry.value < 1 << 8 * entry.size:
        _refuse(node, f"{place}: {entry.value} does not fit into size {entry.size}")
    return entry


def _link(node: Item, place: str, ids: Collection[int]) -> definition.PdoLink:
    def end(node: Item, place: str, kind: str) -> definition.PdoName:
        match = _NODE_PDO.fullmatch(text(node, place))
        if match is None or match[2][:4] != kind:
            _refuse(node, f"{place}: {_plain(node)!r} is not like 16.{kind}2")
        _check_number(node, place, match[2])
        name = definition.PdoName(int(match[1]), match[2])
        _check_known(node, place, name.node, ids)
        return name

    fields: dict[str, _Reader] = {
        "from": lambda node, place: end(node, place, "tpdo"),
        "to": lambda node, place: end(node, place, "rpdo"),
    }
    ends = _read_table(node, place, fields, fields)
    return definition.PdoLink(ends["from"], ends["to"])


def _rt_connection(node: Item, place: str) -> definition.RtConnection:
    port = _matching(_PORT, "Palette0.ai")
    properties = mapping(text, text)
    fields: dict[str, _Reader] = {"from": port, "to": port, "properties": properties}
    values: dict[str, Any] = _read_table(node, place, fields, ("from", "to"))
    return definition.RtConnection(values["from"], values["to"], values.get("properties", {}))


def _start(node: Item, place: str, ids: Collection[int]) -> definition.StartEntry:
    def known(node: Item, place: str) -> int:
        node_id: int = _NODE_ID(node, place)
        _check_known(node, place, node_id, ids)
        return node_id

    order = _once(known, lambda node_id: f"node {node_id} is there")
    fields: dict[str, _Reader] = {"order": order, "autoactivate": _flag}
    return definition.StartEntry(**_read_table(node, place, fields))


def _check_number(node: Item, place: str, pdo: str) -> None:
    if int(pdo[4:]) > definition.PDO_COUNT:
        _refuse(node, f"{place}: {pdo}, there are {definition.PDO_COUNT} at most")


def _check_known(node: Item, place: str, node_id: int, ids: Collection[int]) -> None:
    if node_id not in ids:
        _refuse(
            node, f"{place}: node {node_id} is not one of: {', '.join(map(str, ids)) or 'none'}"
        )
