from __future__ import annotations

from math import pi

import pytest

from tickrig.host.motion.components.omni_to_2wd import plan
from tickrig.host.motion.geometry import Pose
from tickrig.host.motion.motion_run import MotionLimits, least_time_s, way_time_s

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
