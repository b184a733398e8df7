from __future__ import annotations

from math import pi, radians, sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.motion.control_laws import ReferenceSpin, TimeOptimalSpin, VelocityLimits
from tickrig.host.motion.geometry import Twist, wrap

H, LATENCY = 0.02, 0.03
LIMITS = VelocityLimits(1.0, 0.3, 0.006, 0.1)
REFERENCE, OPTIMAL = ReferenceSpin(5.0), TimeOptimalSpin(2.5, H, LATENCY)


@pytest.mark.parametrize(
    ("q", "w"),
    [
        (1.0, 1.0),  # sqrt(2 * 0.1 * 5 * q) = sqrt(q)
        (0.25, 0.5),
        (-0.25, -0.5),
        (1e-4, radians(2)),
        (pi, 1.0),
    ],
)
def test_the_reference_spin_slows_down_with_the_root_of_the_angle(q: float, w: float) -> None:
    assert REFERENCE.turn(q, 0.0, 1.0, Twist()) == pytest.approx((0.0, w))


def test_a_spin_takes_the_shorter_way() -> None:
    assert REFERENCE.turn(3.0, -3.0, 1.0, Twist()).w < 0
    assert OPTIMAL.turn(3.0, -3.0, 1.0, Twist()).w < 0


def test_the_time_optimal_spin_brakes_for_the_angle_that_it_will_have() -> None:
    command = OPTIMAL.turn(0.2, 0.0, 10.0, Twist(0.0, 1.0))
    assert command.w == pytest.approx(sqrt(2 * 2.5 * (0.2 - 1.0 * LATENCY)))


def test_the_time_optimal_spin_ends_within_the_next_effect() -> None:
    command = OPTIMAL.turn(0.001, 0.0, 1.0, Twist())
    assert command.w == pytest.approx(0.001 / (H + LATENCY))


@given(st.floats(-pi, pi), st.floats(-pi, pi))
def test_the_time_optimal_spin_arrives_with_no_more_than_a_milliradian_over(
    heading: float, start: float
) -> None:
    present, twist, way = start, Twist(), wrap(heading - start)
    turned = 0.0
    for _ in range(1_200):
        twist = LIMITS.smooth(OPTIMAL.turn(heading, present, 0.3, twist), twist)
        present += twist.w * H
        turned = max(turned, abs(present - start))
    assert abs(wrap(heading - present)) < 1e-6
    if abs(way) < pi - 0.01:
        assert turned < abs(way) + 0.001
