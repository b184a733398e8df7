"""The PDOs that an EDS implies by CompactPDO, and does not describe (CiA 306-1, [DeviceInfo])."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import Final, NamedTuple

from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_entry import read_value_beside
from tickrig.wire.canopen.eds.eds_file import EdsFile
from tickrig.wire.canopen.eds.object_table import (
    CONST,
    RW,
    Access,
    EntryDescription,
    ObjectCode,
    ObjectDescription,
)

MOST_PDOS: Final = 0x200
"""Each way."""
MAPPING: Final = 0x200
MOST_MAPPED: Final = 0x40
PREDEFINED: Final = 4
"""PDOs each way that have a CAN-ID by the predefined connection set (CiA 301)."""
OFF: Final = 0x8000_0000

U8: Final = DataType.UNSIGNED8
U16: Final = DataType.UNSIGNED16
U32: Final = DataType.UNSIGNED32
ELEMENTS: Final = (
    *(("COB-ID", U32), ("Transmission type", U8), ("Inhibit time", U16)),
    *(("Compatibility entry", U8), ("Event timer", U16), ("SYNC start value", U8)),
)
"""Sub-indices 1 to 6 of a communication parameter; bits 0 to 5 of CompactPDO say which it has."""

Implied = tuple[ObjectDescription, list[EntryDescription]]


class Way(NamedTuple):
    """What RPDOs and TPDOs differ in.

    Attributes:
        name: of one.
        key: of their number in [DeviceInfo].
        first: index of the first communication parameter.
        can_id: of the first, without the node-ID.
    """

    name: str
    key: str
    first: int
    can_id: int


WAYS: Final = (
    Way("RPDO", "NrOfRXPDO", 0x1400, 0x200),
    Way("TPDO", "NrOfTXPDO", 0x1800, 0x180),
)


def implied_pdos(file: EdsFile) -> Iterator[Implied]:
    """Give the communication and mapping parameters that CompactPDO stands for.

    NrOfRXPDO and NrOfTXPDO count all PDOs: those that are described, and behind them as many
    more as are missing, on the lowest numbers that are free. What is described stays as it is,
    and only its other half is implied. A mapping parameter has 64 entries, as Lely's reader has
    it. The file says no defaults, so the COB-IDs are those of CiA 301: the first four by the
    predefined connection set, the others off; a DCF may give values, as in [1600Value].
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
            if index + MAPPING not in described:
                yield _mapping(file, way, number)


def _numbers(file: EdsFile, way: Way, described: set[int]) -> list[int]:
    """Return the numbers of all PDOs, from 0 on."""
    begun, free = list[int](), list[int]()
    for number in range(MOST_PDOS):
        parameter = way.first + number
        is_begun = parameter in described or parameter + MAPPING in described
        (begun if is_begun else free).append(number)
    missing = max(file.number("DeviceInfo", way.key) - len(begun), 0)
    return sorted([*begun, *islice(free, missing)])


def _parameter(file: EdsFile, way: Way, number: int, subs: list[int]) -> Implied:
    index = way.first + number
    count = EntryDescription(index, 0, "Highest sub-index supported", U8, CONST, default=subs[-1])
    rows = [_entry(file, index, sub, *ELEMENTS[sub - 1], RW) for sub in subs]
    if subs[0] == 1 and not rows[0].has_default:
        rows[0] = _cob_id(way, number)
    title = f"{way.name}{number + 1} communication parameter"
    return ObjectDescription(title, ObjectCode.RECORD), [count, *rows]


def _cob_id(way: Way, number: int) -> EntryDescription:
    """Make the COB-ID of a PDO as CiA 301 has it."""
    index, (name, kind), on = way.first + number, ELEMENTS[0], number < PREDEFINED
    cob_id = way.can_id + 0x100 * number if on else OFF
    return EntryDescription(index, 1, name, kind, RW, default=cob_id, relative=on)


def _mapping(file: EdsFile, way: Way, number: int) -> Implied:
    index = way.first + MAPPING + number
    rows = [_entry(file, index, 0, "Number of mapped objects", U8, RW)]
    for sub in range(1, MOST_MAPPED + 1):
        rows.append(_entry(file, index, sub, f"Mapped object {sub}", U32, RW))
    title = f"{way.name}{number + 1} mapping parameter"
    return ObjectDescription(title, ObjectCode.RECORD), rows


def _entry(  # noqa: PLR0913, PLR0917 - a row of an object table
    file: EdsFile, index: int, sub: int, name: str, kind: DataType, access: Access
) -> EntryDescription:
    default, relative = read_value_beside(file, index, sub, kind)
    return EntryDescription(index, sub, name, kind, access, default=default, relative=relative)
