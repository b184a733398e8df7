"""Device descriptions from EDS and DCF files (CiA 306)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Final, NamedTuple

from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds import eds_entry
from tickrig.wire.canopen.eds.eds_file import EdsFile, shorten
from tickrig.wire.canopen.eds.eds_value import parse_number, plain_numbers
from tickrig.wire.canopen.eds.eds_writer import VARIABLES
from tickrig.wire.canopen.eds.object_table import (
    BIT_RATES,
    BIT_RATES_KBIT,
    CONST,
    RW,
    Access,
    DeviceInfo,
    EntryDescription,
    ObjectCode,
    ObjectDescription,
)

# The PDOs that an EDS implies by CompactPDO, and does not describe (CiA 306-1, [DeviceInfo]).

_MOST_PDOS: Final = 0x200
"""Largest number of PDOs in each direction."""
_MAPPING: Final = 0x200
_MOST_MAPPED: Final = 0x40
_PREDEFINED: Final = 4
"""Number of PDOs in each direction with a CAN-ID of the predefined connection set (CiA 301)."""
_OFF: Final = 0x8000_0000

_U8: Final = DataType.UNSIGNED8
_U16: Final = DataType.UNSIGNED16
_U32: Final = DataType.UNSIGNED32
ELEMENTS: Final = (
    *(("COB-ID", _U32), ("Transmission type", _U8), ("Inhibit time", _U16)),
    *(("Compatibility entry", _U8), ("Event timer", _U16), ("SYNC start value", _U8)),
)
"""Sub-indices 1 to 6 of a communication parameter; bits 0 to 5 of CompactPDO enable them."""

_Implied = tuple[ObjectDescription, list[EntryDescription]]


class _Way(NamedTuple):
    """Differences between RPDOs and TPDOs.

    Attributes:
        name: name of the direction: RPDO or TPDO.
        key: keyword of the number of PDOs in [DeviceInfo].
        first: index of the first communication parameter.
        can_id: CAN-ID of the first PDO, without the node-ID.
    """

    name: str
    key: str
    first: int
    can_id: int


WAYS: Final = (
    _Way("RPDO", "NrOfRXPDO", 0x1400, 0x200),
    _Way("TPDO", "NrOfTXPDO", 0x1800, 0x180),
)


def _implied_pdos(file: EdsFile) -> Iterator[_Implied]:
    """Yield the communication and mapping parameters implied by CompactPDO.

    NrOfRXPDO and NrOfTXPDO count all PDOs: the described PDOs, and the implied PDOs on the lowest
    free numbers. Described objects are unchanged, and only a missing half is implied. A mapping
    parameter has 64 entries, as in Lely's reader. The file has no defaults for implied objects, so
    the COB-IDs are those of CiA 301: the first four PDOs have COB-IDs of the predefined connection
    set, and all other PDOs are off. A DCF may give values, as in [1600Value].
    """
    mask = file.number("DeviceInfo", "CompactPDO")
    subs = [sub for sub in range(1, len(ELEMENTS) + 1) if mask >> sub - 1 & 1]
    if not subs:
        return
    described = {index for _, index, _ in file.objects()}
    for way in WAYS:
        for number in _numbers(file, way, described):
            index = way.first + number
            if index not in described:
                yield _parameter(file, way, number, subs)
            if index + _MAPPING not in described:
                yield _mapping(file, way, number)


def _numbers(file: EdsFile, way: _Way, described: set[int]) -> list[int]:
    """Return the numbers of all PDOs, from 0 on."""
    begun, free = list[int](), list[int]()
    for number in range(_MOST_PDOS):
        parameter = way.first + number
        is_begun = parameter in described or parameter + _MAPPING in described
        (begun if is_begun else free).append(number)
    missing = max(file.number("DeviceInfo", way.key) - len(begun), 0)
    return sorted([*begun, *islice(free, missing)])


def _parameter(file: EdsFile, way: _Way, number: int, subs: list[int]) -> _Implied:
    index = way.first + number
    count = EntryDescription(index, 0, "Highest sub-index supported", _U8, CONST, default=subs[-1])
    rows = [_entry(file, index, sub, *ELEMENTS[sub - 1], RW) for sub in subs]
    if subs[0] == 1 and not rows[0].has_default:
        rows[0] = _cob_id(way, number)
    title = f"{way.name}{number + 1} communication parameter"
    return ObjectDescription(title, ObjectCode.RECORD), [count, *rows]


def _cob_id(way: _Way, number: int) -> EntryDescription:
    """Make the COB-ID of a PDO (CiA 301)."""
    index, (name, kind), on = way.first + number, ELEMENTS[0], number < _PREDEFINED
    cob_id = way.can_id + 0x100 * number if on else _OFF
    return EntryDescription(index, 1, name, kind, RW, default=cob_id, relative=on)


def _mapping(file: EdsFile, way: _Way, number: int) -> _Implied:
    index = way.first + _MAPPING + number
    rows = [_entry(file, index, 0, "Number of mapped objects", _U8, RW)]
    for sub in range(1, _MOST_MAPPED + 1):
        rows.append(_entry(file, index, sub, f"Mapped object {sub}", _U32, RW))
    title = f"{way.name}{number + 1} mapping parameter"
    return ObjectDescription(title, ObjectCode.RECORD), rows


def _entry(  # noqa: PLR0913, PLR0917 - a row of an object table
    file: EdsFile, index: int, sub: int, name: str, kind: DataType, access: Access
) -> EntryDescription:
    default, relative = eds_entry.read_value_beside(file, index, sub, kind)
    return EntryDescription(index, sub, name, kind, access, default=default, relative=relative)


# The objects that the connected modules of a modular device add (CiA 306-1, modular devices).

_SUPPORTED: Final = "SupportedModules"
_CONNECTED: Final = "ConnectedModules"
_MODULE_LIST: Final = 0x1027
_HIGHEST_INDEX: Final = 0xFFFF

_Added = tuple[ObjectDescription, list[EntryDescription]]
_Objects = Mapping[int, ObjectDescription]


def _module_objects(
    file: EdsFile, entries: Iterable[EntryDescription], objects: _Objects
) -> Iterator[_Added]:
    """Yield the objects of the modules that a DCF connects, and the module list (1027h).

    A fixed object exists once, however many modules have it. A sub-index extension adds sub-indices
    in the order of the modules, and continues in the next object after the sub-index in ObjExtend.
    Objects that the file describes itself, as a DCF may, are unchanged.

    Args:
        file: file that collects errors: modules that are not described, or no connected modules.
        entries: described entries.
        objects: names and kinds of the described objects.

    Returns:
        The name and kind of each object, and all entries of the object.
    """
    if _CONNECTED not in file.sections:
        if file.number(_SUPPORTED, "NrOfEntries"):
            reason = (
                "a modular device: the objects of its modules are left out, for"
                f" [{_CONNECTED}] of a DCF has to say which are there"
            )
            file.warn(_SUPPORTED, reason, "modules")
        return
    rows = list(entries)
    modules = _list_numbers(file, _CONNECTED)
    for module in dict.fromkeys(modules):
        kinds = ("ModuleInfo", "FixedObjects", "SubExtends")
        if not any(f"M{module}{kind}" in file.sections for kind in kinds):
            _missing(file, _CONNECTED, f"M{module}ModuleInfo")
    yield from _listed(modules, rows, objects)
    yield from _fixed(file, modules)
    whole = {row.index for row in rows if row.sub or objects[row.index].code in VARIABLES}
    for index, sections in _extensions(file, modules).items():
        if index not in whole:
            yield from _extended(file, index, sections, objects)


def _missing(file: EdsFile, section: str, wanted: str) -> None:
    reason = f"there is no [{wanted}]: what it would add is left out"
    file.warn(section, reason, "modules")


def _list_numbers(file: EdsFile, section: str) -> list[int]:
    """Return the numbers of a list, in its order, without zeros."""
    keys = (key for key in file.sections.get(section, {}) if key.isascii() and key.isdigit())
    found = (file.number(section, key) for key in sorted(keys, key=int))
    return [number for number in found if number]


def _listed(
    modules: list[int], rows: Iterable[EntryDescription], objects: _Objects
) -> Iterator[_Added]:
    """Yield 1027h with the numbers of the modules, if the file does not give them."""
    own = [row for row in rows if row.index == _MODULE_LIST]
    if own:
        count = min(len(modules), max(row.sub for row in own))
        values = dict(enumerate([count, *modules]))
        filled = (
            row if row.has_default or not row.data_type.is_integer else _filled(row, values)
            for row in own
        )
        yield objects[_MODULE_LIST], list(filled)


def _filled(row: EntryDescription, values: Mapping[int, int]) -> EntryDescription:
    value = values.get(row.sub, 0)
    low, high = row.data_type.limits
    return row.with_default(value) if low <= value <= high else row


def _fixed(file: EdsFile, modules: list[int]) -> Iterator[_Added]:
    """Yield the fixed objects of modules."""
    seen: set[int] = set()
    for module in dict.fromkeys(modules):
        listing = f"M{module}FixedObjects"
        for index in _list_numbers(file, listing):
            head = f"M{module}Fixed{index:04X}"
            if index in seen or f"{index:04X}" in file.sections or index > _HIGHEST_INDEX:
                continue
            if head not in file.sections:
                _missing(file, listing, head)
                continue
            seen.add(index)
            subs = [(f"{head}sub{sub:X}", sub) for sub in range(0x100)]
            subs = [each for each in subs if each[0] in file.sections]
            kind = eds_entry.object_kind(file, head, bool(subs))
            rows = (
                [] if kind is None else list(eds_entry.read_object(file, head, index, kind, subs))
            )
            if kind is not None and rows:
                yield ObjectDescription(file.value(head, "ParameterName"), kind), rows


def _extensions(file: EdsFile, modules: list[int]) -> dict[int, list[str]]:
    """Return the sections that extend objects, by index, once for each connected module."""
    found: dict[int, list[str]] = {}
    for module in modules:
        listing = f"M{module}SubExtends"
        for index in _list_numbers(file, listing):
            section = f"M{module}SubExt{index:04X}"
            if section in file.sections and index <= _HIGHEST_INDEX:
                found.setdefault(index, []).append(section)
            else:
                _missing(file, listing, section)
    return found


def _extended(
    file: EdsFile, index: int, sections: list[str], objects: _Objects
) -> Iterator[_Added]:
    """Yield an object with the sub-indices added by modules, and the objects that continue it."""
    rows: list[EntryDescription] = []
    free_bits = 0
    for section in sections:
        count, bits = _count(file, section)
        width = max(eds_entry.read_entry(file, section, index, 1, "").data_type.bits, 1)
        if bits:
            count = max(-((free_bits - bits) // width), 0)
            free_bits += count * width - bits
        last = min(file.number(section, "ObjExtend"), eds_entry.HIGHEST_SUB)
        for _ in range(count):
            if len(rows) >= (last or eds_entry.HIGHEST_SUB):
                if not last or index >= _HIGHEST_INDEX or index + 1 in objects:
                    reason = f"{index:04X}h has no sub-index free: what it adds is left out"
                    file.warn(section, reason, "modules")
                    break
                yield _object(file, index, rows, objects, section)
                index, rows = index + 1, []
            sub = len(rows) + 1
            name = f"{file.value(section, 'ParameterName')}{sub}"
            rows.append(eds_entry.read_entry(file, section, index, sub, name))
    yield _object(file, index, rows, objects, sections[0])


def _object(
    file: EdsFile, index: int, rows: list[EntryDescription], objects: _Objects, section: str
) -> _Added:
    usual = ObjectDescription(file.value(section, "ParameterName"), ObjectCode.ARRAY)
    return objects.get(index, usual), [eds_entry.count_of(index, rows), *rows]


def _count(file: EdsFile, section: str) -> tuple[int, int]:
    """Return the number of added sub-indices, or of bits of one sub-index (`0;2`)."""
    text = file.value(section, "Count")
    whole, _, bits = text.partition(";")
    try:
        count = parse_number(plain_numbers(whole.strip()))
        part = 0 if count else parse_number(plain_numbers(bits.strip()))
        if (
            0 <= count <= eds_entry.HIGHEST_SUB
            and 0 <= part <= eds_entry.HIGHEST_SUB
            and (count or part)
        ):
            return count, part
    except ValueError:
        pass
    reason = (
        f"Count={shorten(text)} is not N, or 0;BITS, of at most {eds_entry.HIGHEST_SUB}: 1 is taken"
    )
    file.warn(section, reason, "no-number", "Count")
    return 1, 0


COMMISSIONING: Final = "DeviceComissioning"
_UNSET_NODE_IDS: Final = (0, 0xFF)
HIGHEST_NODE_ID: Final = 127

_Kinds = dict[int, ObjectCode]


@dataclass(frozen=True, slots=True)
class EdsDevice:
    """The device that an EDS or DCF file describes.

    Attributes:
        info: vendor, product and bit rates.
        entries: descriptions of the entries of all objects.
        objects: names and object codes by index.
        node_id: node-ID of a DCF, or None if missing.
        bit_rate: bit rate of a DCF in bit/s, or None if missing.
    """

    info: DeviceInfo
    entries: tuple[EntryDescription, ...]
    objects: Mapping[int, ObjectDescription]
    node_id: int | None = None
    bit_rate: int | None = None


def read_device(file: EdsFile) -> EdsDevice:
    """Return the device that an EDS or DCF file describes.

    Invalid parts are skipped, and an error is added to the errors of the file. Some deviations from
    the standard have a clear meaning, for example a missing or empty keyword, a number with a
    suffix as in C (`10UL`), CompactSubObj in a RECORD, or a text with characters outside ASCII.
    Such a deviation becomes a warning with the value that is used.

    The ParameterValue of a DCF is used as the power-on value. ObjFlags are ignored, because they
    concern only configuration tools. The result includes the objects that CompactPDO describes, and
    the objects of connected modules.
    """
    kinds = _kinds(file)
    entries = list(_entries(file, kinds))
    objects = {
        index: ObjectDescription(file.value(f"{index:04X}", "ParameterName"), kind)
        for index, kind in kinds.items()
    }
    if not (entries or file.errors):
        file.refuse("", "has no objects", "no-objects")
    for described, rows in _implied_pdos(file) if entries else ():
        objects[rows[0].index] = described
        entries += rows
    for described, rows in _module_objects(file, entries, objects):
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
    if node_id in _UNSET_NODE_IDS:
        return None
    if node_id > HIGHEST_NODE_ID:
        reason = f"NodeID={node_id} is not in 1..127: none is taken"
        file.warn(COMMISSIONING, reason, "node-id", "NodeID")
        return None
    return node_id


def _bit_rate(file: EdsFile) -> int | None:
    """Return the bit rate of a DCF in bit/s (CiA 306 uses kbit/s), or None if invalid."""
    said = file.number(COMMISSIONING, "Baudrate")
    if said <= max(BIT_RATES_KBIT):
        return 1_000 * said or None
    known = said if said in BIT_RATES else None
    taken = f"{said // 1_000} kbit/s is" if known else "none is"
    reason = f"Baudrate={said} is more than {max(BIT_RATES_KBIT)} kbit/s: {taken} taken"
    file.warn(COMMISSIONING, reason, "bit-rate-unit", "Baudrate")
    return known


def _kinds(file: EdsFile) -> _Kinds:
    """Return the kind of each object, without objects that only define a data type."""
    kinds = {}
    with_subs = {index for _, index, sub in file.objects() if sub is not None}
    for section, index, sub in file.objects():
        if sub is None and (kind := eds_entry.object_kind(file, section, index in with_subs)):
            kinds[index] = kind
    return kinds


def _entries(file: EdsFile, kinds: _Kinds) -> Iterator[EntryDescription]:
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
        yield from eds_entry.read_object(file, f"{index:04X}", index, kind, subs.get(index, []))
