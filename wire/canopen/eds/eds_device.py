"""The device that an EDS or DCF describes (CiA 306)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from operator import attrgetter
from typing import Final

from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.compact_pdo import implied_pdos
from tickrig.wire.canopen.eds.eds_entry import KIND_WORDS, read_entry, required
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
NO_DATA: Final = (0, ObjectCode.DEFTYPE, ObjectCode.DEFSTRUCT)
"""Kinds of objects that hold nothing: NULL, and definitions of data types."""
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
    warning that says what is taken: C suffixes, empty and missing keywords,
    CompactSubObj in a RECORD, texts beyond ASCII. A ParameterValue (DCF) counts
    as power-on value. ObjFlags concern configuration tools, not the device, and
    are not kept. What CompactPDO implies is there as if it were described.
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
    return EdsDevice(
        _device_info(file),
        tuple(entries),
        objects,
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
        reason = f"NodeID={node_id} is not in 1..127: none is taken"
        file.warn(COMMISSIONING, reason, "node-id", "NodeID")
        return None
    return node_id


def _kinds(file: EdsFile) -> Kinds:
    """Return the kind of each object; those that only define a data type are left out."""
    kinds = {}
    with_subs = {index for _, index, sub in file.objects() if sub is not None}
    for section, index, sub in file.objects():
        if sub is None and (kind := _kind(file, section, index in with_subs)):
            kinds[index] = kind
    return kinds


def _kind(file: EdsFile, section: str, with_subs: bool) -> ObjectCode | None:
    """Return the kind of an object; what has sub-indices is no variable, whatever the file says."""
    usual = ObjectCode.RECORD if with_subs else ObjectCode.VAR
    number = file.number(section, "ObjectType", usual, words=KIND_WORDS)
    if number in NO_DATA:
        return None
    if number not in DESCRIBED:
        reason = f"ObjectType={number} is no kind of object: {usual.name} is taken"
    elif with_subs and number in VARIABLES:
        reason = f"ObjectType={number} has no sub-indices, and there are: RECORD is taken"
    else:
        return ObjectCode(number)
    file.warn(section, reason, "object-type", "ObjectType")
    return usual


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
        yield from _object(file, index, kind, subs.get(index, []))


def _object(
    file: EdsFile, index: int, kind: ObjectCode, subs: list[tuple[str, int]]
) -> Iterator[EntryDescription]:
    """Read the entries of one object; those that are described beside a compact one replace its."""
    head = f"{index:04X}"
    if kind in VARIABLES:
        yield read_entry(file, head, index, 0)
        return
    if head in file.sections:
        required(file, head, "ParameterName", "")
    described = [read_entry(file, section, index, sub) for section, sub in subs]
    count = min(file.number(head, "CompactSubObj"), HIGHEST_SUB)
    if count:
        if kind is ObjectCode.RECORD:
            reason = "CompactSubObj in a RECORD: its entries are taken to be alike"
            file.warn(head, reason, "compact-record", "CompactSubObj")
        known = {row.sub for row in described}
        described += [row for row in _compact(file, index, count) if row.sub not in known]
    yield from sorted(described, key=attrgetter("sub"))


def _compact(file: EdsFile, index: int, count: int) -> Iterator[EntryDescription]:
    """Read an object that is described by one of its elements."""
    head = f"{index:04X}"
    title = file.value(head, "ParameterName")
    elements = []
    for sub in range(1, count + 1):
        name = file.value(f"{head}Name", str(sub)) or f"{title}{sub}"
        elements.append(read_entry(file, head, index, sub, name))
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
