"""The device that an EDS or DCF describes (CiA 306)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_entry import read_entry, required
from tickrig.wire.canopen.eds.eds_file import EdsFile
from tickrig.wire.canopen.eds.eds_writer import VARIABLES
from tickrig.wire.canopen.eds.object_table import (
    BIT_RATES_KBIT,
    RO,
    RW,
    Access,
    DeviceInfo,
    EntryDescription,
    ObjectCode,
    ObjectDescription,
)

COMMISSIONING: Final = "DeviceComissioning"
UNSET_NODE_IDS: Final = (0, 0xFF)
HIGHEST_NODE_ID: Final = 127
HIGHEST_SUB: Final = 254
NULL_OBJECT: Final = 0
DESCRIBED: Final = (*VARIABLES, ObjectCode.ARRAY, ObjectCode.RECORD)
ERROR_FIELD: Final = 0x1003
COUNTS: Final = (ERROR_FIELD, *range(0x1600, 0x1800), *range(0x1A00, 0x1C00))
"""Objects whose sub-index 0 counts what is in use, not what is there."""

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
    warning: C suffixes, empty keywords, CompactSubObj in a RECORD, texts beyond
    ASCII. A ParameterValue (DCF) counts as power-on value. ObjFlags concern
    configuration tools, not the device, and are not kept.
    """
    kinds = _kinds(file)
    entries = tuple(_entries(file, kinds))
    if not (entries or file.errors):
        file.refuse("", "has no objects")
    return EdsDevice(
        _device_info(file),
        entries,
        {
            index: ObjectDescription(file.value(f"{index:04X}", "ParameterName"), kind)
            for index, kind in kinds.items()
        },
        _node_id(file),
        1_000 * file.number(COMMISSIONING, "Baudrate") or None,
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
        file.refuse(COMMISSIONING, f"NodeID={node_id} is not in 1..127")
        return None
    return node_id


def _kinds(file: EdsFile) -> Kinds:
    """Return the kind of each object; those that only define a data type are left out."""
    kinds = {}
    with_subs = {index for _, index, sub in file.objects() if sub is not None}
    for section, index, sub in file.objects():
        if sub is None:
            default = ObjectCode.RECORD if index in with_subs else ObjectCode.VAR
            number = file.number(section, "ObjectType", default)
            if number in DESCRIBED:
                kinds[index] = ObjectCode(number)
            elif number not in (NULL_OBJECT, ObjectCode.DEFTYPE, ObjectCode.DEFSTRUCT):
                file.refuse(section, f"ObjectType={number} is no kind of object")
    return kinds


def _entries(file: EdsFile, kinds: Kinds) -> Iterator[EntryDescription]:
    subs: dict[int, list[tuple[str, int]]] = {}
    for section, index, sub in file.objects():
        if sub is not None:
            subs.setdefault(index, []).append((section, sub))
    for index, kind in kinds.items():
        yield from filter(None, _object(file, index, kind, subs.pop(index, [])))
    for index, orphans in subs.items():
        if f"{index:04X}" not in file.sections:
            for section, _ in orphans:
                file.refuse(section, f"has no object [{index:04X}]")


def _object(
    file: EdsFile, index: int, kind: ObjectCode, subs: list[tuple[str, int]]
) -> Iterator[EntryDescription | None]:
    """Read the entries of one object; None for one that cannot be made."""
    head = f"{index:04X}"
    if kind in VARIABLES:
        for section, _ in subs:
            file.refuse(section, f"is part of a {kind.name}, which has none")
        yield read_entry(file, head, index, 0)
        return
    required(file, head, "ParameterName")
    count = min(file.number(head, "CompactSubObj"), HIGHEST_SUB)
    if not count:
        yield from (read_entry(file, section, index, sub) for section, sub in subs)
        return
    if kind is ObjectCode.RECORD:
        file.warn(head, "CompactSubObj in a RECORD: its entries are taken to be alike")
    yield from _compact(file, index, count)


def _compact(file: EdsFile, index: int, count: int) -> Iterator[EntryDescription]:
    """Read an object that is described by one of its elements."""
    head = f"{index:04X}"
    title = file.value(head, "ParameterName")
    elements = []
    for sub in range(1, count + 1):
        name = file.value(f"{head}Name", str(sub)) or f"{title}{sub}"
        if element := read_entry(file, head, index, sub, name):
            elements.append(element)
    yield _count(index, elements)
    yield from elements


def _count(index: int, elements: list[EntryDescription]) -> EntryDescription:
    """Make the sub-index 0 of a compact object."""
    u8 = DataType.UNSIGNED8
    if index == ERROR_FIELD:
        return EntryDescription(index, 0, "Number of errors", u8, RW, default=0)
    used, access = len(elements), RO
    if index in COUNTS:
        used = sum(any(element.default) for element in elements)
        access = RW if any(Access.WRITE in element.access for element in elements) else RO
    return EntryDescription(index, 0, "Number of entries", u8, access, default=used)
