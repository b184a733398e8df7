from __future__ import annotations

from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.rtc.motion.geometry import Pose, Wheels, moved
from tickrig.host.rtc.motion.umbmark import Error, Umbmark, square

SIDE_M = 4.0
NOMINAL = Wheels(0.1, 0.1, 0.45)


def squared(true: Wheels, *, clockwise: bool, thought: Wheels = NOMINAL) -> Error:
    """Return where a cart ends that drives a perfect square, as it thinks."""
    pose, turn = Pose(), -pi / 2 if clockwise else pi / 2
    for _ in range(4):
        straight = SIDE_M / thought.left, SIDE_M / thought.right
        way = turn * thought.axle / 2
        spin = -way / thought.left, way / thought.right
        for left, right in (straight, spin):
            pose = moved(pose, left * true.left, right * true.right, true.axle)
    return pose.x, pose.y


def umbmark(true: Wheels, thought: Wheels = NOMINAL) -> Umbmark:
    return Umbmark(
        (squared(true, clockwise=True, thought=thought),),
        (squared(true, clockwise=False, thought=thought),),
    )


def test_a_perfect_cart_needs_no_correction() -> None:
    assert umbmark(NOMINAL).most_m < 1e-9
    assert umbmark(NOMINAL).corrected(NOMINAL) == pytest.approx(NOMINAL)


@given(st.floats(-0.01, 0.01), st.floats(-0.002, 0.002))
def test_one_calibration_makes_small_errors_much_smaller(tread: float, wheel: float) -> None:
    true = Wheels(0.1 * (1 - wheel), 0.1 * (1 + wheel), 0.45 * (1 + tread))
    before = umbmark(true)
    corrected = before.corrected(NOMINAL)
    assert corrected.axle == pytest.approx(true.axle, rel=2e-3)
    assert corrected.right / corrected.left == pytest.approx(true.right / true.left, rel=2e-4)
    assert umbmark(true, corrected).most_m <= before.most_m / 5 + 1e-3


def test_the_mean_radius_stays() -> None:
    corrected = umbmark(Wheels(0.101, 0.1, 0.45)).corrected(NOMINAL)
    assert (corrected.left + corrected.right) / 2 == pytest.approx(0.1)


def test_the_error_is_the_larger_distance_of_the_centres_of_gravity() -> None:
    """The scatter of the runs does not count (E_max,syst)."""
    seen = Umbmark(((0.1, 0.0), (0.3, 0.0)), ((0.0, 0.3), (0.0, -0.3)))
    assert seen.most_m == pytest.approx(0.2)


def test_the_squares_are_mirrored() -> None:
    assert square(clockwise=True)[1] == Pose(4.0, -4.0)
    assert square(clockwise=False)[1] == Pose(4.0, 4.0)
    assert square(clockwise=True)[-1] == Pose()
