"""Families of objects for the same lines or channels, by width (CiA 401, object dictionary).

Objects of several widths refer to the same physical lines: 6100h:01 shows the lines of 6000h:01
and 6000h:02. The indices are those of two public profile tables (CanFestival, DS-401.prf;
tonyrog/canopen, DS-401.def). The meaning of single indices is that of the manuals of Turck BL20,
WAGO 750 and VIPA 300V.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

from tickrig.device.canopen.dictionary import Dictionary, Entry
from tickrig.wire.canopen.datatypes import DataType


class DigitalObjects(NamedTuple):
    """Indices of the objects that contain one property of digital lines, such as their polarity.

    CiA 401 has several objects for the same lines. They differ in the number of lines that one
    sub-index contains.

    Attributes:
        single: index of the first of eight consecutive objects. Each of these objects has at most
            128 lines, and a sub-index contains one line.
        by_8: index of the object whose sub-indices contain 8 lines each.
        by_16: index of the object whose sub-indices contain 16 lines each.
        by_32: index of the object whose sub-indices contain 32 lines each.
    """

    single: int
    by_8: int
    by_16: int
    by_32: int


READ_INPUT: Final = DigitalObjects(0x6020, 0x6000, 0x6100, 0x6120)
POLARITY_INPUT: Final = DigitalObjects(0x6030, 0x6002, 0x6102, 0x6122)
FILTER_INPUT: Final = DigitalObjects(0x6038, 0x6003, 0x6103, 0x6123)
INTERRUPT_ANY_CHANGE: Final = DigitalObjects(0x6050, 0x6006, 0x6106, 0x6126)
INTERRUPT_LOW_TO_HIGH: Final = DigitalObjects(0x6060, 0x6007, 0x6107, 0x6127)
INTERRUPT_HIGH_TO_LOW: Final = DigitalObjects(0x6070, 0x6008, 0x6108, 0x6128)
WRITE_OUTPUT: Final = DigitalObjects(0x6220, 0x6200, 0x6300, 0x6320)
POLARITY_OUTPUT: Final = DigitalObjects(0x6240, 0x6202, 0x6302, 0x6322)
ERROR_MODE_OUTPUT: Final = DigitalObjects(0x6250, 0x6206, 0x6306, 0x6326)
ERROR_VALUE_OUTPUT: Final = DigitalObjects(0x6260, 0x6207, 0x6307, 0x6327)
FILTER_MASK_OUTPUT: Final = DigitalObjects(0x6270, 0x6208, 0x6308, 0x6328)

SINGLE_BANKS: Final = 8
SINGLE_BANK_LINES: Final = 128

DIGITAL_INTERRUPT_ENABLE: Final = 0x6005
ANALOGUE_INTERRUPT_ENABLE: Final = 0x6423
INTERRUPT_TRIGGER: Final = 0x6421
INTERRUPT_SOURCE: Final = 0x6422
DEFAULT_TRIGGER: Final = 7
"""Default of 6421h: limits and delta."""


class AnalogueObjects(NamedTuple):
    """Indices of the objects that contain the values and the scaling of analogue lines.

    `ANALOGUE_INPUT` has the indices for inputs, and `ANALOGUE_OUTPUT` those for outputs.

    Attributes:
        integers: indices of the values of 8, 16 and 32 bit.
        real: index of the value as REAL32.
        real_offset: index of the offset that is added to the REAL32 value.
        real_scaling: index of the factor of the REAL32 value, which is applied before the offset.
        integer_offset: index of the offset that is added to an integer value.
        integer_scaling: index of the factor of an integer value, which is applied before the
            offset.
    """

    integers: tuple[int, int, int]
    real: int
    real_offset: int
    real_scaling: int
    integer_offset: int
    integer_scaling: int


ANALOGUE_INPUT: Final = AnalogueObjects(
    (0x6400, 0x6401, 0x6402), 0x6403, 0x642E, 0x642F, 0x6431, 0x6432
)
ANALOGUE_OUTPUT: Final = AnalogueObjects(
    (0x6410, 0x6411, 0x6412), 0x6413, 0x6441, 0x6442, 0x6446, 0x6447
)
INTEGER_LIMITS: Final = 0x6424
"""Index of the upper limit. The lower limit, delta, negative delta and positive delta follow it."""
REAL_LIMITS: Final = 0x6429
"""The limits and deltas as REAL32 objects."""
ANALOGUE_ERROR_MODE: Final = 0x6443
INTEGER_ERROR_VALUE: Final = 0x6444
REAL_ERROR_VALUE: Final = 0x6445


_ALL_ONES: Final = (INTERRUPT_ANY_CHANGE, ERROR_MODE_OUTPUT, FILTER_MASK_OUTPUT)
DEFAULTS: Final[dict[int, int]] = {
    **{
        index: -1
        for family in _ALL_ONES
        for index in (
            *range(family.single, family.single + SINGLE_BANKS),
            *(family.by_8, family.by_16, family.by_32),
        )
    },
    DIGITAL_INTERRUPT_ENABLE: 1,
    INTERRUPT_TRIGGER: DEFAULT_TRIGGER,
    ANALOGUE_ERROR_MODE: 1,
    **{
        index: 1
        for objects in (ANALOGUE_INPUT, ANALOGUE_OUTPUT)
        for index in (objects.real_scaling, objects.integer_scaling)
    },
}
"""Default of each element by index: -1 for all bits; 0 if not listed (CiA 401, default values)."""


def elements(dictionary: Dictionary, index: int) -> Iterator[tuple[int, Entry]]:
    """Yield the entries of an object that are numbers, each after its sub-index."""
    for entry in dictionary.object(index):
        if 1 <= entry.sub <= 254 and _is_number(entry):
            yield entry.sub, entry


def find_number(dictionary: Dictionary, index: int, sub: int) -> Entry | None:
    """Return an entry that is a number, or None if there is none."""
    entry = dictionary.find(index, sub)
    return entry if entry is not None and _is_number(entry) else None


def _is_number(entry: Entry) -> bool:
    return entry.data_type.is_integer or entry.data_type is DataType.REAL32


def channels(dictionary: Dictionary, objects: AnalogueObjects) -> list[int]:
    """Return the numbers of the channels that a device has, 1..254."""
    indices = (*objects.integers, objects.real)
    return sorted({sub for index in indices for sub, _ in elements(dictionary, index)})
