"""The goal interface of IIS, and its running information."""

from __future__ import annotations

from math import nan, pi

import pytest

from tests.host.rtc.motion.port_bench import PortBench, at
from tickrig.host.rtc import InPort, Manager, OutPort, connect
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.host.rtc.motion.iis_interfaces import GoalInterface, RunningInformation
from tickrig.host.rtc.motion.ports import read_all, to_pose_2d
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.rtc import Time

WIDE = {"dataport.buffer.length": "64"}


class Bench:
    """The component at a rate; poses come every 20 ms."""

    def __init__(self, rate_hz: float = 100.0) -> None:
        self.manager, self.now_us = Manager(), 0
        self.component = self.manager.add(RunningInformation("Info0"), rate_hz)
        self.feed = OutPort("to_position", iis.TimedPose2D)
        self.end = InPort("from_velocity", iis.TimedVelocity2D)
        connect(self.feed, self.component.position, WIDE)
        connect(self.component.velocity, self.end, WIDE)
        self.manager.activate("Info0")

    def pose(self, x: float, y: float = 0.0, heading: float = 0.0) -> None:
        value = at(x, y, heading)
        self.feed.write(iis.TimedPose2D(Time.from_us(self.now_us), data=value.data))

    def run(self, duration_us: int = 20_000) -> list[iis.TimedVelocity2D]:
        self.now_us += duration_us
        self.manager.run_to(self.now_us)
        return list(read_all(self.end))


def test_a_velocity_leaves_every_10_ms() -> None:
    bench = Bench()
    assert len(bench.run(500_000)) == 50


def test_it_is_the_way_between_two_poses_in_the_robots_frame() -> None:
    bench = Bench()
    bench.pose(0, 0, pi / 2)
    bench.run()
    bench.pose(0.002, 0.006, pi / 2)
    latest = bench.run()[-1]
    assert latest.tm == Time.from_us(20_000)
    assert latest.data.vx == pytest.approx(0.3)
    assert latest.data.vy == pytest.approx(-0.1)
    assert latest.data.va == 0


def test_a_turn_across_half_a_turn_is_short() -> None:
    bench = Bench()
    bench.pose(0, 0, pi - 0.003)
    bench.run()
    bench.pose(0, 0, -pi + 0.003)
    assert bench.run()[-1].data.va == pytest.approx(0.3)


def test_without_poses_it_stands() -> None:
    bench = Bench()
    bench.pose(0)
    bench.run()
    bench.pose(0.01)
    assert bench.run()[-1].data.vx == pytest.approx(0.5)
    assert bench.run(90_000)[-1].data.vx == pytest.approx(0.5)
    assert bench.run(40_000)[-1].data.vx == 0


def test_a_pose_of_the_same_time_or_with_no_number_says_nothing() -> None:
    bench = Bench()
    bench.pose(0)
    bench.pose(1)
    bench.pose(nan)
    assert bench.run()[-1].data.vx == 0


def test_a_period_above_10_ms_is_told_in_the_log(caplog: pytest.LogCaptureFixture) -> None:
    Bench(50.0).run()
    assert "Info0: period 20000 us, IIS recommends 10000 us at most" in caplog.text


def bench() -> PortBench[GoalInterface]:
    return PortBench(GoalInterface("GoalInterface0"))


def goals(*poses: Pose) -> iis.TimedPose2DSeq:
    return iis.TimedPose2DSeq(data=tuple(map(to_pose_2d, poses)))


def test_only_the_first_pose_of_a_goal_counts() -> None:
    on = bench()
    (goal,) = on.after("position", "goal", goals(Pose(1, 2, 0.5), Pose(3, 4)))
    assert (goal.id, goal.data) == ((), to_pose_2d(Pose(1, 2, 0.5)))


def test_a_goal_in_0_to_2_pi_reaches_rh3_in_its_own_range() -> None:
    (goal,) = bench().after("position", "goal", goals(Pose(1, 2, 1.5 * pi)))
    assert goal.data.heading == -pi / 2


def test_a_new_goal_takes_the_place_of_one_that_was_not_taken() -> None:
    (goal,) = bench().after("position", "goal", goals(Pose(1)), goals(Pose(2)))
    assert goal.data.position.x == 2


def test_an_empty_goal_is_an_empty_path() -> None:
    on = bench()
    (path,) = on.after("min_path", "goal", goals())
    assert path.pose == ()
    assert on.taken("position") == []


def test_a_goal_with_a_number_that_is_none_is_passed_over() -> None:
    on = bench()
    assert on.after("position", "goal", goals(Pose(nan))) == []
    assert on.taken("min_path") == []
