from __future__ import annotations

from pathlib import Path

import pytest

from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.ds402 import Ds402
from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.canopen.eds import DeviceDescription, describe, read_eds
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.eds.eds_file import EdsError, EdsFile
from tickrig.wire.canopen.eds.object_table import Access, DeviceInfo, ObjectCode, ObjectDescription

SAMPLE = Path(__file__).parent / "sample.dcf"
NODE_ID = 5
TYPE = "[1000]\nParameterName=Device type\nDataType=7\nAccessType=ro\n"


@pytest.fixture(scope="module")
def sample() -> DeviceDescription:
    return read_eds(SAMPLE)


def test_a_dcf_says_node_id_bit_rates_and_names(sample: DeviceDescription) -> None:
    assert (sample.node_id, sample.bit_rate) == (0x10, 500_000)
    assert sample.info == DeviceInfo("Somebody", "Sample", "", frozenset({125_000, 1_000_000}))


def test_an_eds_without_commissioning_leaves_the_node_id_open() -> None:
    description = describe(EdsFile("short.eds", TYPE))
    assert (description.node_id, description.bit_rate) == (None, None)
    assert len(description.make_dictionary()) == 1


def test_an_eds_that_cannot_be_used_says_all_that_is_wrong() -> None:
    text = f"{TYPE}DefaultValue=x\n[1001]\nParameterName=b\nDataType=5\nDefaultValue=256\n"
    with pytest.raises(EdsError) as error:
        describe(EdsFile("a.eds", text))
    assert str(error.value).splitlines() == [
        "a.eds:5: [1000] DefaultValue=x is no UNSIGNED32 (default-value)",
        "a.eds:9: [1001] DefaultValue=256 is no UNSIGNED8 (default-value)",
    ]
    assert [one.section for one in error.value.findings] == ["1000", "1001"]


def test_a_cob_id_of_an_odd_type_has_no_usual_default() -> None:
    text = "[1014]\nParameterName=EMCY\nDataType=5\nAccessType=rw\n[1005]\nParameterName=SYNC\n"
    description = describe(EdsFile("odd.eds", f"{text}DataType=2\nAccessType=rw\n"))
    assert description.template[0x1005, 0].value == 0


@pytest.mark.parametrize(
    ("index", "sub", "value"),
    [
        (0x2001, 0, 1),
        (0x2002, 0, -2),
        (0x2003, 0, -3),
        (0x2004, 0, 15),
        (0x2005, 0, 5.25),
        (0x2006, 0, 1.0),
        (0x2007, 0, "a = b;c"),
        (0x2008, 0, "abc✓"),
        (0x2009, 0, b"\xab\xcd"),
        (0x200A, 0, b"@ABCD"),
        (0x200B, 0, bytes([6, 5, 4, 3, 2, 1])),
        (0x200C, 0, 2**64 - 1),
        (0x1018, 4, 0x1234),
        (0x1A00, 1, 0x2001_0110),
        (0x2031, 1, 7),
    ],
)
def test_defaults_of_every_data_type_are_read(
    sample: DeviceDescription, index: int, sub: int, value: Value
) -> None:
    assert sample.template[index, sub].value == value


@pytest.mark.parametrize(
    ("index", "sub", "value"),
    [
        (0x1800, 1, 0x185),
        (0x1800, 2, 5),
        (0x1801, 1, 0x4000_0285),
        (0x2031, 3, 0x35),
        (0x1005, 0, 0x80),
        (0x1804, 1, 0x8000_0000),
    ],
)
def test_the_node_id_is_added_and_cob_ids_have_the_usual_default(
    sample: DeviceDescription, index: int, sub: int, value: int
) -> None:
    data = sample.template[index, sub].description.power_on_data(NODE_ID)
    assert int.from_bytes(data, "little") == value


@pytest.mark.parametrize(
    ("index", "access"),
    [
        (0x1000, Access.READ),
        (0x2001, Access.READ | Access.WRITE | Access.TPDO | Access.RPDO),
        (0x2002, Access.READ | Access.WRITE | Access.TPDO),
        (0x2003, Access.READ | Access.WRITE | Access.RPDO),
        (0x2004, Access.WRITE | Access.RPDO),
        (0x2007, Access.READ | Access.CONST),
    ],
)
def test_access_types_are_read(sample: DeviceDescription, index: int, access: Access) -> None:
    assert sample.template[index, 0].description.access == access


def test_limits_are_read_in_every_notation(sample: DeviceDescription) -> None:
    limits = {
        index: (
            sample.template[index, 0].description.low,
            sample.template[index, 0].description.high,
        )
        for index in (0x2002, 0x2003, 0x2005, 0x2020)
    }
    assert limits == {
        0x2002: (-128, None),
        0x2003: (-3, 0),
        0x2005: (4.5, None),
        0x2020: (None, None),
    }


