from __future__ import annotations

from itertools import pairwise
from math import pi, sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.device.canopen.ds402.trapezoid import (
    Motion,
    Path,
    PathLimits,
    RampShape,
    to_position,
    to_velocity,
)

TICK_US = 1_000
REST = Motion(0.0)

POSITIONS = st.integers(-(2**31), 2**31 - 1).map(float)
VELOCITIES = st.integers(-100_000, 100_000).map(float)
LIMITS = st.builds(
    PathLimits,
    st.integers(1, 200_000).map(float),
    st.integers(1, 10_000_000).map(float),
    st.integers(1, 10_000_000).map(float),
    st.sampled_from(RampShape),
)


def trapezoid(distance: float, limits: PathLimits, now_s: float) -> tuple[float, float]:
    """Return position and velocity of a way from rest to rest, by the school's formulas."""
    up, down = limits.acceleration, limits.deceleration
    top = min(limits.velocity, sqrt(2 * distance * up * down / (up + down)))
    up_s, down_s = top / up, top / down
    along_s = (distance - top * (up_s + down_s) / 2) / top
    end_s = up_s + along_s + down_s
    if now_s <= up_s:
        return up * now_s**2 / 2, up * now_s
    if now_s <= up_s + along_s:
        return top * (now_s - up_s / 2), top
    left_s = max(0.0, end_s - now_s)
    return distance - down * left_s**2 / 2, down * left_s


def arrival_us(path: Path) -> int:
    now_us = path.began_us
    while not path.ended(now_us):
        now_us += TICK_US
    return now_us - path.began_us


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    ("distance", "limits"),
    [
        (54_000.0, PathLimits(72_000.0, 720_000.0, 720_000.0)),
        (1_000.0, PathLimits(10_000.0, 10_000.0, 10_000.0)),
        (1_000.0, PathLimits(100_000.0, 10_000.0, 40_000.0)),
        (100_000.0, PathLimits(20_000.0, 50_000.0, 5_000.0)),
        (1.0, PathLimits(20_000.0, 50_000.0, 5_000.0)),
    ],
)
@pytest.mark.parametrize("direction", [1, -1])
def test_a_way_from_rest_is_the_trapezoid_or_triangle_of_the_formulas(
    distance: float, limits: PathLimits, direction: int
) -> None:
    path = to_position(7_000, REST, direction * distance, limits)
    for now_us in range(0, int(path.end_s * 1e6) + 5_000, TICK_US):
        position, velocity = trapezoid(distance, limits, now_us / 1e6)
        motion = path.at(now_us + 7_000)
        assert motion.position * direction == pytest.approx(position, abs=1e-6)
        assert motion.velocity * direction == pytest.approx(velocity, abs=1e-6)


@pytest.mark.parametrize(
    ("distance", "limits", "expected_us"),
    [
        (
            360.0,
            PathLimits(360.0, 3_600.0, 3_600.0),
            1_100_000,
        ),  # 0.1 s up, 0.9 s on, 0.1 s down
        (90.0, PathLimits(360.0, 3_600.0, 3_600.0), 350_000),  # the report's Fig. 120
        (100.0, PathLimits(1_000.0, 100.0, 100.0), 2_000_000),  # 1 s up, 1 s down
        (150.0, PathLimits(100.0, 100.0, 50.0), 3_000_000),  # 1 s up, 2 s down
        (0.0, PathLimits(1.0, 1.0, 1.0), 0),
    ],
)
def test_it_arrives_in_the_tick_of_the_formulas(
    distance: float, limits: PathLimits, expected_us: int
) -> None:
    path = to_position(0, REST, distance, limits)
    assert abs(arrival_us(path) - expected_us) <= TICK_US
    assert path.at(expected_us + TICK_US) == Motion(distance)


def test_a_sin2_ramp_peaks_at_the_acceleration_and_takes_half_pi_as_long() -> None:
    path = to_velocity(0, REST, 1_000.0, PathLimits(1.0, 10_000.0, 10_000.0, RampShape.SIN2))
    assert path.end_s == pytest.approx(0.1 * pi / 2)
    middle = path.at(round(path.end_s * 1e6 / 2))
    assert middle.velocity == pytest.approx(500.0, rel=1e-4)
    assert middle.acceleration == pytest.approx(10_000.0, rel=1e-4)
    assert path.at(0).acceleration == 0.0


def test_sin2_ramps_start_and_end_without_a_jolt() -> None:
    limits = PathLimits(1_000.0, 10_000.0, 5_000.0, RampShape.SIN2)
    path = to_position(0, REST, 1_000.0, limits)
    seen = [path.at(now_us).acceleration for now_us in range(0, arrival_us(path), TICK_US)]
    jolts = [abs(after - before) for before, after in pairwise(seen)]
    assert max(seen) == pytest.approx(10_000.0, rel=1e-3)
    assert min(seen) == pytest.approx(-5_000.0, rel=1e-3)
    assert max(jolts) < 10_000.0 * pi / (0.1 * pi / 2) * 0.001 * 1.01


@pytest.mark.parametrize("shape", RampShape)
def test_a_change_of_direction_brakes_and_then_accelerates(shape: RampShape) -> None:
    path = to_velocity(0, Motion(0.0, -100.0), 200.0, PathLimits(1.0, 100.0, 50.0, shape))
    assert path.end_s == pytest.approx((2 + 2) * (1 if shape is RampShape.LINEAR else pi / 2))
    halfway = path.at(round(path.end_s * 5e5))
    assert halfway.velocity == pytest.approx(0.0, abs=1e-6)
    assert path.end == pytest.approx((100.0 * path.end_s / 4, 200.0, 0.0))


