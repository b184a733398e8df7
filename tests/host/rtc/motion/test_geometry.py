"""Poses on a plane, and dead reckoning."""

from __future__ import annotations

from math import cos, isclose, pi, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.rtc.motion.geometry import (
    Pose,
    Twist,
    clip,
    moved,
    positive,
    twist_of,
    wheel_speeds,
    wrap,
)

angles = st.floats(-1e4, 1e4)


@given(angles)
def test_a_wrapped_angle_is_the_same_direction_within_half_a_turn(angle: float) -> None:
    wrapped = wrap(angle)
    assert -pi < wrapped <= pi
    assert isclose(cos(wrapped), cos(angle), abs_tol=1e-9)
    assert isclose(sin(wrapped), sin(angle), abs_tol=1e-9)


@given(angles)
def test_a_positive_angle_is_the_same_direction_within_a_turn(angle: float) -> None:
    turned = positive(angle)
    assert 0 <= turned <= 2 * pi
    assert isclose(wrap(turned - angle), 0, abs_tol=1e-9)


@pytest.mark.parametrize(("angle", "wrapped"), [(pi, pi), (-pi, pi), (3 * pi, pi), (0.5, 0.5)])
def test_half_a_turn_is_positive(angle: float, wrapped: float) -> None:
    assert wrap(angle) == wrapped


def test_along_and_left_are_measured_from_the_pose() -> None:
    line = Pose(1.0, 2.0, pi / 2)
    assert line.along(Pose(1.0, 5.0)) == pytest.approx(3.0)
    assert line.left(Pose(0.5, 2.0)) == pytest.approx(0.5)
    assert line.distance(Pose(4.0, 6.0)) == 5.0
    assert line.bearing(Pose(1.0, 7.0)) == pytest.approx(pi / 2)


def test_a_clipped_value_is_within_its_limit() -> None:
    assert [clip(value, 2.0) for value in (-3.0, -1.0, 5.0)] == [-2.0, -1.0, 2.0]


TREAD, RADIUS = 0.464, 0.0995
ways = st.floats(-2.0, 2.0)


def test_a_straight_way_goes_where_the_cart_looks() -> None:
    assert moved(Pose(1.0, 2.0, 0.6), 3.0, 3.0, TREAD) == pytest.approx(
        (1.0 + 3 * cos(0.6), 2.0 + 3 * sin(0.6), 0.6)
    )


def test_opposite_ways_turn_on_the_spot() -> None:
    assert moved(Pose(1.0, 2.0, 0.0), -0.232, 0.232, TREAD) == pytest.approx((1.0, 2.0, 1.0))


@given(ways, ways)
def test_many_small_ways_are_one_arc(left: float, right: float) -> None:
    whole, stepwise = moved(Pose(), left, right, TREAD), Pose()
    for _ in range(8):
        stepwise = moved(stepwise, left / 8, right / 8, TREAD)
    assert whole.distance(stepwise) < 1e-9
    assert isclose(wrap(whole.heading - stepwise.heading), 0, abs_tol=1e-9)


@given(ways, ways)
def test_the_way_back_ends_at_the_start(left: float, right: float) -> None:
    assert moved(moved(Pose(), left, right, TREAD), -left, -right, TREAD).distance(Pose()) < 1e-9


@given(st.floats(-1, 1), st.floats(-1, 1))
def test_wheel_speeds_make_the_twist(v: float, w: float) -> None:
    left, right = wheel_speeds(Twist(v, w), TREAD, RADIUS, RADIUS)
    assert twist_of(left * RADIUS, right * RADIUS, TREAD) == pytest.approx((v, w), abs=1e-12)


def test_each_wheel_has_its_own_radius() -> None:
    assert wheel_speeds(Twist(0.3, 1.0), 0.4, 0.1, 0.2) == pytest.approx((1.0, 2.5))
