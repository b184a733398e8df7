"""What a file says of a device, for people and programs: head, objects, PDOs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

from tickrig.host.canopen.data_sheet.document import Document
from tickrig.host.canopen.data_sheet.notation import (
    access_text,
    default_text,
    limit_text,
    rates_text,
)
from tickrig.host.canopen.data_sheet.rules.head_rules import number
from tickrig.wire.canopen.eds.object_table import EntryDescription

IDENTITY: Final = (
    *(("vendor-ID", 1, "VendorNumber"), ("product code", 2, "ProductNumber")),
    *(("revision", 3, "RevisionNumber"), ("serial number", 4, "")),
)
PDO_KINDS: Final = (("RPDO", 0x1400), ("TPDO", 0x1800))
MOST_PDOS: Final = 0x200
MAPPING: Final = 0x200
INVALID: Final = 1 << 31
CAN_ID: Final = 0x1FFF_FFFF


def head(document: Document) -> dict[str, Any]:
    """Return device, identity and what it can do."""
    info = document.device.info
    return {
        "vendor": info.vendor_name,
        "product": info.product_name,
        "order code": info.order_code,
        **{what: _identity(document, sub, key) for what, sub, key in IDENTITY},
        "device type": _hex(document, 0x1000, 0),
        "bit rates": rates_text(info),
        "node-ID": document.device.node_id or "",
        "LSS": "yes" if number(document, "DeviceInfo", "LSS_Supported") else "no",
        "objects": len(document.device.objects),
        "entries": len(document.rows),
    }


def _identity(document: Document, sub: int, key: str) -> str:
    """Return a number of the identity object; that of the head where it has none."""
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
    """Return the rows of the object table; of one object, or one entry, if they are named."""
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
        "access": access_text(row),
        "default": default_text(row),
        "low": limit_text(row.low),
        "high": limit_text(row.high),
        "unit": row.unit,
    }


def pdos(document: Document, node_id: int) -> list[dict[str, Any]]:
    """Return the PDOs of a node as they are at power-on.

    Args:
        document: the file.
        node_id: 1 to 127.
    """
    return [
        _pdo(document, f"{kind}{at + 1}", first + at, node_id)
        for kind, first in PDO_KINDS
        for at in range(MOST_PDOS)
        if (first + at, 1) in document.rows
    ]


def _pdo(document: Document, name: str, index: int, node_id: int) -> dict[str, Any]:
    cob_id = int.from_bytes(document.rows[index, 1].power_on_data(node_id), "little")
    transmission = document.rows.get((index, 2))
    return {
        "pdo": name,
        "index": f"{index:04X}h",
        "can_id": f"{cob_id & CAN_ID:03X}",
        "valid": not cob_id & INVALID,
        "transmission": int.from_bytes(transmission.default, "little") if transmission else "",
        "mapping": list(_mapped(document, index + MAPPING)),
    }


def _mapped(document: Document, index: int) -> Iterator[dict[str, Any]]:
    """Give the objects that a PDO carries, from its first bit on."""
    count = document.rows.get((index, 0))
    rows = [row for row in document.entries(index) if row.sub]
    used = int.from_bytes(count.default, "little") if count and count.has_default else len(rows)
    bit = 0
    for row in rows[:used]:
        value = int.from_bytes(row.default, "little")
        if not value:
            continue
        target = document.rows.get((value >> 16, value >> 8 & 0xFF))
        yield {
            "object": f"{value >> 16:04X}h:{value >> 8 & 0xFF:02X}",
            "name": target.name if target else "",
            "bit": bit,
            "bits": value & 0xFF,
        }
        bit += value & 0xFF


def table(rows: list[dict[str, Any]], columns: tuple[str, ...]) -> list[str]:
    """Return rows as lines in columns, with a head; the last column is as long as it is."""
    lines = [[str(row[column]) for column in columns] for row in rows]
    all_lines = [list(columns), *lines]
    widths = [max(len(line[at]) for line in all_lines) for at in range(len(columns))]
    return [
        "  ".join(f"{text:<{width}}" for text, width in zip(line, widths, strict=True)).rstrip()
        for line in all_lines
    ]
