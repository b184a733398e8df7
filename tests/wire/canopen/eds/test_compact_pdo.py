"""PDOs that are not described, but counted: CompactPDO of [DeviceInfo]."""

from __future__ import annotations

import pytest

from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_device import EdsDevice, read_device
from tickrig.wire.canopen.eds.eds_file import EdsFile
from tickrig.wire.canopen.eds.object_table import CONST, RW, EntryDescription, ObjectCode

VARIABLE = "ParameterName=own\nObjectType=7\nDataType=7\nAccessType=ro\n"
RECORD = "ParameterName=own\nObjectType=9\nSubNumber=1\n"
SOUND = f"[1000]\n{VARIABLE}"


def read(mask: str, rpdos: int | str, tpdos: int | str, text: str = "") -> EdsDevice:
    head = f"[DeviceInfo]\nCompactPDO={mask}\nNrOfRXPDO={rpdos}\nNrOfTXPDO={tpdos}\n"
    file = EdsFile("a.eds", f"{head}{SOUND}{text}")
    device = read_device(file)
    assert file.errors == ()
    return device


def pdos(device: EdsDevice) -> list[int]:
    return sorted(index for index in device.objects if 0x1400 <= index < 0x1C00)


def rows(device: EdsDevice, index: int) -> dict[int, EntryDescription]:
    return {row.sub: row for row in device.entries if row.index == index}


def test_as_many_pdos_are_there_as_are_counted() -> None:
    assert pdos(read("0x3F", 2, 1)) == [0x1400, 0x1401, 0x1600, 0x1601, 0x1800, 0x1A00]
    assert pdos(read("0x3F", 0, 0)) == []


@pytest.mark.parametrize("mask", ["0", "", "none", "0xC0"])
def test_without_a_bit_of_a_sub_index_none_is_implied(mask: str) -> None:
    assert pdos(read(mask, 4, 4)) == []


def test_an_implied_parameter_has_the_sub_indices_of_the_mask() -> None:
    device = read("0x3F", 1, 1)
    for index, name in ((0x1400, "RPDO1"), (0x1800, "TPDO1")):
        described = device.objects[index]
        assert described.name == f"{name} communication parameter"
        assert described.code is ObjectCode.RECORD
        found = rows(device, index)
        assert [(sub, int(row.data_type)) for sub, row in found.items()] == [
            *((0, 5), (1, 7), (2, 5), (3, 6), (4, 5), (5, 6), (6, 5)),
        ]
        assert {row.access for sub, row in found.items() if sub} == {RW}
        assert (found[0].access, found[0].default) == (CONST, b"\6")
    assert list(rows(read("0x13", 1, 0), 0x1400)) == [0, 1, 2, 5]
    assert rows(read("0x13", 1, 0), 0x1400)[0].default == b"\5"
    assert list(rows(read("0x2", 1, 0), 0x1400)) == [0, 2]


def test_an_implied_mapping_has_64_entries_and_none_in_use() -> None:
    device = read("0x3F", 0, 1)
    assert device.objects[0x1A00] == ("TPDO1 mapping parameter", ObjectCode.RECORD)
    found = rows(device, 0x1A00)
    assert list(found) == list(range(65))
    assert (found[0].data_type, found[64].data_type) == (DataType.UNSIGNED8, DataType.UNSIGNED32)
    assert {row.access for row in found.values()} == {RW}
    assert not any(row.has_default or any(row.default) for row in found.values())


def test_four_each_way_have_the_predefined_cob_id_and_the_others_are_off() -> None:
    device = read("3", 5, 5)
    for first, can_id in ((0x1400, 0x205), (0x1800, 0x185)):
        found = [
            int.from_bytes(rows(device, first + at)[1].power_on_data(5), "little")
            for at in range(5)
        ]
        assert found == [can_id, can_id + 0x100, can_id + 0x200, can_id + 0x300, 0x8000_0000]


def test_what_is_described_counts_and_stays() -> None:
    text = f"[1401]\n{RECORD}[1401sub1]\n{VARIABLE}[1A01]\n{RECORD}[1A01sub0]\n{VARIABLE}"
    device = read("0x3F", 3, 1, text)
    found = pdos(device)
    assert found == [0x1400, 0x1401, 0x1402, 0x1600, 0x1601, 0x1602, 0x1801, 0x1A01]
    assert list(rows(device, 0x1401)) == [1]
    assert device.objects[0x1401].name == "own"
    assert device.objects[0x1A01].name == "own"
    assert pdos(read("0x3F", 0, 0, text)) == [0x1401, 0x1601, 0x1801, 0x1A01]


def test_at_most_512_pdos_each_way_are_implied() -> None:
    found = pdos(read("3", 0xFFFF_FFFF, 513))
    assert found == list(range(0x1400, 0x1C00))


def test_a_dcf_gives_values_of_implied_entries() -> None:
    text = "[1400Value]\nNrOfEntries=2\n1=$NODEID+0x300\n2=1\n[1600Value]\n0=1\n1=0x60000008\n"
    device = read("3", 1, 0, text)
    parameter, mapping = rows(device, 0x1400), rows(device, 0x1600)
    assert parameter[1].power_on_data(5) == b"\5\3\0\0"
    assert (parameter[2].default, mapping[0].default) == (b"\1", b"\1")
    assert mapping[1].default == b"\x08\0\0\x60"


def test_a_file_without_objects_stays_none() -> None:
    file = EdsFile("a.eds", "[DeviceInfo]\nCompactPDO=3\nNrOfRXPDO=4\n")
    assert (read_device(file).entries, len(file.errors)) == ((), 1)
