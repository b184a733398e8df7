"""The device of a file, for display and for programs: head, objects, PDOs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final, NamedTuple

from tickrig.host.canopen.data_sheet.document import Document
from tickrig.host.canopen.data_sheet.rules.head_rules import number
from tickrig.host.canopen.data_sheet.rules.known_keys import FLAGS, NUMBERS
from tickrig.host.text.values import aligned
from tickrig.wire.canopen.eds.eds_value import format_value, parse_number, plain_numbers
from tickrig.wire.canopen.eds.eds_writer import access_type
from tickrig.wire.canopen.eds.object_table import Access, DeviceInfo, EntryDescription
from tickrig.wire.canopen.pdo import fields

# Display of the values of an EDS.


def _access_text(row: EntryDescription) -> str:
    """Return the access of an entry, and the PDOs that may carry the entry.

    >>> from tickrig.wire.canopen.eds.object_table import ROT, RW, DataType
    >>> [_access_text(EntryDescription(1, 0, "", DataType.UNSIGNED8, each)) for each in (ROT, RW)]
    ['ro T', 'rw']
    """
    try:
        word = access_type(row)
    except ValueError:
        word = "?"
    ways = ("T" * (Access.TPDO in row.access)) + ("R" * (Access.RPDO in row.access))
    return f"{word} {ways}".strip()


def _default_text(row: EntryDescription) -> str:
    """Return the default of an entry in EDS notation, empty without a default."""
    if not row.has_default:
        return ""
    text = format_value(row.data_type, row.default, relative=row.relative)
    return "".join(letter if letter.isprintable() else "?" for letter in text)


def _limit_text(limit: int | float | None) -> str:
    """Return a limit, empty without a limit."""
    return "" if limit is None else str(limit)


def _rates_text(info: DeviceInfo) -> str:
    """Return bit rates in kbit/s, the slowest first."""
    return " ".join(str(rate // 1_000) for rate in sorted(info.bit_rates))


_IDENTITY: Final = (
    *(("vendor-ID", 1, "VendorNumber"), ("product code", 2, "ProductNumber")),
    *(("revision", 3, "RevisionNumber"), ("serial number", 4, "")),
)
_PDO_KINDS: Final = (("RPDO", 0x1400), ("TPDO", 0x1800))
_MOST_PDOS: Final = 0x200
_MAPPING: Final = 0x200
_INVALID: Final = 1 << 31
_CAN_ID: Final = 0x1FFF_FFFF


def head(document: Document) -> dict[str, Any]:
    """Return names, identity, capabilities and object counts of a device, each by its label."""
    info = document.device.info
    return {
        "vendor": info.vendor_name,
        "product": info.product_name,
        "order code": info.order_code,
        **{what: _identity(document, sub, key) for what, sub, key in _IDENTITY},
        "device type": _hex(document, 0x1000, 0),
        "bit rates": _rates_text(info),
        "node-ID": document.device.node_id or "",
        "LSS": "yes" if number(document, "DeviceInfo", "LSS_Supported") else "no",
        "objects": len(document.device.objects),
        "entries": len(document.rows),
    }


def _identity(document: Document, sub: int, key: str) -> str:
    """Return a number of the identity object, or of DeviceInfo if the object lacks it."""
    text = _hex(document, 0x1018, sub)
    if text or not key:
        return text
    said = number(document, "DeviceInfo", key)
    return "" if said is None else f"0x{said:08X}"


def _hex(document: Document, index: int, sub: int) -> str:
    row = document.rows.get((index, sub))
    if row is None or not row.has_default or not row.data_type.is_integer:
        return ""
    return f"0x{int.from_bytes(row.default, 'little'):0{2 * row.size}X}"


def entries(document: Document, index: int | None, sub: int | None) -> list[dict[str, Any]]:
    """Return the rows of the object table, optionally only for one object or entry."""
    return [
        _entry(document, row)
        for key, row in sorted(document.rows.items())
        if index in (None, key[0]) and sub in (None, key[1])
    ]


def _entry(document: Document, row: EntryDescription) -> dict[str, Any]:
    described = document.device.objects[row.index]
    return {
        "index": f"{row.index:04X}h",
        "sub": f"{row.sub:02X}",
        "name": row.name or described.name,
        "object": described.name,
        "kind": described.code.name,
        "type": row.data_type.name,
        "access": _access_text(row),
        "default": _default_text(row),
        "low": _limit_text(row.low),
        "high": _limit_text(row.high),
        "unit": row.unit,
    }


def pdos(document: Document, node_id: int) -> list[dict[str, Any]]:
    """Return the PDOs that an EDS describes, with their power-on values, for display.

    Args:
        document: EDS to display.
        node_id: node-ID of the node, 1 to 127.
    """
    return [
        _pdo(document, f"{kind}{at + 1}", first + at, node_id)
        for kind, first in _PDO_KINDS
        for at in range(_MOST_PDOS)
        if (first + at, 1) in document.rows
    ]


def _pdo(document: Document, name: str, index: int, node_id: int) -> dict[str, Any]:
    cob_id = int.from_bytes(document.rows[index, 1].power_on_data(node_id), "little")
    transmission = document.rows.get((index, 2))
    return {
        "pdo": name,
        "index": f"{index:04X}h",
        "can_id": f"{cob_id & _CAN_ID:03X}",
        "valid": not cob_id & _INVALID,
        "transmission": int.from_bytes(transmission.default, "little") if transmission else "",
        "mapping": list(_mapped(document, index + _MAPPING)),
    }


def _mapped(document: Document, index: int) -> Iterator[dict[str, Any]]:
    """Yield the objects that a PDO carries, in bit order."""
    count = document.rows.get((index, 0))
    rows = [row for row in document.entries(index) if row.sub]
    used = int.from_bytes(count.default, "little") if count and count.has_default else len(rows)
    values = (int.from_bytes(row.default, "little") for row in rows[:used])
    for mapped, bit in fields(filter(None, values)):
        target = document.rows.get((mapped.index, mapped.sub))
        yield {
            "object": f"{mapped.index:04X}h:{mapped.sub:02X}",
            "name": target.name if target else "",
            "bit": bit,
            "bits": mapped.bits,
        }


def table(rows: list[dict[str, Any]], columns: tuple[str, ...]) -> list[str]:
    """Format rows as a table with aligned columns. The first line is the header."""
    return aligned([columns, *([str(row[column]) for column in columns] for row in rows)])


# Differences between the devices of two files.


class _Change(NamedTuple):
    """One difference between two files.

    Attributes:
        place: place of the difference, such as `DeviceInfo`, `2000h` or `2000h:01`.
        what: name of the field, or `object` or `entry` if it exists in one file only.
        old: value in the first file, empty if there is none.
        new: value in the second file, empty if there is none.
    """

    place: str
    what: str
    old: str
    new: str

    def __str__(self) -> str:
        """Return the difference in one line."""
        if self.what in _WHOLE:
            sign, name = ("-", self.old) if self.old else ("+", self.new)
            return f"{sign} {self.place} {name}"
        return f"~ {self.place} {self.what}: {self.old or '-'} -> {self.new or '-'}"


_WHOLE: Final = ("object", "entry")


def diff(one: Document, other: Document) -> list[_Change]:
    """Return the differences between the devices that two EDS files describe.

    Differences in the device, its identity and its bit rates come first. Differences in objects
    follow in the order of the index. The files may also differ in dates, file names, comments, the
    order of sections and the notation of numbers. These differences are ignored, because they do
    not concern the device.
    """
    return [*_device(one, other), *_objects(one, other)]


def _device(one: Document, other: Document) -> Iterator[_Change]:
    pairs = [
        ("vendor", one.device.info.vendor_name, other.device.info.vendor_name),
        ("product", one.device.info.product_name, other.device.info.product_name),
        ("order code", one.device.info.order_code, other.device.info.order_code),
        ("bit rates", _rates_text(one.device.info), _rates_text(other.device.info)),
        ("node-ID", str(one.device.node_id or ""), str(other.device.node_id or "")),
    ]
    for key in (*NUMBERS, *FLAGS):
        if not key.startswith("BaudRate"):
            pairs.append((key, _number(one, key), _number(other, key)))
    for what, old, new in pairs:
        if old != new:
            yield _Change("DeviceInfo", what, old, new)


def _number(document: Document, key: str) -> str:
    """Return a number of [DeviceInfo] in one notation. 0 counts as missing."""
    text = plain_numbers(document.file.value("DeviceInfo", key))
    try:
        number = parse_number(text or "0")
    except ValueError:
        return text
    return f"0x{number:X}"


def _objects(one: Document, other: Document) -> Iterator[_Change]:
    old, new = one.device.objects, other.device.objects
    all_subs: dict[int, set[int]] = {}
    for at, sub in (*one.rows, *other.rows):
        all_subs.setdefault(at, set()).add(sub)
    for index in sorted({*old, *new}):
        place = f"{index:04X}h"
        before, after = old.get(index), new.get(index)
        if before is None or after is None:
            name = "" if before is None else before.name or "-"
            yield _Change(place, "object", name, "" if after is None else after.name or "-")
            continue
        if before.name != after.name:
            yield _Change(place, "name", before.name, after.name)
        if before.code is not after.code:
            yield _Change(place, "kind", before.code.name, after.code.name)
        yield from _entries(one, other, index, all_subs.get(index, set()))


def _entries(one: Document, other: Document, index: int, subs: set[int]) -> Iterator[_Change]:
    for sub in sorted(subs):
        before, after = one.rows.get((index, sub)), other.rows.get((index, sub))
        place = f"{index:04X}h:{sub:02X}"
        if before is None or after is None:
            old, new = (row.name or "-" if row else "" for row in (before, after))
            yield _Change(place, "entry", old, new)
            continue
        fields = zip(_fields(before), _fields(after), strict=True)
        for (what, old), (_, new) in fields:
            named = what == "name" and len(subs) == 1
            if old != new and not named:
                yield _Change(place, what, old, new)


def _fields(row: EntryDescription) -> list[tuple[str, str]]:
    return [
        ("name", row.name),
        ("type", row.data_type.name),
        ("access", _access_text(row)),
        ("default", _default_text(row)),
        ("low limit", _limit_text(row.low)),
        ("high limit", _limit_text(row.high)),
        ("unit", row.unit),
        ("factor", f"{row.factor:g}"),
    ]
