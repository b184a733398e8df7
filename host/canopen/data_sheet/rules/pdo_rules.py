"""Rules for PDOs and COB-IDs, applied to the defaults of the file."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from tickrig.host.canopen.data_sheet.document import Document
from tickrig.host.canopen.data_sheet.rule import RuleFinding
from tickrig.host.canopen.data_sheet.rules.head_rules import number
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_device import ELEMENTS, WAYS
from tickrig.wire.canopen.eds.eds_file import shorten
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription
from tickrig.wire.canopen.nmt import EXTENDED, INVALID, is_restricted

_RPDO: Final = range(0x1400, 0x1600)
_TPDO: Final = range(0x1800, 0x1A00)
_MAPPING: Final = 0x200
_IDS: Final = 0x7FF
_UPPER_BITS: Final = 0x1FFF_F800
_MOST_BITS: Final = 64
_MOST_MAPPED: Final = 64
_LOWEST_NODE: Final = 1
_HIGHEST_NODE: Final = 127
_SYNC: Final = 0x1005
_EMCY: Final = 0x1014
_SDO: Final = range(0x1200, 0x1300)
"""Indices of SDO servers, and of clients from 1280h on. Sub-indices 1 and 2 are COB-IDs."""
_DEFAULT_SERVER: Final = {(0x1200, 1): 0x600, (0x1200, 2): 0x580}
"""The lowest CAN-ID of each type of COB-ID. The node-ID is added to this number."""
_ALL_SUBS: Final = (1 << len(ELEMENTS)) - 1
_NEEDED_SUBS: Final = 0b11
"""Bits of the required sub-indices, which are COB-ID and transmission type."""
_RESERVED: Final = 4
_NODE: Final = 5
"""The node-ID for which CAN-IDs are compared."""


def cob_ids(document: Document) -> Iterator[RuleFinding]:
    """Check the COB-IDs of PDOs, SDO servers and clients, SYNC and EMCY."""
    taken: dict[int, str] = {}
    for row in document.rows.values():
        if _is_cob_id(row) and row.data_type is DataType.UNSIGNED32 and row.has_default:
            yield from _cob_id(document, row, taken)


def _is_cob_id(row: EntryDescription) -> bool:
    match row.sub:
        case 0:
            return row.index in (_SYNC, _EMCY)
        case 1:
            return any(row.index in area for area in (_RPDO, _TPDO, _SDO))
        case 2:
            return row.index in _SDO
    return False


def _cob_id(
    document: Document, row: EntryDescription, taken: dict[int, str]
) -> Iterator[RuleFinding]:
    place = document.section_of(row)
    values = [
        int.from_bytes(row.power_on_data(node), "little") for node in (_LOWEST_NODE, _HIGHEST_NODE)
    ]
    if values[0] & (EXTENDED | (0 if row.index == _SYNC else INVALID)):
        return
    if values[1] & _UPPER_BITS:
        what = f"0x{values[1]:08X} of node {_HIGHEST_NODE} has no CAN-ID of 11 bits"
        yield document.found("cob-id-range", what, place, "DefaultValue")
        return
    ids = [value & _IDS for value in values]
    base = _DEFAULT_SERVER.get((row.index, row.sub))
    if base is not None and not _is_of_server(document, row, base):
        said = shorten(document.file.value(place, "DefaultValue"))
        what = f"DefaultValue={said} is not $NODEID+0x{base:X}"
        yield document.found("sdo-server", what, place, "DefaultValue")
    elif base is None and any(map(is_restricted, ids)):
        what = f"CAN-ID 0x{ids[0]:03X} to 0x{ids[1]:03X} of nodes 1 to 127 is restricted"
        yield document.found("cob-id-restricted", what, place, "DefaultValue")
        return
    own = int.from_bytes(row.power_on_data(_NODE), "little") & _IDS
    who = f"{row.index:04X}h:{row.sub:02X}"
    if own in taken:
        what = f"CAN-ID 0x{own:03X} of node {_NODE} is also that of {taken[own]}"
        yield document.found("cob-id-unique", what, place, "DefaultValue")
    taken.setdefault(own, who)


def _is_of_server(document: Document, row: EntryDescription, base: int) -> bool:
    """Return whether a default is that of the first server.

    In a DCF it is the one of a single node.
    """
    default = int.from_bytes(row.default, "little")
    if document.file.is_dcf and not row.relative:
        return default in range(base + _LOWEST_NODE, base + _HIGHEST_NODE + 1)
    return row.relative and default == base


def compact(document: Document) -> Iterator[RuleFinding]:
    """Check the objects that CompactPDO implies."""
    title, key = "DeviceInfo", "CompactPDO"
    mask = number(document, title, key)
    if not mask:
        return
    if mask & ~_ALL_SUBS:
        what = f"CompactPDO=0x{mask:X} has bits beyond 0x{_ALL_SUBS:X}"
        yield document.found("compact-pdo", what, title, key)
    if ~mask & _NEEDED_SUBS:
        what = f"CompactPDO=0x{mask:X} leaves out sub-index 1 or 2, which each PDO has"
        yield document.found("compact-pdo", what, title, key)
    if not any(number(document, title, way.key) for way in WAYS):
        what = f"CompactPDO=0x{mask:X}, but NrOfRXPDO and NrOfTXPDO say that there are no PDOs"
        yield document.found("compact-pdo", what, title, key)


def halves(document: Document) -> Iterator[RuleFinding]:
    """Find PDOs that lack their communication parameter or their mapping."""
    objects = document.device.objects
    for index in objects:
        if (index in _RPDO or index in _TPDO) and index + _MAPPING not in objects:
            what = f"there is no mapping {index + _MAPPING:04X}h"
            yield document.found("pdo-half", what, f"{index:04X}")
        parameter = index - _MAPPING
        if (parameter in _RPDO or parameter in _TPDO) and parameter not in objects:
            what = f"there is no communication parameter {parameter:04X}h"
            yield document.found("pdo-half", what, f"{index:04X}")


def reserved(document: Document) -> Iterator[RuleFinding]:
    """Find sub-index 4 of communication parameters, which a device must refuse."""
    described = set[int]()
    for section, index, sub in document.file.objects():
        described.add(index)
        if sub == _RESERVED and (index in _RPDO or index in _TPDO):
            yield document.found("pdo-reserved", "sub-index 4 is reserved", section)
    implied = {*_RPDO, *_TPDO} & document.device.objects.keys() - described
    if any(row.sub == _RESERVED for index in implied for row in document.entries(index)):
        title, key = "DeviceInfo", "CompactPDO"
        what = f"CompactPDO=0x{number(document, title, key):X} implies the reserved sub-index 4"
        yield document.found("pdo-reserved", what, title, key)


def mappings(document: Document) -> Iterator[RuleFinding]:
    """Check the default mapping."""
    for index in document.device.objects:
        if index - _MAPPING in _RPDO:
            yield from _mapping(document, index, Access.RPDO)
        elif index - _MAPPING in _TPDO:
            yield from _mapping(document, index, Access.TPDO)


def _mapping(document: Document, index: int, way: Access) -> Iterator[RuleFinding]:
    rows = [row for row in document.entries(index) if row.sub]
    head = document.rows.get((index, 0))
    in_use = [row for row in rows if any(row.default)]
    count = len(in_use)
    if head is not None and head.has_default and head.data_type.is_integer:
        count = int.from_bytes(head.default, "little")
    if count > _MOST_MAPPED:  # an MPDO, or not a number of objects
        if count not in (254, 255):
            what = f"{count} objects are mapped, {_MOST_MAPPED} were allowed"
            yield document.found("mapping-count", what, f"{index:04X}sub0", "DefaultValue")
        return
    if head is not None and count > len(rows):
        what = f"{count} objects are mapped, but there are {len(rows)} sub-indices"
        yield document.found("mapping-count", what, f"{index:04X}sub0", "DefaultValue")
    bits = 0
    for row in rows[:count]:
        value = int.from_bytes(row.default, "little")
        bits += value & 0xFF
        if row.has_default:
            yield from _mapped(document, row, value, way)
    if bits > _MOST_BITS:
        what = f"{bits} bits are mapped, {_MOST_BITS} were allowed"
        yield document.found("pdo-length", what, f"{index:04X}")


def _mapped(
    document: Document, row: EntryDescription, value: int, way: Access
) -> Iterator[RuleFinding]:
    """Check one mapped object."""
    index, sub, bits = value >> 16, value >> 8 & 0xFF, value & 0xFF
    place, what = document.section_of(row), f"{index:04X}h:{sub:02X}"
    if index < 0x20:  # a dummy
        return
    target = document.rows.get((index, sub))
    if target is None:
        yield document.found("mapped-missing", f"{what} is not there", place, "DefaultValue")
        return
    if target.data_type.bits not in (0, bits):
        text = f"{what} is mapped with {bits} bits, it has {target.data_type.bits}"
        yield document.found("mapped-length", text, place, "DefaultValue")
    if not target.access & (Access.TPDO | Access.RPDO):
        text = f"{what} is mapped, its PDOMapping is 0"
        yield document.found("mapped-mappable", text, place, "DefaultValue")
    elif way not in target.access:
        name = "an RPDO" if way is Access.RPDO else "a TPDO"
        text = f"{what} is mapped into {name}, which its AccessType does not allow"
        yield document.found("mapped-direction", text, place, "DefaultValue")