def test_a_compact_array_has_all_its_elements(sample: DeviceDescription) -> None:
    elements = [entry for entry in sample.template if entry.index == 0x2031]
    assert [entry.description.name for entry in elements] == [
        "Number of entries",
        "Status1",
        "Second",
        "Status3",
    ]
    assert elements[0].value == 3
    assert {entry.description.access for entry in elements[1:]} == {Access.READ | Access.TPDO}
    assert sample.template.objects[0x2031] == ObjectDescription("Status", ObjectCode.ARRAY)


def test_a_compact_error_field_begins_empty_and_ends_at_254(sample: DeviceDescription) -> None:
    count = sample.template[0x1003, 0]
    assert (count.value, count.description.writable) == (0, True)
    assert len(sample.template.elements(0x1003)) == 254


def test_a_count_without_default_is_the_highest_sub_index(sample: DeviceDescription) -> None:
    assert sample.template[0x1018, 0].value == 4
    assert sample.template[0x1A00, 0].value == 0


def test_unknown_and_derived_data_types_are_taken(sample: DeviceDescription) -> None:
    assert sample.template[0x2020, 0].data_type is DataType.DOMAIN
    assert sample.template[0x2021, 0].data_type is DataType.UNSIGNED16
    assert sample.template[0x2032, 0].data_type is DataType.REAL32
    assert sample.template.find(0x00A0, 1) is None
    assert 0x2030 not in sample.template.objects


def test_a_string_may_be_limited(sample: DeviceDescription) -> None:
    assert sample.template[0x2009, 0].description.max_bytes == 9


def test_a_slave_just_starts_from_its_eds(sample: DeviceDescription) -> None:
    bus = Bus(make_slave(sample.make_dictionary(), sample.node_id or 1))
    assert bus.step() == ["710#00"]
    assert bus.slave.dictionary[0x1800, 1].value == 0x190


def test_each_slave_has_a_dictionary_of_its_own(sample: DeviceDescription) -> None:
    first, second = sample.make_dictionary(), sample.make_dictionary()
    first[0x2002, 0].value = 3
    assert second[0x2002, 0].value == sample.template[0x2002, 0].value == -2


def test_older_editors_write_windows_1252(tmp_path: Path) -> None:
    path = tmp_path / "old.eds"
    path.write_bytes(f"[DeviceInfo]\r\nVendorName=Müller\r\n{TYPE}".encode("cp1252"))
    assert read_eds(path).info.vendor_name == "Müller"


def test_a_byte_order_mark_is_skipped(tmp_path: Path) -> None:
    path = tmp_path / "bom.eds"
    path.write_bytes(b"\xef\xbb\xbf[DeviceInfo]\nVendorName=Me\n" + TYPE.encode())
    assert read_eds(path).info.vendor_name == "Me"


DRIVE = (
    "[1000]\nParameterName=Device type\nDataType=7\nAccessType=ro\nDefaultValue={type}\n"
    "[6040]\nParameterName=Controlword\nDataType=6\nAccessType=rww\n"
    "[6041]\nParameterName=Statusword\nDataType=6\nAccessType=ro\n"
    "[6060]\nParameterName=Mode\nDataType=2\nAccessType=rw\n"
)


def open_object(index: str, kind: int, more: str = "") -> str:
    return f"[{index}]\nParameterName=x\nDataType={kind}\nAccessType=rw\n{more}"


def reasons(description: DeviceDescription) -> list[str]:
    return [one.reason for one in description.warnings]


@pytest.mark.parametrize(
    ("index", "kind", "limits", "value"),
    [
        ("6065", 7, "", 0xFFFF_FFFF),
        ("6065", 4, "", 0x7FFF_FFFF),
        ("6065", 7, "HighLimit=4000\n", 4_000),
        ("6072", 6, "DefaultValue=\n", 0xFFFF),
        ("6073", 6, "", 0xFFFF),
        ("6075", 7, "", 1_000),
        ("607F", 7, "", 0xFFFF_FFFF),
        ("6081", 7, "", 10_000),
        ("6081", 5, "", 255),
        ("6083", 7, "LowLimit=20000\n", 20_000),
        ("60C5", 7, "", 0xFFFF_FFFF),
        ("6502", 7, "", 0x3ED),
        ("6865", 7, "", 0xFFFF_FFFF),
        ("605A", 3, "", 2),
        ("6064", 4, "", 0),
        ("6081", 7, "DefaultValue=0\n", 0),
        ("2065", 7, "", 0),
        ("2065", 7, "LowLimit=1\n", 1),
    ],
)
def test_a_drive_has_the_defaults_of_its_profile_where_its_file_has_none(
    index: str, kind: int, limits: str, value: int
) -> None:
    text = DRIVE.format(type="0x00020192") + open_object(index, kind, limits)
    assert describe(EdsFile("a.eds", text)).template[int(index, 16), 0].value == value


def test_a_profile_that_is_left_out_gives_no_defaults() -> None:
    text = DRIVE.format(type="0x00020192") + open_object("6065", 7)
    description = describe(EdsFile("a.eds", text), "none")
    assert (description.template[0x6065, 0].value, description.warnings) == (0, ())


