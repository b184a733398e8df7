"""What fake slaves cannot do, and a node of a bus.yml does."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.emulators.canopen.bus_file.system import ONE_JOINT, Joint, joints, write_system
from tickrig import Bench

SPEED = 1_000
"""Profile velocity: 1 rad/s."""


def moving(joint: Joint) -> None:
    """Begin a long way in pp, and be in the middle of it."""
    for index, value in ((0x6081, SPEED), (0x6083, 10_000), (0x6084, 10_000), (0x6085, 10_000)):
        joint.write(index, value, 4)
    joint.enable(1)
    joint.write(0x607A, 50_000, 4)
    joint.write(0x6040, 0x1F, 2)
    joint.bench.run_for("300ms")


def speed(joint: Joint) -> float:
    return float(joint.bench.get("shaft_deg_s"))


def test_a_target_without_bit_4_moves_nothing(tmp_path: Path) -> None:
    with joints(write_system(tmp_path), 2) as (bench, [joint]):
        joint.enable(1)
        joint.write(0x607A, 500, 4)
        bench.run_for("500ms")
        assert bench.get("shaft_deg") == 0
        assert not joint.statusword & 0x1000


@pytest.mark.parametrize(
    ("controlword", "state"),
    [
        (0x10F | 0x10, "Operation enabled"),
        (0x02, "Switch on disabled"),
        (0x07, "Switched on"),
        (0x06, "Ready to switch on"),
    ],
    ids=["halt", "quick stop", "disable operation", "shutdown"],
)
def test_halt_quick_stop_and_disabling_end_a_motion(
    tmp_path: Path, controlword: int, state: str
) -> None:
    with joints(write_system(tmp_path), 2) as (bench, [joint]):
        moving(joint)
        assert speed(joint) == pytest.approx(57.3, rel=0.05)
        joint.write(0x6040, controlword, 2)
        bench.run_for("500ms")
        assert abs(speed(joint)) < 0.1
        assert bench.get("drive_state") == state


def test_csp_follows_each_target_to_the_unit(tmp_path: Path) -> None:
    with joints(write_system(tmp_path), 2) as (bench, [joint]):
        joint.write(0x60C2, 10, 1, sub=1)
        joint.write(0x60C2, -3, 1, sub=2)
        joint.enable(8)
        for target in (3, 10, 7, 45, 44):
            joint.write(0x607A, target, 4)
            bench.run_for("300ms")
            assert joint.read(0x6064, signed=True) == pytest.approx(target, abs=1)


def test_a_new_target_of_csp_counts_before_the_last_is_reached(tmp_path: Path) -> None:
    with joints(write_system(tmp_path), 2) as (bench, [joint]):
        joint.write(0x60C2, 200, 1, sub=1)
        joint.write(0x60C2, -3, 1, sub=2)
        joint.enable(8)
        joint.write(0x607A, 200, 4)
        bench.run_for("50ms")
        joint.write(0x607A, 0, 4)
        bench.run_for("400ms")
        assert abs(joint.read(0x6064, signed=True)) <= 1


def test_a_fault_is_told_by_emcy_until_it_is_reset(tmp_path: Path) -> None:
    with joints(write_system(tmp_path), 2) as (bench, [joint]):
        joint.enable(3)
        for cause, code in (("encoder_unplugged", 0x7305), ("short_circuit", 0x2310)):
            bench.fault(cause)
            assert bench.wait_until(bench.on_line(f"082#{code & 0xFF:02X}{code >> 8:02X}*"), "1s")
            assert joint.statusword & 0x4F == 0x08
            bench.clear(cause)
            bench.run_for("2ms")
            joint.write(0x6040, 0x80, 2)
            bench.run_for("5ms")
            assert bench.get("drive_state") == "Switch on disabled"
            joint.enable(3)


def test_a_cut_supply_and_its_return_are_a_boot_up(tmp_path: Path) -> None:
    with joints(write_system(tmp_path), 2) as (bench, [joint]):
        moving(joint)
        bench.fault("power_off")
        bench.run_for("2s")
        assert bench.get("state") == "Off"
        assert abs(speed(joint)) < 0.1
        bench.clear("power_off")
        assert bench.wait_until(bench.on_line("702#00"), "100ms")


def test_two_runs_of_a_system_are_the_same_to_the_byte(tmp_path: Path) -> None:
    path, found = write_system(tmp_path), []
    for _ in range(2):
        with joints(path, 2) as (bench, [joint]):
            moving(joint)
            bench.set("load_nm", -2.0)
            bench.run_for("100ms")
            found.append((bench.transcript(), bench.get("shaft_deg"), bench.get("current_a")))
    assert found[0] == found[1]
    assert len(found[0][0].splitlines()) > 20


def twin_of(bench: Bench) -> float:
    bench.run_for("100ms")
    return float(bench.get("shaft_deg"))


def test_a_bench_of_a_bus_can_be_forked(tmp_path: Path) -> None:
    with joints(write_system(tmp_path, f"{ONE_JOINT}  tickrig: {{upper: 3}}\n"), 2) as (
        bench,
        [one],
    ):
        moving(one)
        with bench.fork() as twin:
            assert twin_of(twin) == twin_of(bench)
