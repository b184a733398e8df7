"""The objects that the connected modules of a modular device add."""

from __future__ import annotations

from typing import Final

import pytest

from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_device import EdsDevice, read_device
from tickrig.wire.canopen.eds.eds_file import EdsFile
from tickrig.wire.canopen.eds.object_table import ROT, ObjectCode

HEAD: Final = """
[1000]
ParameterName=Device type
DataType=7
AccessType=ro
DefaultValue=0x191
"""
INPUTS: Final = """
[M1ModuleInfo]
ProductName=Inputs
[M1FixedObjects]
NrOfEntries=2
1=0x6423
2=0x2100
[M1Fixed6423]
ParameterName=Interrupt enable
DataType=1
AccessType=rw
DefaultValue=1
[M1Fixed2100]
ParameterName=Settings
ObjectType=9
SubNumber=2
[M1FIXED2100SUB00]
ParameterName=n
DataType=5
AccessType=ro
DefaultValue=1
[M1Fixed2100sub1]
ParameterName=Filter
DataType=6
AccessType=rw
DefaultValue=7
[M1SubExtends]
NrOfEntries=1
1=0x6000
[M1SubExt6000]
ParameterName=Read inputs
DataType=5
AccessType=ro
DefaultValue=3
PDOMapping=1
Count=2
ObjExtend={extend}
"""
BITS: Final = """
[M2ModuleInfo]
ProductName=Four outputs
[M2SubExtends]
NrOfEntries=1
1=0x6200
[M2SubExt6200]
ParameterName=Write outputs
DataType=5
AccessType=rw
PDOMapping=1
Count=0;4
"""


def read(*modules: int, extend: int = 0, more: str = "") -> tuple[EdsDevice, list[str]]:
    listed = "".join(f"{at}={module}\n" for at, module in enumerate(modules, 1))
    connected = f"[SupportedModules]\nNrOfEntries=2\n[ConnectedModules]\nNrOfEntries=9\n{listed}"
    file = EdsFile("a.dcf", f"{HEAD}{INPUTS.format(extend=extend)}{BITS}{more}{connected}")
    device = read_device(file)
    assert file.errors == ()
    return device, [one.reason for one in file.warnings]


def keys(device: EdsDevice) -> list[str]:
    rows = sorted((row.index, row.sub) for row in device.entries)
    return [f"{index:04X}:{sub:X}" for index, sub in rows if index != 0x1000]


def test_a_device_without_modules_has_its_own_objects() -> None:
    device, warnings = read()
    assert (keys(device), warnings) == ([], [])


def test_a_fixed_object_is_there_once_for_all_modules_that_have_it() -> None:
    device, warnings = read(1, 1)
    assert [key for key in keys(device) if not key.startswith("60")] == [
        *("2100:0", "2100:1", "6423:0"),
    ]
    rows = {(row.index, row.sub): row for row in device.entries}
    assert (rows[0x2100, 1].name, rows[0x2100, 1].default) == ("Filter", b"\7\0")
    assert device.objects[0x2100] == ("Settings", ObjectCode.RECORD)
    assert device.objects[0x6423] == ("Interrupt enable", ObjectCode.VAR)
    assert warnings == []


def test_each_module_adds_its_sub_indices() -> None:
    device, _ = read(1, 2, 1)
    rows = [row for row in device.entries if row.index == 0x6000]
    assert [(row.sub, row.name, row.default) for row in rows] == [
        (0, "Number of entries", b"\4"),
        *((sub, f"Read inputs{sub}", b"\3") for sub in (1, 2, 3, 4)),
    ]
    assert {row.access for row in rows[1:]} == {ROT}
    assert device.objects[0x6000] == ("Read inputs", ObjectCode.ARRAY)


def test_an_object_goes_on_in_the_next_one() -> None:
    device, warnings = read(1, 1, extend=3)
    assert [key for key in keys(device) if key.startswith("60")] == [
        *("6000:0", "6000:1", "6000:2", "6000:3", "6001:0", "6001:1"),
    ]
    assert warnings == []


def test_an_object_does_not_go_on_in_one_that_is_described() -> None:
    other = "[6001]\nParameterName=x\nDataType=5\nAccessType=rw\n"
    device, warnings = read(1, 1, extend=3, more=other)
    assert [key for key in keys(device) if key.startswith("60")] == [
        *("6000:0", "6000:1", "6000:2", "6000:3", "6001:0"),
    ]
    assert warnings == ["6000h has no sub-index free: what it adds is left out"]


