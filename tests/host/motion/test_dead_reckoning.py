from __future__ import annotations

from math import cos, isclose, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.motion.geometry import Pose, Twist, moved, twist_of, wheel_speeds, wrap

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
