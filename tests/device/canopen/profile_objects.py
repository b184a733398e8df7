"""Objects of the device profiles that checks of CiA 401 and CiA 402 need beside R1."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Final

from tests.device.canopen import reference as r1
from tests.device.canopen.reference import BOOL, I8, I16, I32, RO, RPDO, RW, TPDO, U8, U16, U32
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.wire.canopen.eds.object_table import EntryDescription

GENERIC_IO: Final = "401"
DRIVE: Final = "402"

ARRAYS: Final[tuple[r1.Array, ...]] = (
    (0x6002, "Polarity input 8-bit", 2, U8, RW, 0),
    (0x6003, "Filter input 8-bit", 2, U8, RW, 0),
    (0x6006, "Interrupt mask any change 8-bit", 2, U8, RW, 0xFF),
    (0x6007, "Interrupt mask low to high 8-bit", 2, U8, RW, 0),
    (0x6008, "Interrupt mask high to low 8-bit", 2, U8, RW, 0),
    (0x6202, "Polarity output 8-bit", 2, U8, RW, 0),
    (0x6206, "Error mode output 8-bit", 2, U8, RW, 0xFF),
    (0x6207, "Error value output 8-bit", 2, U8, RW, 0),
    (0x6208, "Filter mask output 8-bit", 2, U8, RW, 0xFF),
    (0x6421, "Interrupt trigger selection", 4, U8, RW, 7),
    (0x6424, "Upper limit", 4, I32, RW, 0),
    (0x6425, "Lower limit", 4, I32, RW, 0),
    (0x6426, "Delta", 4, U32, RW, 0),
    (0x6427, "Negative delta", 4, U32, RW, 0),
    (0x6428, "Positive delta", 4, U32, RW, 0),
    (0x6443, "Analogue output error mode", 4, U8, RW, 1),
    (0x6444, "Analogue output error value", 4, I32, RW, 0),
)

VARIABLES: Final[dict[str, tuple[r1.Variable, ...]]] = {
    GENERIC_IO: (
        (0x6005, "Global interrupt enable digital", BOOL, RW, True),
        (0x6423, "Global interrupt enable analogue", BOOL, RW, False),
    ),
    DRIVE: (
        (0x6007, "Abort connection option code", I16, RW, 1),
        (0x6040, "Controlword", U16, RW | RPDO, 0),
        (0x6041, "Statusword", U16, RO | TPDO, 0),
        (0x605A, "Quick stop option code", I16, RW, 2),
        (0x6060, "Modes of operation", I8, RW | RPDO, 0),
        (0x6061, "Modes of operation display", I8, RO | TPDO, 0),
        (0x6064, "Position actual value", I32, RO | TPDO, 0),
        (0x606C, "Velocity actual value", I32, RO | TPDO, 0),
        (0x607A, "Target position", I32, RW | RPDO, 0),
        (0x607C, "Home offset", I32, RW, 0),
        (0x6098, "Homing method", I8, RW, 0),
        (0x60FF, "Target velocity", I32, RW | RPDO, 0),
    ),
}


def make_dictionary(needs: Collection[str]) -> Dictionary:
    """Make R1 with all that a check needs."""
    plain = r1.make_dictionary(needs)
    return Dictionary([*plain.description, *_added(needs)], plain.objects)


def _added(needs: Collection[str]) -> Iterator[EntryDescription]:
    for need in (GENERIC_IO, DRIVE):
        if need in needs:
            for index, name, kind, access, default in VARIABLES[need]:
                yield EntryDescription(index, 0, name, kind, access, default=default)
    if GENERIC_IO in needs:
        for row in ARRAYS:
            yield from r1.array(row)
