"""Position units of a joint: those of `tickrig:`, of the driver's scale, or of the EDS."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.emulators.canopen.bus_file.system import ONE_JOINT, joints, write_system
from tickrig.emulators.canopen.bus_file.bus_nodes import read_bus


def in_counts(folder: Path) -> None:
    """Give the EDS units of its own: a count of the encoder."""
    sheet = folder / "joint.eds"
    text, gear = sheet.read_text(), "ParameterName={}\nObjectType=9\nSubNumber=3\n"
    entries, names = "", ("Number of entries", "A", "B")
    for index, name in ((0x6091, "Gear ratio"), (0x6092, "Feed constant")):
        entries += f"\n[{index:04X}]\n{gear.format(name)}"
        for sub, part in enumerate(names):
            kind = (
                "DataType=7\nAccessType=rw\nDefaultValue=1\n"
                if sub
                else ("DataType=5\nAccessType=ro\nDefaultValue=2\n")
            )
            entries += f"\n[{index:04X}sub{sub}]\nParameterName={part}\nObjectType=7\n{kind}"
    count = int(re.findall(r"\[OptionalObjects\]\nSupportedObjects=(\d+)", text)[0])
    text = text.replace(f"SupportedObjects={count}\n", f"SupportedObjects={count + 2}\n")
    more = f"{count + 1}=0x6091\n{count + 2}=0x6092\n\n[ManufacturerObjects]"
    sheet.write_text(text.replace("[ManufacturerObjects]", more, 1) + entries)


def test_units_of_an_eds_that_contradict_the_driver_are_told(tmp_path: Path) -> None:
    path = write_system(tmp_path)
    in_counts(tmp_path)
    (remark,) = read_bus(path).remarks
    assert remark.startswith(f"{path}:4: joint_1: scale_pos_to_dev 1000, but joint.eds says ")
    assert " units a rad by its 608Fh, 6091h, 6092h, 60A8h: " in remark
    assert ", 1000 units a rad" not in read_bus(path).nodes[0].about


def test_units_of_ours_count_more_than_those_of_the_eds(tmp_path: Path) -> None:
    path = write_system(tmp_path, f"{ONE_JOINT}  tickrig: {{units: 2000}}\n")
    in_counts(tmp_path)
    bus = read_bus(path)
    assert bus.remarks[0].startswith(f"{path}:7: joint_1: tickrig.units 2000, but joint.eds says ")
    assert bus.remarks[0].endswith(" are changed")
    assert bus.nodes[0].about.endswith(", 2000 units a rad")
    with joints(path, 2) as (bench, [joint]):
        joint.enable(1)
        joint.write(0x607A, 2_000, 4)
        joint.write(0x6040, 0x1F, 2)
        bench.run_for("3s")
        assert bench["joint_1"].get("shaft_deg") == pytest.approx(57.3, abs=0.5)


def test_what_the_master_writes_counts_for_the_units(tmp_path: Path) -> None:
    write = "  sdo: [{index: 0x6092, sub_index: 1, value: 5}]\n"
    path = write_system(tmp_path, f"{ONE_JOINT}{write}  tickrig: {{units: 2000}}\n")
    in_counts(tmp_path)
    assert " after the boot-up) by its 608Fh" in read_bus(path).remarks[0]


def test_the_limit_of_the_speed_is_shown_beside_that_of_the_motor(tmp_path: Path) -> None:
    path = write_system(tmp_path, f"{ONE_JOINT}  tickrig: {{velocity: 3}}\n")
    assert ", 3 rad/s of 4.5, 1000 units a rad" in read_bus(path).nodes[0].about
