"""The limiter, the regulator and the spins."""

from __future__ import annotations

from math import cos, pi, radians, sin, sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.rtc.motion.control_laws import (
    ControlLaw,
    ReferenceSpin,
    Regulator,
    TimeOptimalSpin,
    VelocityLimits,
    steps,
)
from tickrig.host.rtc.motion.geometry import Pose, Twist, wrap

LIMITS = VelocityLimits(v=1.0, w=0.3, dv=0.006, dw=0.1)
speeds = st.floats(-1e3, 1e3)


@given(st.lists(st.builds(Twist, speeds, speeds), max_size=50))
def test_no_command_violates_a_limit(wanted: list[Twist]) -> None:
    before = Twist()
    for twist in wanted:
        now = LIMITS.smooth(twist, before)
        assert abs(now.v) <= LIMITS.v
        assert abs(now.w) <= LIMITS.w
        assert abs(now.v - before.v) <= LIMITS.dv + 1e-12
        assert abs(now.w - before.w) <= LIMITS.dw + 1e-12
        before = now


def test_what_is_within_the_limits_passes() -> None:
    assert LIMITS.smooth(Twist(0.105, 0.05), Twist(0.1, 0.0)) == Twist(0.105, 0.05)


@pytest.mark.parametrize(
    ("tick_s", "acc_cycle_s", "dv", "dw"),
    [
        (0.02, 0.001, 0.006, 0.1),  # 0.3 m/s2, and the cap of 5 rad/s2
        (0.001, 0.001, 0.0003, 0.005),
        (0.02, 0.02, 0.0003, 0.1),  # the literal reading
    ],
)
def test_steps_are_given_for_each_acc_cycle(
    tick_s: float, acc_cycle_s: float, dv: float, dw: float
) -> None:
    assert steps(0.0003, 0.1, tick_s, acc_cycle_s) == pytest.approx((dv, dw))


H = 0.02
SPEC = Regulator(800.0, 300.0, 400.0, 0.05, 0.01, H)
EXPLICIT = Regulator(800.0, 300.0, 400.0, 0.05, 0.01, H, ControlLaw.EXPLICIT)
LINE = Pose(1.0, 1.0, 0.0)
BEFORE = Twist(0.3, 0.01)


def test_the_explicit_law_is_the_published_one() -> None:
    command = EXPLICIT.follow_line(LINE, Pose(2.0, 1.02, 0.1), 0.3, BEFORE)
    w = 0.01 - H * (800 * 0.02 + 300 * 0.1 + 400 * 0.01)
    assert command == pytest.approx((0.3, w))


def test_the_implicit_law_solves_for_the_new_angular_velocity() -> None:
    w = SPEC.follow_line(LINE, Pose(2.0, 1.02, 0.1), 0.3, BEFORE).w
    assert w == pytest.approx(0.01 - H * (800 * 0.02 + 300 * 0.1 + 400 * w))


@pytest.mark.parametrize("regulator", [SPEC, EXPLICIT])
def test_an_offset_counts_up_to_line_dist(regulator: Regulator) -> None:
    near = regulator.follow_line(LINE, Pose(0.0, 1.05), 0.3, BEFORE)
    assert regulator.follow_line(LINE, Pose(0.0, 9.0), 0.3, BEFORE) == near


def test_the_speed_gives_way_to_the_turning_by_line_c1() -> None:
    command = SPEC.follow_line(LINE, Pose(0.0, 1.05), 0.3, Twist(0.3, 0.0))
    assert command.v == pytest.approx(0.3 - 0.01 * abs(command.w))
    assert EXPLICIT.follow_line(LINE, Pose(0.0, 1.05), 0.3, Twist(0.3, 0.0)).v == 0.3


def test_so_much_turning_that_the_speed_would_turn_round_makes_it_nothing() -> None:
    keen = Regulator(800.0, 300.0, 1.0, 0.05, 1.0, H)
    assert keen.follow_line(LINE, Pose(0.0, 1.05, 1.0), 0.1, Twist()).v == 0.0


def test_backward_the_offset_steers_the_other_way() -> None:
    forward = SPEC.follow_line(LINE, Pose(0.0, 1.01), 0.3, Twist())
    backward = SPEC.follow_line(LINE, Pose(0.0, 1.01), -0.3, Twist())
    assert (backward.v, backward.w) == pytest.approx((-forward.v, -forward.w))


def test_the_explicit_law_asks_the_speed_that_was_commanded_for_its_sign() -> None:
    pose = Pose(0.0, 1.01)
    assert (
        EXPLICIT.follow_line(LINE, pose, 0.3, Twist(-0.1, 0.0)).w
        == -EXPLICIT.follow_line(LINE, pose, 0.3, Twist(0.1, 0.0)).w
    )


@pytest.mark.parametrize("radius", [1.0, -1.0])
def test_on_a_circle_the_turning_is_fed_forward(radius: float) -> None:
    """At rest on the circle the fixed point of the law is v / R."""
    pose = Pose(0.0, -radius, 0.0)
    w = 0.3 / radius
    command = SPEC.follow_circle(Pose(), radius, pose, 0.3, Twist(0.3, w))
    assert command == pytest.approx((0.3, w))


@pytest.mark.parametrize("radius", [1.0, -1.0])
@pytest.mark.parametrize("off", [0.2, -0.2])
def test_a_circle_is_found_from_inside_and_outside(radius: float, off: float) -> None:
    pose, twist = Pose(0.0, -radius + off, 0.0), Twist(0.3, 0.0)
    for _ in range(2_000):
        twist = SPEC.follow_circle(Pose(), radius, pose, 0.3, twist)
        pose = driven(pose, twist)
    assert pose.distance(Pose()) == pytest.approx(1.0, abs=0.01)
    assert twist.w == pytest.approx(0.3 / radius, abs=0.01)


@given(st.floats(-0.2, 0.2), st.floats(-1.0, 1.0), st.floats(5.0, 4_000.0))
def test_the_implicit_law_finds_the_line_whatever_k3(d: float, q: float, k3: float) -> None:
    """With the designed ratios K1/K3 = 2 and K2/K3 = 0.75 no gain makes it chatter."""
    regulator = Regulator(2 * k3, 0.75 * k3, k3, 0.05, 0.01, H)
    pose, twist = Pose(0.0, d, q), Twist()
    for _ in range(2_000):
        twist = regulator.follow_line(Pose(), pose, 0.3, twist)
        pose = driven(pose, twist)
    assert abs(pose.y) < 0.005
    assert abs(wrap(pose.heading)) < 0.01


def test_the_approach_angle_is_k1_line_dist_over_k2() -> None:
    """Far from the line: 0.133 rad (rh3-control, line following)."""
    pose, twist = Pose(0.0, 5.0, 0.0), Twist()
    for _ in range(1_000):
        twist = SPEC.follow_line(Pose(), pose, 0.3, twist)
        pose = driven(pose, twist)
    assert pose.heading == pytest.approx(-800 * 0.05 / 300, abs=0.001)


def driven(pose: Pose, twist: Twist) -> Pose:
    """Return the pose after a step at once at this velocity."""
    heading = pose.heading + twist.w * H
    return Pose(
        pose.x + twist.v * H * cos(heading),
        pose.y + twist.v * H * sin(heading),
        (heading + pi) % (2 * pi) - pi,
    )


LATENCY = 0.03
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
