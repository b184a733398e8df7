"""Measures of a run, and the least time it can take."""

from __future__ import annotations

from math import pi

import pytest

from tickrig.host.rtc.motion.components.omni_to_2wd import plan
from tickrig.host.rtc.motion.control_laws import VelocityLimits
from tickrig.host.rtc.motion.geometry import Pose, Twist
from tickrig.host.rtc.motion.motion_run import (
    MotionLimits,
    MotionRun,
    TrackSample,
    least_time_s,
    way_time_s,
)

LINE = Pose(2.0, 0.0, 0.0)
LIMITS = VelocityLimits(0.3, 0.3, 0.006, 0.1)


def run(*samples: TrackSample) -> MotionRun:
    return MotionRun(Pose(2.0, 0.0, 0.1), list(samples))


def on_line(x: float, y: float, line: Pose | None = LINE) -> TrackSample:
    return TrackSample(x, Pose(x, y), Twist(), line)


def test_errors_are_measured_at_the_end() -> None:
    seen = run(on_line(0.0, 0.0), TrackSample(9.5, Pose(2.03, 0.04, -0.1), Twist(), None))
    assert (seen.error_m, seen.heading_error_rad) == pytest.approx((0.05, 0.2))
    assert (seen.duration_s, seen.end) == (9.5, Pose(2.03, 0.04, -0.1))


def test_cross_track_is_measured_from_the_line_of_the_leg() -> None:
    seen = run(on_line(0.0, 0.03), on_line(1.0, -0.04), on_line(2.0, 9.0, None))
    assert seen.cross_track == pytest.approx((0.00125**0.5, 0.04))


def test_a_short_leg_has_no_cross_track() -> None:
    assert run(on_line(1.5, 0.3), on_line(2.0, 0.3)).cross_track == (0.0, 0.0)


def test_turning_adds_up_without_sign() -> None:
    twists = [Twist(0.0, w) for w in (0.0, 0.1, -0.1, 0.0)]
    seen = run(*(TrackSample(0.0, Pose(), twist, None) for twist in twists))
    assert seen.turning_rad_s == pytest.approx(0.4)


@pytest.mark.parametrize(
    ("twist", "count"),
    [
        (Twist(0.006, 0.1), 0),
        (Twist(0.0061, 0.0), 1),
        (Twist(0.0, -0.11), 1),
        (Twist(0.31, 0.31), 1),
    ],
)
def test_a_command_beyond_a_limit_is_counted(twist: Twist, count: int) -> None:
    seen = run(TrackSample(0.0, Pose(), Twist(), None), TrackSample(0.02, Pose(), twist, None))
    assert seen.violations(LIMITS) == count


@pytest.mark.parametrize("twist", [Twist(0.301, 0.0), Twist(0.0, 0.301)])
def test_a_speed_that_stays_beyond_a_limit_is_counted(twist: Twist) -> None:
    same = TrackSample(0.0, Pose(), twist, None)
    assert run(same, same).violations(LIMITS) == 1


def test_a_speed_at_the_limit_is_within_it() -> None:
    same = TrackSample(0.0, Pose(), Twist(0.3, -0.3), None)
    assert run(same, same).violations(LIMITS) == 0


SQUARE = [Pose(4, 0), Pose(4, 4), Pose(0, 4), Pose(0, 0)]


@pytest.mark.parametrize(
    ("points", "bound_s"),
    [
        ([Pose(1.0, 0.5, pi / 2)], 10.08),
        ([Pose(3.4, 7.7, -1.57)], 42.11),
        ([Pose(-1.0)], 25.40),
        (SQUARE, 78.5),
    ],
)
def test_the_bounds_are_those_of_the_prototype(points: list[Pose], bound_s: float) -> None:
    """rh3-control, manoeuvres and UMBmark."""
    assert least_time_s(plan(Pose(), points)) == pytest.approx(bound_s, abs=0.03)


def test_a_short_way_never_reaches_the_highest_speed() -> None:
    assert way_time_s(0.03, 0.3, 0.3) == pytest.approx(2 * (0.03 / 0.3) ** 0.5)
    assert way_time_s(0.0, 0.3, 0.3) == 0.0


def test_an_abler_cart_is_faster() -> None:
    relays = plan(Pose(), SQUARE)
    assert least_time_s(relays, MotionLimits(v=1.0, w=1.0)) < least_time_s(relays) / 2
