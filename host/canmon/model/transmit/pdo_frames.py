"""Frames of PDOs by the names of their objects: `5.rpdo1 target_velocity=100`."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final, NamedTuple

from tickrig.host.canmon.model.decode.node_memory import EdsObjects, NodeMemory
from tickrig.host.canmon.model.decode.object_text import ObjectText
from tickrig.host.canmon.model.decode.pdos import PDOS, Pdo, can_id_of
from tickrig.host.canmon.model.decode.sdo.transfer import write_entry
from tickrig.host.text.values import Setting, parse_setting
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.pdo import MAX_MAPPED_OBJECTS, MappedObject, pack_bits
from tickrig.wire.errors import FieldError

_PDO: Final = re.compile(r"([0-9]{1,3})\.([rt])pdo([0-9]{1,3})", re.IGNORECASE | re.ASCII)


class _Place(NamedTuple):
    name: str
    mapped: MappedObject
    text: ObjectText
    power_on: int


class PdoFrames:
    """Makes frames of what people call them.

    An object that is not named has its power-on value, else 0. Values are those on the wire:
    nothing is scaled.

    Args:
        eds: what the files say, by node-ID.
    """

    def __init__(self, eds: Mapping[int, EdsObjects]) -> None:
        self._nodes = {node: NodeMemory(objects) for node, objects in eds.items()}

    def frame(self, text: str) -> CanFrame:
        """Return the frame of `NODE.rpdoN NAME=VALUE ...`.

        Raises:
            ValueError: a node, PDO, object or value that there is not; it names those there are.
        """
        pdo, *settings = text.split()
        match = _PDO.fullmatch(pdo)
        if match is None:
            raise ValueError(f"{pdo!r} is neither a frame as 123#DEADBEEF nor a PDO as 5.rpdo1")
        node, number = int(match[1]), int(match[3])
        memory = self._nodes.get(node)
        if memory is None:
            raise ValueError(f"{pdo}: nobody described node {node}; give --eds {node}=FILE")
        if not 1 <= number <= PDOS:
            raise ValueError(f"{pdo}: PDOs are numbered 1 to {PDOS}")
        sent = Pdo(match[2].lower() == "r", node, number)
        places = _places(memory, sent.mapping, pdo)
        values = _values(places, settings, pdo)
        fields = [(values[place], place.mapped.bits) for place in places]
        can_id = can_id_of(sent, memory)
        if can_id is None:
            entry = write_entry((sent.parameter, 1))
            raise ValueError(f"{pdo}: it has no CAN-ID ({entry} is not valid)")
        return CanFrame(can_id, pack_bits(fields))


def _places(memory: NodeMemory, index: int, pdo: str) -> list[_Place]:
    count = memory.number(index, 0) or 0
    if not 1 <= count <= MAX_MAPPED_OBJECTS:
        raise ValueError(f"{pdo}: nothing is mapped to it ({write_entry((index, 0))} is {count})")
    found = (memory.number(index, sub) or 0 for sub in range(1, count + 1))
    return [_place(memory, MappedObject.parse(entry)) for entry in found]


def _place(memory: NodeMemory, mapped: MappedObject) -> _Place:
    text = memory.describe(mapped.index, mapped.sub)
    name = text.name or write_entry((mapped.index, mapped.sub))
    return _Place(name, mapped, text, memory.number(mapped.index, mapped.sub) or 0)


def _values(places: list[_Place], settings: list[str], pdo: str) -> dict[_Place, int]:
    values = {place: place.power_on for place in places}
    for setting in settings:
        name, equals, word = setting.partition("=")
        if not equals:
            raise ValueError(f"{pdo}: {setting!r} is not NAME=VALUE")
        place = _named(places, name, pdo)
        try:
            values[place] = _number(place, parse_setting(word))
        except FieldError:
            kind = place.text.kind
            written = kind.name if kind is not None else f"a number of {place.mapped.bits} bits"
            raise ValueError(f"{pdo}: {place.name} is {written}, {word} is not") from None
    return values


def _named(places: list[_Place], name: str, pdo: str) -> _Place:
    """Return the object that has this name, or the only one that begins with it."""
    found = [place for place in places if place.name == name.lower()]
    found = found or [place for place in places if place.name.startswith(name.lower())]
    if len(found) != 1:
        known = ", ".join(place.name for place in places)
        raise ValueError(
            f"{pdo}: {'no' if not found else 'more than one'} {name!r}; it has {known}"
        )
    return found[0]


def _number(place: _Place, value: Setting) -> int:
    """Return the bits of a value; FieldError if it is none of the object's type."""
    kind, bits = place.text.kind, place.mapped.bits
    if kind is None or kind.bits != bits:
        kind = None
    if kind in (DataType.REAL32, DataType.REAL64) and not isinstance(value, str):
        return int.from_bytes(kind.encode(float(value)), "little")
    if kind is not None and kind is not DataType.BOOLEAN:
        return int.from_bytes(kind.encode(value), "little")
    if not isinstance(value, int) or not 0 <= value < 1 << bits:
        raise FieldError(f"{value!r} does not fit {bits} bits")
    return value
