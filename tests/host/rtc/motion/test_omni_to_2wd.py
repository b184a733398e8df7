from __future__ import annotations

from math import nan, pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.host.rtc.motion.port_bench import PortBench, at, poses_of
from tickrig.host.rtc.motion.components.omni_to_2wd import OmniTo2WD, plan
from tickrig.host.rtc.motion.geometry import Pose, wrap
from tickrig.host.rtc.motion.ports import NavigationState
from tickrig.wire.rtc_types.rtc import TimedState

FINISH = TimedState(data=NavigationState.FINISH)
RUNS = TimedState(data=NavigationState.ANGLE_CHECK)
numbers = st.floats(-100, 100)
poses = st.builds(Pose, numbers, numbers, st.floats(-pi, pi))


def bench(x: float = 0.0, y: float = 0.0, heading: float = 0.0) -> PortBench[OmniTo2WD]:
    on = PortBench(OmniTo2WD("OmniTo2WD0"))
    on.feed("current_position", at(x, y, heading))
    on.period()
    return on


def test_a_goal_becomes_turn_line_and_turn() -> None:
    on = bench(1.0, 1.0, 0.3)
    (path,) = on.after("min_path", "goal", at(1.0, 3.0, -1.0))
    assert poses_of(path) == [
        Pose(1, 1, 0.3),
        Pose(1, 1, pi / 2),
        Pose(1, 3, pi / 2),
        Pose(1, 3, -1.0),
    ]


def test_the_way_back_is_driven_forward_too() -> None:
    way = plan(Pose(1.0, 0.0, 0.0), [Pose()])
    assert way[1].heading == way[2].heading == pi


@given(poses, st.lists(poses, min_size=1, max_size=6))
def test_n_points_become_2n_and_2_relay_points(start: Pose, points: list[Pose]) -> None:
    way = plan(start, points)
    steps = [p.distance(q) for p, q in zip([start, *points[:-1]], points, strict=True)]
    if min(steps) > 1e-3:
        assert len(way) == 2 * len(points) + 2
    assert way[0] == start
    assert way[-1] == points[-1]
    for turn, line in zip(way[1:-1:2], way[2:-1:2], strict=True):
        assert turn.heading == line.heading
        assert abs(wrap(turn.bearing(line) - turn.heading)) < 1e-9


def test_a_step_that_is_no_way_is_left_out() -> None:
    assert plan(Pose(1.0), [Pose(1.0, 0.0, 2.0)]) == [Pose(1.0), Pose(1.0, 0.0, 2.0)]
    assert len(plan(Pose(), [Pose(1.0), Pose(1.0), Pose(2.0)])) == 6


def test_a_path_is_planned_when_102_arrives() -> None:
    on = bench()
    first = at(1.0, 0.0, 0.0, 100), at(1.0, 1.0, 0.0, 101)
    assert on.after("min_path", "goal", *first) == []
    (path,) = on.after("min_path", "goal", at(2.0, 1.0, 0.0, 102))
    assert len(path.pose) == 8


def test_a_new_path_begins_with_100() -> None:
    on = bench()
    on.feed("goal", at(5.0, 5.0, 0.0, 100), at(6.0, 5.0, 0.0, 101))
    (path,) = on.after("min_path", "goal", at(1.0, 0.0, 0.0, 100), at(2.0, 0.0, 0.0, 102))
    assert [pose.x for pose in poses_of(path)] == [0.0, 0.0, 1.0, 1.0, 2.0, 2.0]


def test_a_later_goal_gives_way_to_none_before() -> None:
    on = bench()
    (path,) = on.after("min_path", "goal", at(1.0), at(3.0))
    assert poses_of(path)[-1] == Pose(3.0)


def test_a_goal_waits_for_the_first_pose() -> None:
    on = PortBench(OmniTo2WD("OmniTo2WD0"))
    assert on.after("min_path", "goal", at(1.0)) == []
    assert len(on.after("min_path", "current_position", at(0.0))) == 1


def test_a_goal_with_a_number_that_is_none_is_passed_over(
    caplog: pytest.LogCaptureFixture,
) -> None:
    on = bench()
    assert on.after("min_path", "goal", at(nan)) == []
    assert on.component.refused == 1
    assert "OmniTo2WD0: ignored an invalid number" in caplog.text


def test_a_path_with_a_number_that_is_none_is_passed_over_as_a_whole() -> None:
    on = bench()
    spoilt = at(1.0, 0.0, 0.0, 100), at(1.0, nan, 0.0, 101), at(3.0, 0.0, 0.0, 102)
    assert on.after("min_path", "goal", *spoilt) == []
    (path,) = on.after("min_path", "goal", at(4.0))
    assert len(path.pose) == 4


def test_a_pose_with_a_number_that_is_none_changes_nothing() -> None:
    on = bench(1.0)
    on.feed("current_position", at(nan))
    (path,) = on.after("min_path", "goal", at(2.0))
    assert poses_of(path)[0] == Pose(1.0)


def test_finish_is_told_once_when_it_is_reached() -> None:
    on = bench()
    on.feed("goal", at(1.0))
    on.period()
    on.feed("status", RUNS, FINISH, FINISH)
    on.period()
    on.feed("status", FINISH)
    on.period()
    assert [status.data for status in on.taken("status_out")] == [NavigationState.FINISH]


def test_a_finish_of_the_command_before_answers_nothing() -> None:
    on = bench()
    on.feed("goal", at(1.0))
    on.feed("status", FINISH)
    on.period()
    on.feed("status", FINISH)
    on.period(3)
    assert on.taken("status_out") == []


def test_a_finish_without_a_command_is_not_told() -> None:
    assert bench().after("status_out", "status", RUNS, FINISH) == []


def test_activation_begins_without_a_goal() -> None:
    on = bench()
    on.feed("goal", at(1.0, 0.0, 0.0, 100))
    on.period()
    on.deactivate()
    on.activate()
    on.feed("current_position", at(0.0))
    (path,) = on.after("min_path", "goal", at(2.0, 0.0, 0.0, 102))
    assert len(path.pose) == 4
