from __future__ import annotations

from pathlib import Path

import pytest

from tests.host.canmon.model.decode.traces import last
from tests.wire.canopen.eds.xdd_text import XDD
from tickrig.host.canmon.model.decode.node_memory import read_eds_objects
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_file import EdsError

EPOS = Path(__file__).parents[5] / "examples" / "eds" / "epos.eds"


def test_an_eds_gives_names_types_and_power_on_values() -> None:
    eds = read_eds_objects(EPOS, 5)
    text = eds.texts[0x6064, 0]
    assert (text.name, text.kind, text.source) == (
        "position_actual_value",
        DataType.INTEGER32,
        "eds",
    )
    assert eds.values[0x1800, 1][:2] == bytes.fromhex("8501")
    assert eds.name == "EPOS"


def test_a_pdo_by_the_mapping_of_an_eds_is_named_and_so_is_its_source() -> None:
    decoded = last("185#3702D2040000", {5: read_eds_objects(EPOS, 5)})
    assert (decoded.kind, decoded.source) == ("tpdo1", "eds")
    assert decoded.signals[0].text == "0x0237[operation enabled]"


def test_an_eds_in_a_windows_code_page_is_read(tmp_path: Path) -> None:
    path = tmp_path / "drive.txt"
    text = EPOS.read_text().replace("ProductName=EPOS", "ProductName=Getriebe für 5 °C")
    path.write_bytes(text.encode("cp1252"))
    assert read_eds_objects(path, 5).name == "Getriebe für 5 °C"


def test_a_cob_id_is_hexadecimal_whoever_names_it() -> None:
    decoded = last("585#4300180185010040", {5: read_eds_objects(EPOS, 5)})
    name = "tpdo1_communication_parameter.cob_id"
    assert decoded.text.startswith(f"upload 1800h:01 {name} = 0x40000185")


def test_units_and_factors_of_an_eds_are_used(tmp_path: Path) -> None:
    path = tmp_path / "unit.eds"
    path.write_text(
        "[FileInfo]\nFileName=unit.eds\n[DeviceInfo]\nProductName=\n[MandatoryObjects]\n"
        "SupportedObjects=1\n1=0x2001\n[2001]\nParameterName=Motor speed\nObjectType=0x7\n"
        "DataType=0x0003\nAccessType=rw\nPDOMapping=1\nFactor=0.1\nUnit=rpm\n"
    )
    eds = read_eds_objects(path, 5)
    assert eds.name == "unit"
    assert last("585#4B01200064000000", {5: eds}).text.startswith(
        "upload 2001h:00 motor_speed = 10rpm"
    )


def test_what_a_file_says_wrongly_of_an_object_is_not_used(tmp_path: Path) -> None:
    path = tmp_path / "odd.eds"
    path.write_text(
        "[DeviceInfo]\nProductName=odd\n[OptionalObjects]\nSupportedObjects=2\n"
        "1=0x2001\n2=0x2002\n"
        "[2001]\nParameterName=Type\nObjectType=0x7\nDataType=0x7777\nAccessType=rw\n"
        "[2002]\nParameterName=Value\nObjectType=0x7\nDataType=0x0005\nAccessType=rw\n"
        "DefaultValue=300\n"
    )
    eds = read_eds_objects(path, 5)
    assert eds.values == {}
    assert [str(one) for one in eds.findings] == [
        f"{path}:17: [2002] DefaultValue=300 is no UNSIGNED8 (default-value)",
        f"{path}:10: [2001] DataType=0x7777 is unknown: DOMAIN is taken (data-type-unknown)",
    ]
    assert last("585#4F01200007000000", {5: eds}).text.startswith("upload 2001h:00 type = 07")


@pytest.mark.parametrize(
    ("text", "findings"),
    [
        ("no EDS at all", [": has no objects (no-objects)"]),
        ("[DeviceInfo]\n", [": has no objects (no-objects)"]),
        ("<a><b></a>", [":1: is no XML: mismatched tag (xml)"]),
    ],
)
def test_a_file_that_is_no_eds_is_refused(tmp_path: Path, text: str, findings: list[str]) -> None:
    path = tmp_path / "bad.eds"
    path.write_text(text)
    with pytest.raises(EdsError) as error:
        read_eds_objects(path, 5)
    assert str(error.value).splitlines() == [f"{path}{finding}" for finding in findings]


def test_a_missing_file_is_an_os_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        read_eds_objects(tmp_path / "none.eds", 5)


def test_an_xdd_is_read_as_an_eds(tmp_path: Path) -> None:
    path = tmp_path / "lamp.xdd"
    path.write_text(XDD, "utf-8")
    eds = read_eds_objects(path, 5)
    assert (eds.name, eds.texts[0x2000, 0].kind) == ("Lamp", DataType.UNSIGNED8)
    assert eds.values[0x1014, 0] == bytes.fromhex("85000000")


def test_an_eds_in_utf_16_is_read(tmp_path: Path) -> None:
    path = tmp_path / "drive.eds"
    path.write_bytes(EPOS.read_text("utf-8").encode("utf-16"))
    assert read_eds_objects(path, 5).name == "EPOS"
