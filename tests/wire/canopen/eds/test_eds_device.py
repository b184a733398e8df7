from __future__ import annotations

import pytest

from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_device import EdsDevice, read_device
from tickrig.wire.canopen.eds.eds_file import EdsFile
from tickrig.wire.canopen.eds.object_table import RO, RW, WO, EntryDescription

U8 = "ParameterName=x\nDataType=5\nAccessType=rw\n"
SOUND = f"[1000]\n{U8}"


def read(text: str) -> tuple[EdsDevice, list[str], list[str]]:
    file = EdsFile("a.eds", text)
    device = read_device(file)
    return device, [str(one) for one in file.errors], [str(one) for one in file.warnings]


def entries(text: str) -> list[EntryDescription]:
    device, errors, _ = read(text)
    assert errors == []
    return list(device.entries)


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("", "a.eds: has no objects"),
        ("[DeviceInfo]\nVendorName=x\n", "a.eds: has no objects"),
        ("hello\nyou\n", "a.eds: line 1 is no keyword with a value: 'hello'"),
        (
            f"{SOUND}\nrubbish\n",
            "a.eds: [1000] line 6 is no keyword with a value: 'rubbish'",
        ),
        (f"{SOUND}[1000]\nx=1\n", "a.eds: [1000] is there twice, line 5"),
        (f"[1a00]\n{U8}[1A00]\n", "a.eds: [1A00] is there twice, line 5"),
        (f"{SOUND}datatype=2\n", "a.eds: [1000] datatype is there twice, line 5"),
        ("[1017]\nParameterName=x\nDataType=6\n", "a.eds: [1017] AccessType is missing"),
        ("[1017]\nDataType=6\nAccessType=rw\n", "a.eds: [1017] ParameterName is missing"),
        ("[1017]\nParameterName=x\nAccessType=rw\n", "a.eds: [1017] DataType is missing"),
        (f"[1017]\n{U8}PDOMapping=yes\n", "a.eds: [1017] PDOMapping=yes is not a number"),
        (f"[1017]\n{U8}ObjectType=3\n", "a.eds: [1017] ObjectType=3 is no kind of object"),
        (
            "[1017]\nParameterName=x\nDataType=0x17\nAccessType=rw\n",
            "a.eds: [1017] DataType=0x0017 is unknown",
        ),
        (
            "[1017]\nParameterName=x\nDataType=5\nAccessType=rx\n",
            "a.eds: [1017] access type 'rx' is none of ro, wo, rw, rwr, rww, const",
        ),
        (f"[2000]\n{U8}DefaultValue=0x1FF\n", "a.eds: [2000] DefaultValue=0x1FF is no UNSIGNED8"),
        (f"[2000]\n{U8}DefaultValue=three\n", "a.eds: [2000] DefaultValue=three is no UNSIGNED8"),
        (f"[2000]\n{U8}ParameterValue=-1\n", "a.eds: [2000] ParameterValue=-1 is no UNSIGNED8"),
        (f"[2000]\n{U8}LowLimit=low\n", "a.eds: [2000] LowLimit=low is no UNSIGNED8"),
        (f"[2000]\n{U8}LowLimit=9\nHighLimit=8\n", "a.eds: [2000] LowLimit 9 is above HighLimit 8"),
        (
            f"[2000]\n{U8}DefaultBytes=0g\n",
            "a.eds: [2000] DefaultBytes=0g is no 1 hexadecimal bytes",
        ),
        (
            f"[2000]\n{U8}DefaultBytes=0102\n",
            "a.eds: [2000] DefaultBytes=0102 is no 1 hexadecimal bytes",
        ),
        (
            "[2000]\nParameterName=x\nDataType=0xA\nAccessType=rw\nDefaultBytes=0g\n",
            "a.eds: [2000] DefaultBytes=0g is no hexadecimal bytes",
        ),
        (f"[2000]\n{U8}MaxBytes=few\n", "a.eds: [2000] MaxBytes=few is not a number"),
        (f"[2000]\n{U8}MaxBytes=-1\n", "a.eds: [2000] MaxBytes=-1 is not in 0..4294967295"),
        (f"[2000sub1]\n{U8}", "a.eds: [2000sub1] has no object [2000]"),
        (
            f"[2000]\n{U8}ObjectType=7\n[2000sub1]\n{U8}",
            "a.eds: [2000sub1] is part of a VAR, which has none",
        ),
        (
            "[2000]\nParameterName=x\nObjectType=8\nCompactSubObj=2\nAccessType=rw\n",
            "a.eds: [2000] DataType is missing",
        ),
        (
            f"{SOUND}[DeviceComissioning]\nNodeID=200\n",
            "a.eds: [DeviceComissioning] NodeID=200 is not in 1..127",
        ),
        (
            f"{SOUND}[DeviceCommissioning]\nNodeID=x\n",
            "a.eds: [DeviceComissioning] NodeID=x is not a number",
        ),
    ],
)
def test_what_has_no_meaning_is_an_error_with_section_and_key(text: str, error: str) -> None:
    assert read(text)[1:] == ([error], [])


