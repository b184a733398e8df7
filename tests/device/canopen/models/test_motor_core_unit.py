from __future__ import annotations

import pytest

from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.models import motor_core_unit
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import RO, ROT, RW, RWW, Access

U8, U16, U32 = DataType.UNSIGNED8, DataType.UNSIGNED16, DataType.UNSIGNED32
I16, I32 = DataType.INTEGER16, DataType.INTEGER32

ROWS = [
    (0x1000, 0, U32, RO, 0x000C_0191),
    (0x2000, 0, U8, RW, 0),
    (0x2001, 0, U16, ROT, 0),
    (0x2010, 1, U32, RW, 180_000),
    (0x2010, 2, U32, RW, 360_000),
    (0x2010, 3, U32, RW, 10_000),
    (0x2011, 0, I32, RW, 0),
    *((0x6411, sub, I16, RWW, 0) for sub in range(1, 5)),
    *((0x6401, sub, I16, ROT, 0) for sub in range(1, 5)),
    (0x6443, 1, U8, RW, 1),
    (0x6444, 1, I32, RW, 0),
]
"""Decision K19, its table."""


@pytest.fixture
def dictionary() -> Dictionary:
    return motor_core_unit.dictionary()


@pytest.mark.parametrize("row", ROWS)
def test_an_object_is_as_the_table_says(
    dictionary: Dictionary, row: tuple[int, int, DataType, Access, int]
) -> None:
    entry = dictionary[row[:2]]
    assert (entry.data_type, entry.description.access, entry.number) == row[2:]


def test_the_communication_objects_of_the_table_are_there(dictionary: Dictionary) -> None:
    named = {0x1001, 0x1003, 0x1005, *range(0x1008, 0x100B), 0x1014, 0x1016, 0x1017, 0x1018}
    assert named | {0x1029, 0x1200} <= set(dictionary.objects)


@pytest.mark.parametrize("area", [0x1400, 0x1600, 0x1800, 0x1A00])
def test_there_are_four_pdos_each_way(dictionary: Dictionary, area: int) -> None:
    assert [index - area for index in dictionary.objects if area <= index < area + 0x200] == [
        *range(4)
    ]


@pytest.mark.parametrize(
    ("area", "cob_id", "index"), [(0x1400, 0x320, 0x6411), (0x1800, 0x2A0, 0x6401)]
)
def test_the_second_pdo_carries_the_four_channels_and_the_others_are_off(
    dictionary: Dictionary, area: int, cob_id: int, index: int
) -> None:
    second = dictionary[area + 1, 1].description.power_on_data(motor_core_unit.NODE_ID)
    assert int.from_bytes(second, "little") == cob_id
    assert dictionary[area + 1, 2].number == 255
    mapped = [dictionary[area + 0x201, sub].number for sub in range(1, 5)]
    assert mapped == [index << 16 | sub << 8 | 16 for sub in range(1, 5)]
    assert all(dictionary[area + number, 1].number >> 31 for number in (0, 2, 3))
