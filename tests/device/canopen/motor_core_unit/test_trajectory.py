from __future__ import annotations

from math import sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.device.canopen.models.motor_core_motion import (
    CHANGE_UDEG_S,
    CONTROL_US,
    DEGREE,
    MAX_VELOCITY_UDEG_S,
    Trajectory,
)

ACCELERATION_DEG_S2 = 3_600.0
TICK_S = CONTROL_US / 1e6

positions = st.integers(-1_000 * DEGREE, 1_000 * DEGREE)
velocities = st.integers(-MAX_VELOCITY_UDEG_S, MAX_VELOCITY_UDEG_S)


def ticks_to(motion: Trajectory, target_ndeg: int, limit_udeg_s: int = MAX_VELOCITY_UDEG_S) -> int:
    """Approach until the motion stands at the target; return how many control ticks it took."""
    ticks = 0
    while (motion.position_ndeg, motion.velocity_udeg_s) != (target_ndeg, 0):
        motion.approach(target_ndeg, limit_udeg_s)
        ticks += 1
        assert ticks < 10_000_000
    return ticks


def trapezoid_s(distance_deg: float, velocity_deg_s: float) -> float:
    """Return how long the closed form takes from standstill to standstill."""
    ramp_deg = velocity_deg_s**2 / ACCELERATION_DEG_S2
    if distance_deg < ramp_deg:
        return 2 * sqrt(distance_deg / ACCELERATION_DEG_S2)
    return distance_deg / velocity_deg_s + velocity_deg_s / ACCELERATION_DEG_S2


@pytest.mark.parametrize(("target_deg", "ticks"), [(90, 35), (36, 20), (18, 15), (0.36, 2), (1, 4)])
def test_an_approach_takes_as_many_ticks_as_the_trapezoid(target_deg: float, ticks: int) -> None:
    assert ticks_to(Trajectory(), round(target_deg * DEGREE)) == ticks


@given(st.integers(1, 720 * DEGREE), st.integers(10_000_000, MAX_VELOCITY_UDEG_S))
def test_an_approach_takes_two_ticks_more_than_the_closed_form_at_most(
    distance_ndeg: int, limit_udeg_s: int
) -> None:
    took_s = ticks_to(Trajectory(), distance_ndeg, limit_udeg_s) * TICK_S
    closed_s = trapezoid_s(distance_ndeg / DEGREE, limit_udeg_s / 1e6)
    assert closed_s - 1e-4 <= took_s <= closed_s + 2 * TICK_S


@given(positions, velocities, positions)
def test_an_approach_from_any_motion_keeps_the_limits_and_ends_exactly(
    start_ndeg: int, velocity_udeg_s: int, target_ndeg: int
) -> None:
    motion = Trajectory()
    motion.place(start_ndeg, velocity_udeg_s)
    while (motion.position_ndeg, motion.velocity_udeg_s) != (target_ndeg, 0):
        before = motion.velocity_udeg_s
        motion.approach(target_ndeg, MAX_VELOCITY_UDEG_S)
        assert abs(motion.velocity_udeg_s - before) <= CHANGE_UDEG_S
        assert abs(motion.velocity_udeg_s) <= MAX_VELOCITY_UDEG_S


@given(st.integers(0, 720 * DEGREE))
def test_an_approach_from_standstill_never_passes_the_target(target_ndeg: int) -> None:
    motion = Trajectory()
    while (motion.position_ndeg, motion.velocity_udeg_s) != (target_ndeg, 0):
        motion.approach(target_ndeg, MAX_VELOCITY_UDEG_S)
        assert 0 <= motion.position_ndeg <= target_ndeg


def test_both_directions_are_alike() -> None:
    there, back = Trajectory(), Trajectory()
    for _ in range(50):
        there.approach(77 * DEGREE, MAX_VELOCITY_UDEG_S)
        back.approach(-77 * DEGREE, MAX_VELOCITY_UDEG_S)
        assert (there.position_ndeg, there.velocity_udeg_s) == (
            -back.position_ndeg,
            -back.velocity_udeg_s,
        )


def test_a_lower_limit_in_the_middle_brakes_with_the_full_deceleration() -> None:
    motion = Trajectory()
    motion.place(0, MAX_VELOCITY_UDEG_S)
    motion.approach(720 * DEGREE, 90_000_000)
    assert motion.velocity_udeg_s == MAX_VELOCITY_UDEG_S - CHANGE_UDEG_S


@given(velocities, velocities)
def test_within_a_tick_the_motion_has_no_jump(begin_udeg_s: int, wanted_udeg_s: int) -> None:
    motion = Trajectory()
    motion.place(5 * DEGREE, begin_udeg_s)
    motion.run(wanted_udeg_s)
    assert motion.at(0)[:2] == (5.0, begin_udeg_s / 1e6)
    position_deg, velocity_deg_s, _ = motion.at(CONTROL_US)
    assert position_deg == pytest.approx(motion.position_ndeg / DEGREE, abs=1e-9)
    assert velocity_deg_s == pytest.approx(motion.velocity_udeg_s / 1e6, abs=1e-9)


def test_a_velocity_is_reached_by_a_ramp() -> None:
    motion, seen = Trajectory(), []
    for _ in range(4):
        motion.run(-100_000_000)
        seen.append(motion.velocity_udeg_s // 1_000_000)
    assert seen == [-36, -72, -100, -100]
