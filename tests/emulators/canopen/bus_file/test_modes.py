"""All modes of operation move a joint of a bus.yml, with the physics of its motor."""

from __future__ import annotations

from collections.abc import Callable
from math import degrees
from pathlib import Path

import pytest
from canopen import SdoAbortedError

from tests.emulators.canopen.bus_file.system import ONE_JOINT, Joint, joints, write_system

ALL_MODES = f"{ONE_JOINT}  tickrig: {{modes: all}}\n"
TORQUE_LIMIT = 100
"""Per mille of the rated torque."""


def profile_position(joint: Joint) -> None:
    joint.write(0x607A, 1_000, 4)
    joint.write(0x6040, 0x1F, 2)


def profile_velocity(joint: Joint) -> None:
    joint.write(0x60FF, 500, 4)


def torque(joint: Joint) -> None:
    joint.write(0x6071, TORQUE_LIMIT, 2)


def interpolated_position(joint: Joint) -> None:
    joint.write(0x6040, 0x1F, 2)
    for step in range(50):
        joint.write(0x60C1, 10 * step, 4, sub=1)
        joint.bench.run_for("20ms")


def cyclic_position(joint: Joint) -> None:
    for step in range(50):
        joint.write(0x607A, 10 * step, 4)
        joint.bench.run_for("20ms")


MODES: dict[str, tuple[int, Callable[[Joint], None], float]] = {
    "pp": (1, profile_position, degrees(1.0)),
    "pv": (3, profile_velocity, degrees(0.5)),
    "ip": (7, interpolated_position, degrees(0.49)),
    "csp": (8, cyclic_position, degrees(0.49)),
    "csv": (9, profile_velocity, degrees(0.5)),
}


@pytest.mark.parametrize(("mode", "drive", "angle_deg"), MODES.values(), ids=MODES)
def test_each_mode_turns_the_shaft_by_what_ros_believes(
    tmp_path: Path, mode: int, drive: Callable[[Joint], None], angle_deg: float
) -> None:
    """A thousand units are a radian, unless the file says otherwise."""
    with joints(write_system(tmp_path, ALL_MODES), 2) as (bench, [joint]):
        joint.enable(mode)
        before_us = bench.now_us
        drive(joint)
        while bench.now_us < before_us + 1_000_000:
            bench.run_for("1ms")
        assert bench.get("drive_state") == "Operation enabled"
        assert bench.get("shaft_deg") == pytest.approx(angle_deg, abs=3.0)
        position = joint.read(0x6064, signed=True)
        assert bench.get("shaft_deg") == pytest.approx(degrees(position / 1_000), abs=0.5)


@pytest.mark.parametrize("mode", [4, 10], ids=["tq", "cst"])
def test_torque_accelerates_the_shaft_and_a_load_slows_it(tmp_path: Path, mode: int) -> None:
    speeds = []
    for load_nm in (0.0, -0.3):
        with joints(write_system(tmp_path, ALL_MODES), 2) as (bench, [joint]):
            bench.set("load_nm", load_nm)
            joint.enable(mode)
            torque(joint)
            bench.run_for("100ms")
            speeds.append(float(bench.get("shaft_deg_s")))
    free, loaded = speeds
    assert free > 1.5 * loaded > 0


def test_homing_finds_the_switch_that_the_shaft_presses(tmp_path: Path) -> None:
    text = f"{ONE_JOINT}  tickrig: {{lower: -0.2}}\n"
    with joints(write_system(tmp_path, text), 2) as (bench, [joint]):
        joint.write(0x6098, 17, 1)
        joint.enable(6)
        joint.write(0x6040, 0x1F, 2)
        assert bench.wait_until(lambda: joint.statusword & 0x1400 == 0x1400, within="5s")
        assert bench.get("shaft_deg") == pytest.approx(degrees(-0.2), abs=0.1)
        assert abs(joint.read(0x6064, signed=True)) <= 2


def test_a_mode_that_its_eds_does_not_list_is_refused_as_the_drive_would(tmp_path: Path) -> None:
    with joints(write_system(tmp_path), 2) as (_, [joint]):
        with pytest.raises(SdoAbortedError, match="0x06090030"):
            joint.enable(10)
        assert joint.read(0x6502) == 0xA5


def test_a_mode_that_the_file_writes_is_there(tmp_path: Path) -> None:
    text = f"{ONE_JOINT}  sdo:\n    - {{index: 0x6060, sub_index: 0, value: 7}}\n"
    with joints(write_system(tmp_path, text), 2) as (_, [joint]):
        assert joint.read(0x6502) == 0xE5
        joint.enable(7)
        assert joint.read(0x6061) == 7
        joint.write(0x60C1, 5, 4, sub=1)


def test_values_that_the_eds_leaves_out_let_the_joint_move(tmp_path: Path) -> None:
    """An empty DefaultValue is no 0: a drive that brakes with 1 unit a second never stops."""
    with joints(write_system(tmp_path), 2) as (bench, [joint]):
        joint.enable(1)
        profile_position(joint)
        assert bench.wait_until(lambda: bool(joint.statusword & 0x0400), within="2s")
        assert joint.read(0x6064, signed=True) == pytest.approx(1_000, abs=3)
        assert joint.read(0x6084) > 1_000


def test_units_and_limits_follow_the_keys_of_a_node(tmp_path: Path) -> None:
    text = f"{ONE_JOINT}  scale_pos_to_dev: 5000\n  tickrig: {{velocity: 0.5}}\n"
    with joints(write_system(tmp_path, text), 2) as (bench, [joint]):
        joint.enable(3)
        joint.write(0x60FF, 50_000, 4)
        bench.run_for("1s")
        assert bench.get("shaft_deg_s") == pytest.approx(degrees(0.5), rel=0.02)
        assert joint.read(0x606C, signed=True) == pytest.approx(2_500, rel=0.02)
        assert joint.statusword & 0x0800


def test_a_carriage_moves_by_metres(tmp_path: Path) -> None:
    text = f"{ONE_JOINT}  tickrig: {{travel_m: 0.02, units: 100000, effort: 500, velocity: 0.2}}\n"
    with joints(write_system(tmp_path, text), 2) as (bench, [joint]):
        joint.enable(1)
        joint.write(0x607A, 5_000, 4)
        joint.write(0x6040, 0x1F, 2)
        assert bench.wait_until(lambda: bool(joint.statusword & 0x0400), within="5s")
        assert bench.get("shaft_deg") == pytest.approx(0.05 / 0.02 * 360, abs=0.5)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("DefaultValue=\n", "DefaultValue=0x0\n"),
        ("DataType=0x0007\nAccessType=rw\n", "DataType=0x0004\nAccessType=rw\n"),
        ("AccessType=rw\n", "AccessType=rw\nLowLimit=1\nHighLimit=500000\n"),
    ],
    ids=["zeros", "signed", "limits"],
)
def test_files_of_other_drives_leave_values_open_too(tmp_path: Path, old: str, new: str) -> None:
    """Seen in files of makers: zeros where none can be, INTEGER32 for 6065h, limits."""
    path = write_system(tmp_path)
    sheet = tmp_path / "joint.eds"
    head, objects = sheet.read_text().split("[6040]")
    sheet.write_text(f"{head}[6040]{objects.replace(old, new)}")
    with joints(path, 2) as (bench, [joint]):
        joint.enable(1)
        profile_position(joint)
        assert bench.wait_until(lambda: bool(joint.statusword & 0x0400), within="5s")
        assert bench.get("shaft_deg") == pytest.approx(degrees(1.0), abs=1.0)
