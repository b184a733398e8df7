from __future__ import annotations

from math import nan, pi

from tests.host.motion.port_bench import PortBench
from tickrig.host.motion.geometry import Pose
from tickrig.host.motion.iis.interfaces import GoalInterface
from tickrig.host.motion.ports import to_pose_2d
from tickrig.wire.rtc_types import iis


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