@pytest.mark.parametrize(
    ("index", "kind", "value"),
    [
        ("6005", 1, 1),
        ("6006sub1", 5, 0xFF),
        ("6050sub3", 1, 1),
        ("6106sub1", 6, 0xFFFF),
        ("6206sub1", 5, 0xFF),
        ("6328sub1", 7, 0xFFFF_FFFF),
        ("6207sub1", 5, 0),
        ("6421sub1", 5, 7),
        ("6423", 1, 0),
        ("6432sub1", 4, 1),
        ("642Fsub1", 8, 1.0),
        ("6443sub1", 5, 1),
        ("1800sub2", 5, 255),
        ("1400sub2", 5, 255),
    ],
)
def test_an_io_module_has_the_defaults_of_its_profile_where_its_file_has_none(
    index: str, kind: int, value: Value
) -> None:
    head, _, sub = index.partition("sub")
    whole = f"[{head}]\nParameterName=x\nObjectType=8\n" if sub else ""
    text = f"{TYPE}DefaultValue=0x191\n{whole}{open_object(index, kind)}"
    template = describe(EdsFile("a.eds", text)).template
    assert template[int(head, 16), int(sub or "0", 16)].value == value


def test_values_that_are_chosen_are_told_once() -> None:
    rows = ((index, 7, "") for index in ("6065", "6067", "607F", "6080", "6081"))
    text = DRIVE.format(type="0x192") + "".join(open_object(*row) for row in rows)
    text += open_object("2000", 5, "LowLimit=3\n") + open_object("2001", 5, "LowLimit=3\n")
    assert reasons(describe(EdsFile("a.eds", text))) == [
        "no DefaultValue for 5 values of CiA 402: those of the profile are taken, as"
        " 6065h=0xFFFFFFFF, 6067h=0xFFFFFFFF, 607Fh=0xFFFFFFFF, ...",
        "no DefaultValue for 2 values whose limits leave 0 out: the limit next to 0 is taken, as"
        " 2000h=0x03, 2001h=0x03",
    ]


@pytest.mark.parametrize(
    ("device_type", "said"), [("", "1000h has no value"), ("0", "1000h names none")]
)
def test_a_drive_without_a_device_type_is_told_which_profile_it_wants(
    device_type: str, said: str
) -> None:
    file = EdsFile("a.eds", DRIVE.format(type=device_type))
    hint = ': no profile; use --profile 402 (in a rig file: profile = "402")'
    assert reasons(describe(file)) == [said + hint]
    assert reasons(describe(file, "none")) == []
    described = describe(file, "402")
    assert described.application is Ds402
    assert described.template[0x1000, 0].value == (0 if device_type else 402)


def test_a_device_without_1000h_is_told_which_profile_it_wants() -> None:
    (hint,) = reasons(
        describe(EdsFile("a.eds", DRIVE.format(type="")[DRIVE.index("[6040]") - 6 :]))
    )
    assert hint.startswith("there is no 1000h: no profile; use --profile 402")
    inputs = "[6000]\nParameterName=x\nObjectType=8\n" + open_object("6000sub1", 5)
    (hint,) = reasons(describe(EdsFile("a.eds", TYPE + inputs)))
    assert hint.startswith("1000h has no value: no profile; use --profile 401")
    assert describe(EdsFile("a.eds", TYPE + inputs), "401").template[0x1000, 0].value == 401
    assert reasons(describe(EdsFile("a.eds", TYPE + open_object("6000", 6)))) == []


def test_modes_that_are_served_otherwise_than_the_file_says_are_told() -> None:
    text = DRIVE.format(type="0x192") + open_object("6502", 7, "DefaultValue=0\n")
    assert "6502h=0 lists no mode of operation: 0x000003ED is served" in reasons(
        describe(EdsFile("a.eds", text))
    )


def test_a_drive_whose_file_gives_no_values_can_be_enabled_and_moves() -> None:
    rows = (
        *(("6061", 2), ("6064", 4), ("6065", 7), ("6066", 6), ("6072", 6), ("6073", 6)),
        *(("6075", 7), ("607A", 4), ("607F", 7), ("6080", 7), ("6081", 7), ("6083", 7)),
        *(("6084", 7), ("6085", 7), ("60C5", 7), ("60C6", 7), ("60E0", 6), ("60E1", 6)),
    )
    text = DRIVE.format(type="0x00020192") + "".join(open_object(*row) for row in rows)
    description = describe(EdsFile("a.eds", text))
    slave = make_slave(description.make_dictionary(), NODE_ID, None, description.application)
    bus, objects = Bus(slave), slave.dictionary
    bus.step()
    objects[0x6060, 0].download(b"\1")
    objects[0x607A, 0].download((2_000).to_bytes(4, "little"))
    for controlword in (6, 7, 15, 31):
        objects[0x6040, 0].download(controlword.to_bytes(2, "little"))
        assert bus.run(5) == []
    assert bus.run(1_500) == []
    assert (objects[0x6041, 0].number & 0x6F, objects[0x6064, 0].number) == (0x27, 2_000)
