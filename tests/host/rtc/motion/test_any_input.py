"""No message makes a component fail, or a command leave its limits."""

from __future__ import annotations

from itertools import pairwise
from math import isfinite

from hypothesis import given
from hypothesis import strategies as st

from tests.host.rtc.motion.port_bench import PortBench
from tickrig.host.rtc.motion.components.navigation import Navigation
from tickrig.host.rtc.motion.components.odometry import Odometry
from tickrig.host.rtc.motion.components.omni_to_2wd import OmniTo2WD
from tickrig.host.rtc.motion.components.path_follower import PathFollower
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.idl import Struct
from tickrig.wire.rtc_types.rtc import Path, Point2D, Pose2D, TimedDoubleSeq, TimedState

numbers = st.floats() | st.sampled_from([0.0, -0.0, 1e-308, 1e308, -1e9, 1e9]) | st.floats(-5, 5)
shorts = st.integers(-(2**15), 2**15 - 1) | st.integers(0, 8)
poses = st.builds(Pose2D, st.builds(Point2D, numbers, numbers), numbers)
timed_poses = st.builds(
    lambda ids, pose: iis.TimedPose2D(id=tuple(ids), data=pose),
    st.lists(st.sampled_from([0, 100, 101, 102]), max_size=2),
    poses,
)
paths = st.builds(lambda type_, n: Path(type_, 0, *n), shorts, st.tuples(*[numbers] * 6))
lists = st.lists(poses, max_size=5).map(lambda each: iis.TimedPath2DSeq(pose=tuple(each)))
states = st.builds(lambda data: TimedState(data=data), shorts)
angles = st.lists(numbers, max_size=3).map(lambda each: TimedDoubleSeq(data=tuple(each)))


@given(st.lists(st.tuples(paths, timed_poses), min_size=1, max_size=8))
def test_the_follower_keeps_its_limits(played: list[tuple[Path, iis.TimedPose2D]]) -> None:
    on = PortBench(PathFollower("PathFollower0"))
    for path, pose in played:
        on.feed("target_path", path)
        on.feed("position", pose)
        on.period()
    on.period(2)
    assert on.state == "ACTIVE"
    commands = [(each.data.vx, each.data.va) for each in on.taken("velocity")]
    for (v, w), (next_v, next_w) in pairwise(commands):
        assert isfinite(next_v)
        assert isfinite(next_w)
        assert abs(next_v - v) <= 0.006 + 1e-9
        assert abs(next_w - w) <= 0.1 + 1e-9
        assert abs(next_v) <= 1.0
        assert abs(next_w) <= 0.3


@given(st.lists(st.tuples(st.none() | lists, timed_poses), max_size=8))
def test_navigation_sends_numbers(
    played: list[tuple[iis.TimedPath2DSeq | None, iis.TimedPose2D]],
) -> None:
    on = PortBench(Navigation("Navigation0"))
    for way, pose in played:
        on.feed("min_path", *([way] if way else []))
        on.feed("position", pose)
        on.period()
    on.period(2)
    assert on.state == "ACTIVE"
    for path in on.taken("path"):
        assert all(map(isfinite, (path.x, path.y, path.theta, path.v, path.w)))


@given(st.lists(st.tuples(timed_poses, timed_poses, states), max_size=8))
def test_the_planner_sends_numbers(played: list[tuple[Struct, Struct, Struct]]) -> None:
    on = PortBench(OmniTo2WD("OmniTo2WD0"))
    for position, goal, status in played:
        on.feed("current_position", position)
        on.feed("goal", goal)
        on.feed("status", status)
        on.period()
    on.period(2)
    assert on.state == "ACTIVE"
    for way in on.taken("min_path"):
        for pose in way.pose:
            assert all(map(isfinite, (pose.position.x, pose.position.y, pose.heading)))


@given(st.lists(angles, max_size=8))
def test_odometry_gives_numbers(played: list[TimedDoubleSeq]) -> None:
    on = PortBench(Odometry("Odometry0"))
    for each in played:
        on.feed("CurrentWheelAngle", each)
        on.period()
    on.period(2)
    assert on.state == "ACTIVE"
    for pose in on.taken("OdometryPosition"):
        numbers = pose.data.position.x, pose.data.position.y, pose.data.heading
        assert all(map(isfinite, numbers))
