"""Values of a node held against others: those of a DCF, or of another node."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import NamedTuple

from tickrig.host.canmon.net.node_objects import Entry, NodeObjects
from tickrig.host.canmon.net.session import NetSession, failure_text
from tickrig.host.canmon.net.values import shown
from tickrig.host.canopen.commissioning.configuration import Values, same
from tickrig.host.canopen.errors import SdoAborted


class Difference(NamedTuple):
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
    session: NetSession, objects: NodeObjects, values: Mapping[Entry, bytes]
) -> Iterator[Difference]:
    """Read objects of a node, and yield those that differ; SdoTimeout if it does not answer."""
    for entry, wanted in sorted(values.items()):
        row = objects.rows.get(entry)
        if row is not None and not row.readable:
            yield Difference(entry, wanted, None, "it cannot be read")
            continue
        try:
            found = session.bus.read(objects.node_id, *entry, objects.size(entry))
        except SdoAborted as error:
            why = failure_text(error, lambda at: "").removeprefix(": ")
            yield Difference(entry, wanted, None, why)
            continue
        if not same(row, wanted, found):
            yield Difference(entry, wanted, found)


def line(objects: NodeObjects, one: Difference, where: str) -> str:
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