def test_all_errors_of_a_file_are_told_at_once() -> None:
    text = (
        f"[1000]\nrubbish\n[2000]\n{U8}DefaultValue=300\nPDOMapping=maybe\n"
        f"[2001]\nParameterName=y\n[2002]\n{U8}[2002]\n{U8}"
    )
    device, errors, _ = read(text)
    assert errors == [
        "a.eds: [1000] line 2 is no keyword with a value: 'rubbish'",
        "a.eds: [2002] is there twice, line 15",
        "a.eds: [1000] ParameterName is missing",
        "a.eds: [1000] DataType is missing",
        "a.eds: [1000] AccessType is missing",
        "a.eds: [2000] PDOMapping=maybe is not a number",
        "a.eds: [2000] DefaultValue=300 is no UNSIGNED8",
        "a.eds: [2001] DataType is missing",
        "a.eds: [2001] AccessType is missing",
    ]
    assert [row.index for row in device.entries] == [0x2000, 0x2002]


@pytest.mark.parametrize(
    ("text", "warning"),
    [
        (f"{U8}PDOMapping=\n", "PDOMapping is empty: 0 is taken"),
        (
            "ParameterName=x\nDataType=\nAccessType=rw\n",
            "DataType is empty: 15 is taken",
        ),
        (
            "ParameterName=x\nDataType=5\nAccessType=\n",
            "AccessType is empty: rw is taken",
        ),
        (
            "ParameterName=x\nDataType=5\nAccessType=R\n",
            "AccessType=R is none of CiA 306: ro is taken",
        ),
        (
            "ParameterName=x\nDataType=0x40\nAccessType=ro\n",
            "DataType=0x0040 is unknown: DOMAIN is taken",
        ),
        (
            f"{U8}DefaultValue=0x12ul\n",
            "DefaultValue=0x12ul is no number of CiA 306: 0x12 is taken",
        ),
        (f"{U8}HighLimit=0099\n", "HighLimit=0099 is no number of CiA 306: 99 is taken"),
        (
            "ParameterName=x\nDataType=1\nAccessType=rw\nDefaultValue=0xFF\n",
            "DefaultValue=0xFF is no BOOLEAN: 1 is taken",
        ),
        (f"{U8}Factor=0\n", "Factor=0 is no factor: 1 is taken"),
        (f"{U8}Factor=big\n", "Factor=big is no factor: 1 is taken"),
        (
            "ParameterName=x\nDataType=9\nAccessType=ro\nDefaultValue=5 €\n",
            "DefaultValue=5 € is not ASCII: its bytes in UTF-8 are taken",
        ),
        (
            "ParameterName=x\nDataType=9\nAccessType=ro\nDefaultValue=5 °C\n",
            "DefaultValue=5 °C is not ASCII: its bytes in ISO 8859-1 are taken",
        ),
        (
            f"{U8}ObjectType=9\nCompactSubObj=1\n",
            "CompactSubObj in a RECORD: its entries are taken to be alike",
        ),
    ],
)
def test_what_has_one_meaning_is_a_warning_with_section_and_key(text: str, warning: str) -> None:
    device, errors, warnings = read(f"[2000]\n{text}")
    assert (errors, warnings) == ([], [f"a.eds: [2000] {warning}"])
    assert device.entries


