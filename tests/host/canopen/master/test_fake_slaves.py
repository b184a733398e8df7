"""What users of ros2_canopen's fake slaves ran into, and what our slaves do there.

The numbers are those of its issues and pull requests.
"""

from __future__ import annotations

import itertools
from pathlib import Path

import pytest

from tests.host.canopen.master.joints import Cell, cell
from tickrig.wire.canopen.drive import DriveState

RPM_S = 2_000
SPEED = 1_500
PROFILE = (
    "  sdo:\n"
    "    - {index: 0x6098, value: 35}\n"
    f"    - {{index: 0x6081, value: {SPEED}}}\n"
    f"    - {{index: 0x6083, value: {RPM_S}}}\n"
    f"    - {{index: 0x6084, value: {RPM_S}}}\n"
)
COUNTS_PER_TURN = 2_000
"""Of the motor of our drive: 500 pulses of an encoder, each edge counted."""


def ready(drives: Cell, mode: str) -> None:
    drives.master.perform(drives.joint.init())
    drives.master.perform(drives.joint.choose(mode))


def speeds(drives: Cell, duration_ms: int) -> list[float]:
    """The velocity each 10 ms, rpm."""
    found = []
    for _ in range(duration_ms // 10):
        drives.master.run_for("10ms")
        found.append(drives.joint.velocity * 1_000)
    return found


@pytest.mark.parametrize("mode", ["pv", "csv"])
def test_195_a_joint_turns_in_the_velocity_modes(tmp_path: Path, mode: str) -> None:
    """#195: only position modes could be had of the fake slaves."""
    with cell(tmp_path, PROFILE) as drives:
        ready(drives, mode)
        drives.joint.set_target(0.4)
        drives.master.run_for("500ms")
        before = drives.joint.position
        drives.master.run_for("600ms")
        turned = (drives.joint.position - before) * 1_000 / COUNTS_PER_TURN
        assert turned == pytest.approx(400 * 0.6 / 60, rel=0.02)


def test_227_homing_moves_the_joint_to_its_switch(tmp_path: Path) -> None:
    """#227 and its neighbours: homing said attained after a moment, and nothing had moved."""
    method_18 = PROFILE.replace("value: 35", "value: 18")
    with cell(tmp_path, method_18) as drives:
        bench = drives.bench["joint2"]
        bench.set("positive_limit_at", 30.0)
        drives.master.perform(drives.joint.init())
        assert float(bench.get("shaft_deg")) == pytest.approx(30.0, abs=0.5)
        assert drives.joint.position == pytest.approx(0.0, abs=0.005)
        attained = [line for line in drives.heard() if line.startswith("182#")]
        words = [int.from_bytes(bytes.fromhex(line[4:8]), "little") for line in attained]
        under_way = [word & 0x3400 == 0 for word in words]
        assert sum(under_way) > 20  # it took its way, bit by bit told


def test_230_the_actual_velocity_is_that_of_the_shaft(tmp_path: Path) -> None:
    """#230: pv came late to the fake slaves, and only mirrors the target in 606Ch."""
    with cell(tmp_path, PROFILE) as drives:
        ready(drives, "pv")
        drives.bench["joint2"].set("load_nm", -1.0)
        drives.joint.set_target(0.3)
        drives.master.run_for("500ms")
        assert drives.joint.effort > 0.05  # it works against a load
        drives.bench["joint2"].set("shaft_blocked", 1)
        drives.master.run_for("300ms")
        assert abs(drives.joint.velocity) < 0.01  # and tells what is, not what shall be
        assert drives.joint.controlword == 0x000F


def test_337_profile_velocity_has_its_acceleration(tmp_path: Path) -> None:
    """#337: in pv the velocity jumped to its target, without a ramp."""
    with cell(tmp_path, PROFILE) as drives:
        ready(drives, "pv")
        drives.joint.set_target(0.6)
        seen = [value for value in speeds(drives, 400) if 50 < value < 550]
        steps = [after - before for before, after in itertools.pairwise(seen)]
        assert len(steps) > 15
        assert sum(steps) / len(steps) == pytest.approx(RPM_S * 0.01, rel=0.05)


def test_345_the_set_point_is_acknowledged_each_time(tmp_path: Path) -> None:
    """#345: bit 12 was not told as the handshake of pp needs it, and targets were ignored."""
    with cell(tmp_path, PROFILE) as drives:
        ready(drives, "pp")
        for target in (0.5, 1.0, 0.2):
            drives.joint.set_target(target)
            assert drives.master.wait_until(lambda: drives.joint.statusword & 0x1000 != 0, "100ms")
            assert drives.master.wait_until(lambda: drives.joint.statusword & 0x1000 == 0, "100ms")
            reached = drives.master.wait_until(lambda: drives.joint.statusword & 0x0400 != 0, "2s")
            assert reached
            assert drives.joint.position == pytest.approx(target, abs=0.01)
        assert drives.joint.state is DriveState.OPERATION_ENABLED


def test_442_profile_position_has_its_velocity_and_its_acceleration(tmp_path: Path) -> None:
    """#442: velocity and acceleration of the profile were taken one for the other."""
    way = 100.0  # thousands of counts: 50 turns
    with cell(tmp_path, PROFILE) as drives:
        ready(drives, "pp")
        start_us = drives.master.now_us
        drives.joint.set_target(way)
        moving = speeds(drives, 1_500)
        assert max(moving) == pytest.approx(SPEED, rel=0.02)
        rising = [value for value in moving if 100 < value < 1_400]
        steps = [after - before for before, after in itertools.pairwise(rising)]
        assert sum(steps) / len(steps) == pytest.approx(RPM_S * 0.01, rel=0.05)
        assert drives.master.wait_until(lambda: abs(drives.joint.position - way) < 0.01, "5s")
        took_s = (drives.master.now_us - start_us) / 1e6
        turns, speed, ramp = way * 1_000 / COUNTS_PER_TURN, SPEED / 60, RPM_S / 60
        assert took_s == pytest.approx(turns / speed + speed / ramp, abs=0.1)
        drives.master.run_for("100ms")
        assert abs(drives.joint.velocity) < 0.01
