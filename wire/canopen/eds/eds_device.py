"""The device that an EDS or DCF describes (CiA 306)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from tickrig.wire.canopen.eds.compact_pdo import implied_pdos
from tickrig.wire.canopen.eds.eds_entry import object_kind, read_object
from tickrig.wire.canopen.eds.eds_file import EdsFile
from tickrig.wire.canopen.eds.modules import module_objects
from tickrig.wire.canopen.eds.object_table import (
    BIT_RATES,
    BIT_RATES_KBIT,
    DeviceInfo,
    EntryDescription,
    ObjectCode,
    ObjectDescription,
)

COMMISSIONING: Final = "DeviceComissioning"
UNSET_NODE_IDS: Final = (0, 0xFF)
HIGHEST_NODE_ID: Final = 127

Kinds = dict[int, ObjectCode]


@dataclass(frozen=True, slots=True)
class EdsDevice:
    """What a file says of a device.

    Attributes:
        info: vendor, product, bit rates.
        entries: of all objects.
        objects: names and kinds by index.
        node_id: of a DCF, None if it gives none.
        bit_rate: of a DCF in bit/s, None if it gives none.
    """

    info: DeviceInfo
    entries: tuple[EntryDescription, ...]
    objects: Mapping[int, ObjectDescription]
    node_id: int | None = None
    bit_rate: int | None = None


def read_device(file: EdsFile) -> EdsDevice:
    """Read what is sound in a file; the rest becomes its errors.

    What is not by the standard and has one meaning all the same becomes a
    warning that says what is taken: C suffixes, empty and missing keywords,
    CompactSubObj in a RECORD, texts beyond ASCII. A ParameterValue (DCF) counts
    as power-on value. ObjFlags concern configuration tools, not the device, and
    are not kept. What CompactPDO implies is there as if it were described, and so are the
    objects of connected modules.
    """
    kinds = _kinds(file)
    entries = list(_entries(file, kinds))
    objects = {
        index: ObjectDescription(file.value(f"{index:04X}", "ParameterName"), kind)
        for index, kind in kinds.items()
    }
    if not (entries or file.errors):
        file.refuse("", "has no objects", "no-objects")
    for described, rows in implied_pdos(file) if entries else ():
        objects[rows[0].index] = described
        entries += rows
    for described, rows in module_objects(file, entries, objects):
        objects[rows[0].index] = described
        added = {row.key for row in rows}
        entries = [row for row in entries if row.key not in added] + rows
    read = {row.index for row in entries}
    for index in sorted(objects.keys() - read) if read else ():
        reason = "there is no sub-index: the object is left out"
        file.warn(f"{index:04X}", reason, "sub0-missing")
    return EdsDevice(
        _device_info(file),
        tuple(entries),
        objects,
        _node_id(file),
        _bit_rate(file),
    )


def _device_info(file: EdsFile) -> DeviceInfo:
    rates = {
        1_000 * kbit for kbit in BIT_RATES_KBIT if file.number("DeviceInfo", f"BaudRate_{kbit}")
    }
    return DeviceInfo(
        vendor_name=file.value("DeviceInfo", "VendorName"),
        product_name=file.value("DeviceInfo", "ProductName"),
        order_code=file.value("DeviceInfo", "OrderCode"),
        bit_rates=frozenset(rates),
    )


def _node_id(file: EdsFile) -> int | None:
    node_id = file.number(COMMISSIONING, "NodeID")
    if node_id in UNSET_NODE_IDS:
        return None
    if node_id > HIGHEST_NODE_ID:
        reason = f"NodeID={node_id} is not in 1..127: none is taken"
        file.warn(COMMISSIONING, reason, "node-id", "NodeID")
        return None
    return node_id


def _bit_rate(file: EdsFile) -> int | None:
    """Return the bit rate of a DCF in bit/s, which CiA 306 gives in kbit/s; None if it is none."""
    said = file.number(COMMISSIONING, "Baudrate")
    if said <= max(BIT_RATES_KBIT):
        return 1_000 * said or None
    known = said if said in BIT_RATES else None
    taken = f"{said // 1_000} kbit/s is" if known else "none is"
    reason = f"Baudrate={said} is more than {max(BIT_RATES_KBIT)} kbit/s: {taken} taken"
    file.warn(COMMISSIONING, reason, "bit-rate-unit", "Baudrate")
    return known


def _kinds(file: EdsFile) -> Kinds:
    """Return the kind of each object; those that only define a data type are left out."""
    kinds = {}
    with_subs = {index for _, index, sub in file.objects() if sub is not None}
    for section, index, sub in file.objects():
        if sub is None and (kind := object_kind(file, section, index in with_subs)):
            kinds[index] = kind
    return kinds


def _entries(file: EdsFile, kinds: Kinds) -> Iterator[EntryDescription]:
    subs: dict[int, list[tuple[str, int]]] = {}
    for section, index, sub in file.objects():
        if sub is not None:
            subs.setdefault(index, []).append((section, sub))
    for index in subs:
        if f"{index:04X}" not in file.sections:
            reason = f"has no object [{index:04X}]: a RECORD is taken"
            file.warn(subs[index][0][0], reason, "sub-orphan")
            kinds[index] = ObjectCode.RECORD
    for index, kind in kinds.items():
        yield from read_object(file, f"{index:04X}", index, kind, subs.get(index, []))
