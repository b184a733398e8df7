"""XDD files: read as the EDS that they stand for; what XML could do beside that is refused."""

from __future__ import annotations

import pytest

from tests.wire.canopen.eds.xdd_text import EDITOR, XDD
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_device import EdsDevice, read_device
from tickrig.wire.canopen.eds.eds_file import EdsFile, decode_text, encoding_of
from tickrig.wire.canopen.eds.object_table import RO, RW, Access, DeviceInfo, ObjectCode


def read(text: str) -> tuple[EdsDevice, EdsFile]:
    file = EdsFile("a.xdd", text)
    return read_device(file), file


def test_the_head_of_an_xdd_is_that_of_an_eds() -> None:
    device, file = read(XDD)
    assert device.info == DeviceInfo("Lamps", "Lamp", "L-7", frozenset({250_000, 1_000_000}))
    assert (device.node_id, device.bit_rate) == (5, 500_000)
    assert file.sections["DeviceInfo"]["lss_supported"] == "1"
    assert file.sections["DummyUsage"] == {"dummy0005": "1"}
    assert file.sections["FileInfo"]["filename"] == "lamp.xdd"
    assert file.is_xml
    assert file.errors == ()


def test_objects_have_their_attributes_and_those_of_the_parameters_they_name() -> None:
    device, file = read(XDD)
    rows = {(row.index, row.sub): row for row in device.entries}
    assert [f"{index:04X}.{sub}" for index, sub in rows] == [
        *("1000.0", "1014.0", "2000.0", "2001.0", "2002.0", "2002.1", "2003.0", "2004.0"),
    ]
    assert rows[0x1000, 0].default == bytes.fromhex("91010000")
    assert (rows[0x1014, 0].relative, rows[0x1014, 0].access) == (True, RO)
    mode = rows[0x2000, 0]
    assert (mode.data_type, mode.access, mode.low, mode.high, mode.default) == (
        *(DataType.UNSIGNED8, RW | Access.RPDO, 1, 9, b"\x03"),
    )
    level = rows[0x2002, 1]
    assert (level.data_type, level.access, level.low) == (
        *(DataType.INTEGER16, RW | Access.TPDO, -5),
    )
    assert device.objects[0x2002].code is ObjectCode.ARRAY
    assert [str(one) for one in file.warnings] == [
        "a.xdd:56: [DeviceInfo] BaudRate_250 is there twice: 1 is taken (doubled-key)",
        "a.xdd:25: [2001] AccessType=noAccess is not in CiA 306: rw is taken (access-form)",
        "a.xdd:49: [2003] DataType is missing: DOMAIN is taken (data-type-missing)",
        "a.xdd:49: [2003] AccessType is missing: rw is taken (access-missing)",
        "a.xdd:50: [2004] DataType is missing: DOMAIN is taken (data-type-missing)",
    ]


@pytest.mark.parametrize(
    ("rate", "bit_rate", "warnings"),
    [
        ("500", 500_000, []),
        ("500 kbit/s", 500_000, []),
        ("1 Mbps", 1_000_000, []),
        (
            "500000",
            500_000,
            ["Baudrate=500000 is more than 1000 kbit/s: 500 kbit/s is taken (bit-rate-unit)"],
        ),
        ("auto-baudRate", None, ["Baudrate=auto-baudRate is not a number: 0 is taken (no-number)"]),
    ],
)
def test_a_file_of_canopen_editor_is_read(
    rate: str, bit_rate: int | None, warnings: list[str]
) -> None:
    file = EdsFile("e.xdc", EDITOR.replace("{rate}", rate))
    device = read_device(file)
    rows = [(row.index, row.sub, row.default) for row in device.entries]
    assert rows == [
        *((0x1000, 0, b"\x91\1\0\0"), (0x1018, 0, b"\1"), (0x1018, 1, b"\7\0\0\0")),
    ]
    assert (device.node_id, device.bit_rate) == (17, bit_rate)
    commissioning = file.sections["DeviceComissioning"]
    assert {key: commissioning[key] for key in ("netnumber", "networkname", "canopenmanager")} == {
        **{"netnumber": "2", "networkname": "net", "canopenmanager": "1"},
    }
    assert file.errors == ()
    said = [str(one).partition("] ")[2] for one in file.warnings]
    assert said == [
        "subIndex has more than two digits, taken for one number; others may follow (section-form)",
        "ParameterValue belongs to a sub-index of the RECORD: it is skipped (value-place)",
        *warnings,
    ]


def test_what_is_not_said_of_a_node_is_not_there() -> None:
    text = EDITOR.replace(' actualBaudRate="{rate}"', "").replace(' NodeID="17"', "")
    device, file = read(text)
    assert (device.node_id, device.bit_rate, file.errors) == (None, None, ())
    assert "baudrate" not in file.sections["DeviceComissioning"]


BOMB = '<!DOCTYPE a [<!ENTITY b "bbbb"><!ENTITY c "&b;&b;&b;">]><a>&c;</a>'


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("<a>", "a.xdd:1: is no XML: no element found (xml)"),
        ("\n\n<a></b>", "a.xdd:3: is no XML: mismatched tag (xml)"),
        (BOMB, "a.xdd:1: has a document type, which is refused (xml)"),
        (
            '<!DOCTYPE a SYSTEM "file:///etc/hostname"><a/>',
            "a.xdd:1: has a document type, which is refused (xml)",
        ),
        ("<device/>", "a.xdd:1: is XML of <device>, without a CANopenObjectList (xml)"),
        ("<a>&file;</a>", "a.xdd:1: is no XML: undefined entity (xml)"),
        ("<a>" * 100, "a.xdd:1: is nested deeper than 64 elements (xml)"),
        ("<a>\ud800</a>", "a.xdd: is no XML: it has a character that none has (xml)"),
    ],
)
def test_what_is_no_xdd_is_refused(text: str, error: str) -> None:
    device, file = read(text)
    assert [str(one) for one in file.errors] == [error]
    assert device.entries == ()


@pytest.mark.parametrize("index", ["60G0", "70000", "", "A0"])
def test_an_object_without_an_index_is_an_error_at_its_line(index: str) -> None:
    _, file = read(XDD.replace('index="2001"', f'index="{index}"'))
    (error,) = file.errors
    assert (error.line, error.rule, error.section) == (40, "object-index", index)


def test_a_sub_object_without_a_sub_index_is_an_error_at_its_line() -> None:
    _, file = read(XDD.replace('subIndex="01"', 'subIndex="G1"'))
    assert [str(error) for error in file.errors] == [
        "a.xdd:45: [2002subG1] is no index of four, or sub-index of two hexadecimal digits:"
        " it is lost (object-index)"
    ]


def test_a_list_without_objects_is_no_device() -> None:
    _, file = read("<a><CANopenObjectList/></a>")
    assert [one.rule for one in file.errors] == ["no-objects"]


@pytest.mark.parametrize(
    ("data", "encoding"),
    [
        (b"[FileInfo]", "utf-8"),
        ("\ufeff[".encode(), "utf-8"),
        ("°".encode("cp1252"), "cp1252"),
        ("[F".encode("utf-16"), "utf-16-le"),
        (b"\xfe\xff\0[\0F", "utf-16-be"),
        (b"[\0F\0", "utf-16-le"),
        (b"\0[\0F", "utf-16-be"),
        (b"", "utf-8"),
    ],
)
def test_the_encoding_of_a_file_is_found(data: bytes, encoding: str) -> None:
    assert encoding_of(data) == encoding
    assert decode_text(data).startswith("[F"[: len(decode_text(data))]) or encoding == "cp1252"
