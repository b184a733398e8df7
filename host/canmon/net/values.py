"""Values of objects, as people read and write them, and held against others."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Final, NamedTuple

from tickrig.host.canmon.model.decode.object_text import ObjectText, drive_state
from tickrig.host.canmon.model.node_dictionary import encode_value
from tickrig.host.canmon.net.node_objects import TYPES, Entry, NamedObjects
from tickrig.host.canmon.net.session import NetSession, failure_text
from tickrig.host.canopen.commissioning.configuration import Values, same
from tickrig.host.canopen.errors import SdoAborted
from tickrig.host.cli.messages import Refused
from tickrig.wire.canopen.datatypes import DataType

# Values of objects, as people read and write them.

_STATUSWORD: Final = (0x6041, 0)
_MOST_SHOWN: Final = 64
"""Bytes of a domain; of longer ones the number is told."""


def shown(objects: NamedObjects, entry: Entry, data: bytes) -> str:
    """Write a value with its unit; whole numbers in hex too, identifiers and bits in hex alone."""
    text = objects.text(entry)
    if len(data) > _MOST_SHOWN and (text.kind is None or text.kind is DataType.DOMAIN):
        return f"{len(data)} bytes, {data[:8].hex(' ').upper()} ..."
    value, said = text.read(data)
    if entry == _STATUSWORD and objects.is_drive and isinstance(value, int):
        return f"{said} {drive_state(value)}"
    if text.in_hex or text.kind is None:
        return said
    unit = f" {text.unit}" if text.unit else ""
    if text.kind.is_integer and text.kind is not DataType.BOOLEAN:
        return f"{said}{unit} (0x{int.from_bytes(data, 'little'):0{2 * len(data)}X})"
    return f"{said}{unit}"


def encoded(objects: NamedObjects, entry: Entry, words: str) -> bytes:
    """Return the bytes of a value, as `100`, `0x64`, `-1.5` in the object's unit, `u16:100`.

    Raises:
        Refused: it is no value of this object.
    """
    text = objects.text(entry)
    kind, colon, rest = words.partition(":")
    if colon and kind in TYPES:
        text, words = ObjectText(text.name, TYPES[kind]), rest
    if text.kind is None:
        raise Refused(
            f"the type of {objects.title(entry)} is not known: give its EDS (--eds FILE), or the"
            f" type before the value, as u16:100; types: {', '.join(TYPES)}"
        )
    try:
        data = encode_value(text, words)
    except ValueError as error:
        raise Refused(f"{objects.title(entry)}: {error}{_range(text)}") from None
    return data


def _range(text: ObjectText) -> str:
    """Say which numbers a whole number may be."""
    kind = text.kind
    if kind is None or not kind.is_integer:
        return ""
    low = -(1 << kind.bits - 1) if kind.signed else 0
    high = (1 << kind.bits - kind.signed) - 1
    factor = text.factor
    return f" ({low * factor:g} to {high * factor:g})" if factor != 1 else f" ({low} to {high})"


def limits(objects: NamedObjects, entry: Entry) -> str:
    """Say what the EDS allows of a value; empty where it says nothing."""
    row = objects.rows.get(entry)
    if row is None or (row.low is None and row.high is None):
        return ""
    low, high = ("..." if bound is None else f"{bound}" for bound in (row.low, row.high))
    return f"; the EDS allows {low} to {high}"


# Values of a node held against others: those of a DCF, or of another node.


class ValueDifference(NamedTuple):
    """An object whose value is another than wanted.

    Attributes:
        entry: index and sub-index.
        wanted: as it goes over the wire.
        found: likewise, None if the node refuses to tell it.
        why: it refuses.
    """

    entry: Entry
    wanted: bytes
    found: bytes | None
    why: str = ""


def differences(
    session: NetSession, objects: NamedObjects, values: Mapping[Entry, bytes]
) -> Iterator[ValueDifference]:
    """Read objects of a node, and yield those that differ; SdoTimeout if it does not answer."""
    for entry, wanted in sorted(values.items()):
        row = objects.rows.get(entry)
        if row is not None and not row.readable:
            yield ValueDifference(entry, wanted, None, "it cannot be read")
            continue
        try:
            found = session.bus.read(objects.node_id, *entry, objects.size(entry))
        except SdoAborted as error:
            why = failure_text(error, lambda at: "").removeprefix(": ")
            yield ValueDifference(entry, wanted, None, why)
            continue
        if not same(row, wanted, found):
            yield ValueDifference(entry, wanted, found)


def line(objects: NamedObjects, one: ValueDifference, where: str) -> str:
    """Say what is here, and what is there."""
    there = f"{shown(objects, one.entry, one.wanted)} {where}"
    here = one.why if one.found is None else f"{shown(objects, one.entry, one.found)} here"
    return f"{objects.title(one.entry)}: {here}, {there}"


def values_of(session: NetSession, node_id: int, entries: Collection[Entry]) -> Values:
    """Read objects of a node; what it refuses to tell is left out."""
    found: Values = {}
    for entry in sorted(entries):
        try:
            found[entry] = session.bus.read(node_id, *entry)
        except SdoAborted:
            continue
    return found
