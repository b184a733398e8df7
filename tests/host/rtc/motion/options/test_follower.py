from __future__ import annotations

from math import nan, pi

import pytest

from tests.host.rtc.motion.port_bench import PortBench, at
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.host.rtc.motion.options.follower import Follower
from tickrig.wire.rtc_types.rtc import Velocity2D

ORIGIN = Pose()


def bench(**settings: str) -> PortBench[Follower]:
    return PortBench(Follower("Follower0"), **settings)


def follow(
    on: PortBench[Follower], leader: Pose, own: Pose = ORIGIN, periods: int = 100
) -> Velocity2D:
    """Return what is commanded in the end."""
    for _ in range(periods):
        on.feed("leader", at(leader.x, leader.y, leader.heading))
        on.feed("position", at(own.x, own.y, own.heading))
        on.period()
    data: Velocity2D = on.taken("velocity")[-1].data
    return data


def test_it_goes_to_a_leader_ahead() -> None:
    assert follow(bench(), Pose(3, 0)) == Velocity2D(0.4, 0.0, 0.0)


def test_at_the_gap_it_stands() -> None:
    assert follow(bench(), Pose(0.8, 0)) == Velocity2D()
    assert follow(bench(), Pose(0.3, 0.3)) == Velocity2D()


def test_near_the_gap_it_is_slower() -> None:
    assert follow(bench(), Pose(1.0, 0)).vx == pytest.approx(0.2)


def test_it_turns_to_a_leader_beside_before_it_goes() -> None:
    data = follow(bench(), Pose(0, 3))
    assert data.vx == pytest.approx(0)
    assert data.va == 0.8
    assert follow(bench(), Pose(-3, -0.1)).va == -0.8


def test_a_base_that_goes_sideways_goes_straight_there() -> None:
    data = follow(bench(sideways="1"), Pose(0, 3, pi / 2))
    assert (data.vx, data.vy, data.va) == pytest.approx((0, 0.4, 0.8))
    data = follow(bench(sideways="1"), Pose(0, 3, pi / 2), Pose(0, 0, pi / 2))
    assert (data.vx, data.vy, data.va) == pytest.approx((0.4, 0, 0))


def test_speeds_change_within_their_limits() -> None:
    on = bench()
    assert follow(on, Pose(3, 3), periods=1) == Velocity2D(0.3 * 0.02, 0.0, 2.0 * 0.02)


def test_without_a_leader_it_stands() -> None:
    on = bench()
    follow(on, Pose(3, 0))
    for _ in range(100):
        on.feed("position", at(0))
        on.period()
    assert on.taken("velocity")[-1].data == Velocity2D()


def test_without_its_own_position_it_stands() -> None:
    on = bench()
    for _ in range(100):
        on.feed("leader", at(3))
        on.period()
    assert on.taken("velocity")[-1].data == Velocity2D()


def test_a_position_with_a_number_that_is_none_changes_nothing() -> None:
    on = bench()
    follow(on, Pose(3, 0))
    on.feed("leader", at(nan))
    on.period()
    assert on.taken("velocity")[-1].data.vx == 0.4


def test_it_begins_anew_when_it_is_activated() -> None:
    on = bench()
    follow(on, Pose(3, 0))
    on.deactivate()
    on.activate()
    assert on.taken("velocity")[-1].data == Velocity2D()
