"""What is another device in one file than in another."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

from tickrig.host.canopen.data_sheet.document import Document
from tickrig.host.canopen.data_sheet.notation import (
    access_text,
    default_text,
    limit_text,
    rates_text,
)
from tickrig.host.canopen.data_sheet.rules.known_keys import FLAGS, NUMBERS
from tickrig.wire.canopen.eds.eds_value import parse_number, plain_numbers
from tickrig.wire.canopen.eds.object_table import EntryDescription


class Change(NamedTuple):
    """One difference.

    Attributes:
        place: `DeviceInfo`, `2000h` or `2000h:01`.
        what: the field, or `object` or `entry` of what is in one file only.
        old: of the first file, empty if it has none.
        new: of the second file, likewise.
    """

    place: str
    what: str
    old: str
    new: str

    def __str__(self) -> str:
        """Say it in one line."""
        if self.what in WHOLE:
            sign, name = ("-", self.old) if self.old else ("+", self.new)
            return f"{sign} {self.place} {name}"
        return f"~ {self.place} {self.what}: {self.old or '-'} -> {self.new or '-'}"


WHOLE: Final = ("object", "entry")


def diff(one: Document, other: Document) -> list[Change]:
    """Return all differences: device, identity, bit rates, then objects by index.

    The order of sections, the notation of numbers and what no device has (dates, file names,
    comments) make none.
    """
    return [*_device(one, other), *_objects(one, other)]


def _device(one: Document, other: Document) -> Iterator[Change]:
    pairs = [
        ("vendor", one.device.info.vendor_name, other.device.info.vendor_name),
        ("product", one.device.info.product_name, other.device.info.product_name),
        ("order code", one.device.info.order_code, other.device.info.order_code),
        ("bit rates", rates_text(one.device.info), rates_text(other.device.info)),
        ("node-ID", str(one.device.node_id or ""), str(other.device.node_id or "")),
    ]
    for key in (*NUMBERS, *FLAGS):
        if not key.startswith("BaudRate"):
            pairs.append((key, _number(one, key), _number(other, key)))
    for what, old, new in pairs:
        if old != new:
            yield Change("DeviceInfo", what, old, new)


def _number(document: Document, key: str) -> str:
    """Return a number of [DeviceInfo] in one notation; 0 is what is not there."""
    text = plain_numbers(document.file.value("DeviceInfo", key))
    try:
        number = parse_number(text or "0")
    except ValueError:
        return text
    return f"0x{number:X}"


def _objects(one: Document, other: Document) -> Iterator[Change]:
    old, new = one.device.objects, other.device.objects
    all_subs: dict[int, set[int]] = {}
    for at, sub in (*one.rows, *other.rows):
        all_subs.setdefault(at, set()).add(sub)
    for index in sorted({*old, *new}):
        place = f"{index:04X}h"
        before, after = old.get(index), new.get(index)
        if before is None or after is None:
            name = "" if before is None else before.name or "-"
            yield Change(place, "object", name, "" if after is None else after.name or "-")
            continue
        if before.name != after.name:
            yield Change(place, "name", before.name, after.name)
        if before.code is not after.code:
            yield Change(place, "kind", before.code.name, after.code.name)
        yield from _entries(one, other, index, all_subs.get(index, set()))


def _entries(one: Document, other: Document, index: int, subs: set[int]) -> Iterator[Change]:
    for sub in sorted(subs):
        before, after = one.rows.get((index, sub)), other.rows.get((index, sub))
        place = f"{index:04X}h:{sub:02X}"
        if before is None or after is None:
            old, new = (row.name or "-" if row else "" for row in (before, after))
            yield Change(place, "entry", old, new)
            continue
        fields = zip(_fields(before), _fields(after), strict=True)
        for (what, old), (_, new) in fields:
            named = what == "name" and len(subs) == 1
            if old != new and not named:
                yield Change(place, what, old, new)


def _fields(row: EntryDescription) -> list[tuple[str, str]]:
    return [
        ("name", row.name),
        ("type", row.data_type.name),
        ("access", access_text(row)),
        ("default", default_text(row)),
        ("low limit", limit_text(row.low)),
        ("high limit", limit_text(row.high)),
        ("unit", row.unit),
        ("factor", f"{row.factor:g}"),
    ]