def test_after_its_end_a_path_goes_on_with_its_last_velocity() -> None:
    path = to_velocity(0, REST, 100.0, PathLimits(100.0, 100.0, 100.0))
    assert path.at(3_000_000) == Motion(250.0, 100.0)


def test_an_end_velocity_is_reached_at_the_target() -> None:
    path = to_position(0, REST, -100.0, PathLimits(50.0, 100.0, 100.0), 20.0)
    assert path.end == Motion(-100.0, -20.0)
    assert path.at(round(path.end_s * 1e6) - 1).velocity == pytest.approx(-20.0, abs=0.01)


@pytest.mark.parametrize(
    ("velocity", "wanted", "reached"),
    [
        (0.0, 1_000.0, sqrt(2 * 100 * 10)),  # too short to get fast
        (100.0, 5.0, sqrt(100**2 - 2 * 200 * 10)),  # too short to get slow: passes the target
        (100.0, 500.0, 60.0),  # never more than the velocity limit
    ],
)
def test_an_end_velocity_out_of_reach_is_approached(
    velocity: float, wanted: float, reached: float
) -> None:
    distance = 10.0 if wanted != 500.0 else 100.0
    limits = PathLimits(60.0, 100.0, 200.0)
    path = to_position(0, Motion(0.0, velocity), distance, limits, wanted)
    assert path.end == pytest.approx((distance, reached, 0.0))


@pytest.mark.parametrize(
    ("start", "target", "turning"),
    [
        (Motion(0.0, 100.0), 10.0, 50.0),  # too fast to stop at the target
        (Motion(0.0, 100.0), -10.0, 50.0),  # moves away from it
        (Motion(0.0, 100.0), 0.0, 50.0),  # is there, but moves
        (Motion(0.0, -100.0), -10.0, -50.0),
    ],
)
def test_what_cannot_stop_at_the_target_comes_back(
    start: Motion, target: float, turning: float
) -> None:
    path = to_position(0, start, target, PathLimits(100.0, 100.0, 100.0))
    assert path.at(1_000_000)[:2] == pytest.approx((turning, 0.0))
    assert path.end == Motion(target)


@pytest.mark.parametrize(("velocity", "deceleration"), [(1.0, 49.0), (5.0, 97.0), (-7.0, 11.0)])
def test_what_can_just_stop_at_the_target_stands_there(
    velocity: float, deceleration: float
) -> None:
    target = velocity * abs(velocity) / (2 * deceleration)  # rounded: times 2 a it is below v^2
    limits = PathLimits(100.0, 100.0, deceleration)
    assert to_position(0, Motion(0.0, velocity), target, limits).end == Motion(target)


def test_what_is_too_fast_brakes_to_the_limit_first() -> None:
    path = to_position(0, Motion(0.0, 100.0), 1_000.0, PathLimits(50.0, 100.0, 100.0))
    assert path.at(500_000)[:2] == pytest.approx((37.5, 50.0))
    assert path.at(5_000_000).velocity == 50.0


@pytest.mark.unmeasured
@given(POSITIONS, VELOCITIES, POSITIONS, LIMITS, st.integers(0, 100_000))
def test_a_path_ends_on_its_target(
    position: float, velocity: float, target: float, limits: PathLimits, end: int
) -> None:
    path = to_position(0, Motion(position, velocity), target, limits, float(end))
    assert path.end.position == target
    assert (path.end.velocity == 0.0) == (end == 0 or (position == target and velocity == 0.0))
    last = path.at(max(0, int(path.end_s * 1e6) - 1))
    speed = max(abs(velocity), limits.velocity)
    assert last.position == pytest.approx(target, abs=2e-6 * speed + 1e-4)


@pytest.mark.unmeasured
@given(
    st.lists(
        st.tuples(st.integers(-10_000, 10_000).map(float), LIMITS, st.integers(0, 40)),
        min_size=1,
        max_size=6,
    ),
    VELOCITIES,
)
def test_no_step_breaks_a_limit_however_targets_and_limits_change(
    moves: list[tuple[float, PathLimits, int]], velocity: float
) -> None:
    motion, now_us = Motion(0.0, velocity), 0
    for target, limits, ticks in moves:
        path = to_position(now_us, motion, target, limits)
        for _ in range(ticks):
            now_us += TICK_US
            before, motion = motion, path.at(now_us)
            judge(before, motion, limits)
    assert path.end == Motion(target)


def judge(before: Motion, after: Motion, limits: PathLimits) -> None:
    """Compare two motions a tick apart; tolerance 1e-6 of the largest numbers about."""
    fastest = max(limits.velocity, abs(before.velocity)) * (1 + 1e-6)
    steepest = max(limits.acceleration, limits.deceleration) * (1 + 1e-6)
    assert abs(after.velocity) <= fastest
    assert abs(after.velocity - before.velocity) <= steepest * 1e-3 + 1e-6
    assert abs(after.position - before.position) <= fastest * 1e-3 + 1e-6
    if before.velocity * after.velocity > 0 and abs(after.velocity) > abs(before.velocity):
        up = limits.acceleration * (1 + 1e-6) * 1e-3
        assert abs(after.velocity) - abs(before.velocity) <= up + 1e-6


@given(POSITIONS, VELOCITIES, LIMITS, st.lists(st.integers(1, 60_000_000), max_size=20))
def test_between_two_moments_lies_the_mean_velocity(
    target: float, velocity: float, limits: PathLimits, moments: list[int]
) -> None:
    path = to_position(0, Motion(0.0, velocity), target, limits)
    for now_us in moments:
        before, after = path.at(now_us), path.at(now_us + 1)
        mean = (before.velocity + after.velocity) / 2
        assert after.position - before.position == pytest.approx(mean * 1e-6, abs=2e-5)
