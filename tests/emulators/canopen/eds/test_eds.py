from __future__ import annotations

from pathlib import Path

import pytest

from tests.device.canopen.slave_bench import Bus
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
