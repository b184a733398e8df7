from __future__ import annotations

from math import cos, isclose, pi, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.motion.geometry import Pose, clip, positive, wrap

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
