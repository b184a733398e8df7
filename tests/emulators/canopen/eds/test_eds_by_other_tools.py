"""What tools of other projects say of the EDS files that are written here."""

from __future__ import annotations

from pathlib import Path

import pytest
from dcf.device import Device
from dcf.lint import lint
from dcf.parse import parse_file

from tests.device.canopen.reference import make_dictionary
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.emulators.canopen.build import describe_rtc
from tickrig.emulators.canopen.models import MODELS
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_file import EdsFile
from tickrig.wire.canopen.eds.eds_writer import write_dcf, write_eds
from tickrig.wire.canopen.eds.object_table import Access, DeviceInfo, EntryDescription

ROOT = Path(__file__).parents[4]
SHIPPED = (*(ROOT / "examples").rglob("*.eds"), *(ROOT / "tests" / "golden").rglob("*.eds"))
GRIPPER = f"{ROOT}/examples/device_rtc_gripper.py:Gripper"
NODE_ID = 5
RW = Access.READ | Access.WRITE

WANTED = {
    "FileInfo": (
        *("FileName", "FileVersion", "FileRevision", "EDSVersion", "Description"),
        *("CreationTime", "CreationDate", "CreatedBy"),
        *("ModificationTime", "ModificationDate", "ModifiedBy"),
    ),
    "DeviceInfo": (
        *("VendorName", "VendorNumber", "ProductName", "ProductNumber", "RevisionNumber"),
        *("OrderCode", "SimpleBootUpMaster", "SimpleBootUpSlave", "Granularity"),
        *("DynamicChannelsSupported", "NrOfRXPDO", "NrOfTXPDO", "LSS_Supported"),
    ),
}
"""What eds-validate (eds-utils) wants; it is run by hand, see CONTRIBUTING."""


def check(path: Path) -> None:
    """Do what `dcfchk -n 5` does; its warnings are errors here."""
    found = parse_file(str(path))
    assert lint(found)
    Device(found, {"NODEID": NODE_ID})


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_dcfchk_has_nothing_to_say_of_what_is_shipped(path: Path) -> None:
    check(path)


def test_dcfchk_has_nothing_to_say_of_a_component_or_a_dcf(tmp_path: Path) -> None:
    path, component = tmp_path / "gripper.eds", describe_rtc(GRIPPER)
    path.write_text(write_eds(component.template.description, component.info), "utf-8")
    check(path)
    for name, model in MODELS.items():
        path = tmp_path / f"{name}.dcf"
        path.write_text(write_dcf(model.dictionary().description, NODE_ID, 500_000, {}), "utf-8")
        check(path)


def test_dcfchk_reads_floats_with_their_limits(tmp_path: Path) -> None:
    path = tmp_path / "floats.eds"
    kinds = (DataType.REAL32, DataType.REAL64)
    rows = [*make_dictionary().description] + [
        EntryDescription(0x5000 + number, 0, "x", kind, RW, default=-1.5, low=-2.5, high=3.0e8)
        for number, kind in enumerate(kinds)
    ]
    table = Dictionary(rows).description
    path.write_text(write_eds(table, DeviceInfo(product_name="floats")), "utf-8")
    check(path)


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_what_eds_validate_wants_is_there(path: Path) -> None:
    file = EdsFile(path.name, path.read_text("utf-8"))
    for section, keys in WANTED.items():
        assert [key for key in keys if not file.has(section, key)] == []
    assert file.number("ManufacturerObjects", "SupportedObjects") > 0
    assert all("sub" in one or "CompactSubObj" not in file.sections[one] for one in file.sections)