def test_texts_beyond_ascii_have_the_bytes_of_their_coding() -> None:
    text = "[2000]\nParameterName=x\nDataType=9\nAccessType=ro\nDefaultValue="
    assert [entries(text + word)[0].default for word in ("°", "€")] == [b"\xb0", b"\xe2\x82\xac"]
    _, errors, _ = read("[2000]\nParameterName=x\nDataType=0xA0\nAccessType=ro\nDefaultValue=€")
    assert errors == ["a.eds: [2000] DefaultValue=€ is no VISIBLE_CHAR"]


def test_letters_of_c_and_lone_letters_mean_what_they_meant() -> None:
    row = "ParameterName=x\nDataType=0x1B\nAccessType=W\nDefaultValue=0x1234567890ABCDEFLL\n"
    (entry,) = entries(f"[2120]\n{row}")
    assert (entry.default, entry.access) == (bytes.fromhex("efcdab9078563412"), WO)


PDO_MAPPING = (
    "[1600]\nParameterName=RPDO 1 mapping\nObjectType=9\nDataType=7\nAccessType={access}\n"
    "CompactSubObj=4\n[1600Value]\nNrOfEntries=2\n1=0x20000108\n2=0x20010110\n"
)


def test_a_compact_record_has_its_elements_and_counts_those_in_use() -> None:
    head, *elements = entries(PDO_MAPPING.format(access="rw"))
    assert (head.sub, head.data_type, head.default, head.access) == (
        *(0, DataType.UNSIGNED8),
        *(b"\x02", RW),
    )
    assert [row.sub for row in elements] == [1, 2, 3, 4]
    assert [row.default if row.has_default else None for row in elements] == [
        *(bytes.fromhex("08010020"), bytes.fromhex("10010120")),
        *(None, None),
    ]
    assert entries(PDO_MAPPING.format(access="ro"))[0].access == RO


def test_a_compact_array_counts_its_elements() -> None:
    text = f"[2000]\n{U8}ObjectType=8\nCompactSubObj=3\n[2000Name]\nNrOfEntries=1\n2=second\n"
    assert [
        (row.sub, row.name, row.default if row.has_default else None) for row in entries(text)
    ] == [
        *[(0, "Number of entries", b"\x03"), (1, "x1", None), (2, "second", None)],
        (3, "x3", None),
    ]


def test_a_data_type_of_the_file_is_what_its_section_says() -> None:
    own = "[2000]\nParameterName=x\nDataType=0xA0\nAccessType=rw\n[a0SUB1]\nDefaultValue={}\n"
    assert entries(own.format("0x06"))[0].data_type is DataType.UNSIGNED16
    assert read(own.format("six"))[1] == ["a.eds: [A0sub1] DefaultValue=six is not a number"]


def test_what_describes_no_device_may_say_what_it_wants() -> None:
    text = (
        f"{SOUND}[Comments]\nLines=1\nLines=2\nfree text\n[Comments]\nmore\n[1000Denotation]\nx\n"
    )
    assert read(text)[1:] == ([], [])


def test_comments_and_blanks_are_skipped() -> None:
    text = f"; a; comment\n# another\n  [2000] ; here\n{U8}  DefaultValue = 7\t;here\n"
    assert entries(text)[0].default == b"\x07"


def test_objects_that_only_define_a_type_are_none() -> None:
    text = f"{SOUND}[00A0]\nObjectType=6\n[00A0sub1]\n{U8}[2000]\nObjectType=0\n"
    assert [row.index for row in entries(text)] == [0x1000]


def test_long_texts_are_shortened() -> None:
    _, (error,), _ = read(f"[2000]\n{U8}DefaultValue={'x' * 1_000}\n")
    assert error == f"a.eds: [2000] DefaultValue={'x' * 37}... is no UNSIGNED8"