@pytest.mark.parametrize(("modules", "bytes_"), [(1, 1), (2, 1), (3, 2), (5, 3)])
def test_modules_share_a_sub_index_bit_by_bit(modules: int, bytes_: int) -> None:
    device, _ = read(*(2,) * modules)
    assert keys(device) == [f"6200:{sub:X}" for sub in range(bytes_ + 1)]


@pytest.mark.parametrize("count", ["", "x", "-1", "0", "0;x", "0;-1", "0;0", "300", "0;300"])
def test_a_count_that_is_none_is_one_sub_index(count: str) -> None:
    more = INPUTS.format(extend=0).replace("Count=2", f"Count={count}").replace("M1", "M3")
    device, warnings = read(3, more=more.replace("M1", "M3"))
    assert [key for key in keys(device) if key.startswith("60")] == ["6000:0", "6000:1"]
    assert warnings == [f"Count={count} is not N, or 0;BITS, of at most 254: 1 is taken"]


def test_what_the_file_describes_stays_as_it_is() -> None:
    array = "[6000]\nParameterName=x\nObjectType=8\n[6000sub0]\nParameterName=n\nAccessType=ro\n"
    own = f"{array}DataType=5\n[6000sub1]\nParameterName=own\nDataType=5\nAccessType=ro\n"
    variable = "[6423]\nParameterName=own\nDataType=5\nAccessType=rw\n"
    device, warnings = read(1, more=own + variable)
    assert keys(device) == ["2100:0", "2100:1", "6000:0", "6000:1", "6423:0"]
    names = {row.name for row in device.entries if row.index in (0x6000, 0x6423)}
    assert (names, warnings) == ({"n", "own"}, [])


def test_an_array_that_is_described_by_its_count_alone_is_filled() -> None:
    array = "[6000]\nParameterName=Inputs\nObjectType=8\nSubNumber=1\n[6000sub0]\n"
    device, warnings = read(1, more=f"{array}ParameterName=n\nAccessType=ro\nDataType=5\n")
    assert [key for key in keys(device) if key.startswith("60")] == ["6000:0", "6000:1", "6000:2"]
    assert device.objects[0x6000].name == "Inputs"
    (count,) = [row for row in device.entries if (row.index, row.sub) == (0x6000, 0)]
    assert (count.default, warnings) == (b"\2", [])


LIST: Final = """
[1027]
ParameterName=Module list
ObjectType=8
SubNumber=4
[1027sub0]
ParameterName=n
DataType=5
AccessType=ro
[1027sub1]
ParameterName=Module 1
DataType=6
AccessType=ro
[1027sub2]
ParameterName=Module 2
DataType=6
AccessType=ro
[1027sub3]
ParameterName=Module 3
DataType={kind}
AccessType=ro
DefaultValue={default}
"""


def test_the_module_list_has_the_numbers_of_the_modules() -> None:
    def values(*modules: int, kind: int = 6, default: str = "") -> list[bytes]:
        device, _ = read(*modules, more=LIST.format(kind=kind, default=default))
        return [row.default for row in device.entries if row.index == 0x1027]

    assert values(2, 1) == [b"\2", b"\2\0", b"\1\0", b"\0\0"]
    assert values(2, 1, 1, 1, default="9") == [b"\3", b"\2\0", b"\1\0", b"\t\0"]
    assert values(1, kind=0xF) == [b"\1", b"\1\0", b"\0\0", b""]
    assert values(70_000)[1] == b"\0\0"


def test_what_is_not_described_is_told() -> None:
    lists = "[M4FixedObjects]\n1=0x6100\n[M4SubExtends]\n1=0x6400\n2=0x12345\n"
    device, warnings = read(4, 5, more=lists)
    assert keys(device) == []
    assert warnings == [
        f"there is no [{title}]: what it would add is left out"
        for title in ("M5ModuleInfo", "M4Fixed6100", "M4SubExt6400", "M4SubExt12345")
    ]


def test_a_fixed_object_that_is_no_object_adds_nothing() -> None:
    lists = "[M4FixedObjects]\n1=0x6100\n2=0x6101\n3=70000\n[M4Fixed6100]\nObjectType=0\n"
    empty = "[M4Fixed6101]\nParameterName=x\nObjectType=8\n"
    assert keys(read(4, more=lists + empty)[0]) == []


def test_an_array_of_modules_has_the_data_type_of_the_module() -> None:
    device, _ = read(2)
    assert {row.data_type for row in device.entries if row.sub} == {DataType.UNSIGNED8}
