from __future__ import annotations

from math import nan, pi

from tests.host.motion.port_bench import PortBench, at, poses_of, way
from tickrig.host.motion.components.omni_to_2wd import plan
from tickrig.host.motion.geometry import Pose
from tickrig.host.motion.iis.path_interface import PASSED, STOPPED, PathInterface
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.extended_2d import Velocity2D
from tickrig.wire.rtc_types.rh2 import NavigationState, TimedState

FINISH = TimedState(data=NavigationState.FINISH)
RUNS = TimedState(data=NavigationState.ANGLE_CHECK)
START, CORNER, END = Pose(), Pose(2), Pose(2, 1, -pi / 2)


def bench() -> PortBench[PathInterface]:
    on = PortBench(PathInterface("PathInterface0"))
    on.feed("position", at(0))
    on.period()
    return on


def told(on: PortBench[PathInterface]) -> list[tuple[int, float, float]]:
    """Return flag and place of what was told."""
    states = on.taken("running_state")
    return [(s.id[0], s.data.position.x, s.data.position.y) for s in states]


def test_a_path_is_driven_from_where_the_cart_is() -> None:
    on = bench()
    on.feed("position", at(0.5, 0.5))
    (path,) = on.after("min_path", "path", way(START, CORNER, END))
    assert poses_of(path) == plan(Pose(0.5, 0.5), [CORNER, END])


def test_a_path_waits_for_the_first_pose() -> None:
    on = PortBench(PathInterface("PathInterface0"))
    assert on.after("min_path", "path", way(START, END)) == []
    assert len(on.after("min_path", "position", at(0))) == 1


def test_each_way_point_is_told_when_it_is_passed() -> None:
    on = bench()
    on.feed("path", way(START, CORNER, END))
    on.period()
    assert told(on) == [(PASSED, 0, 0)]
    on.feed("position", at(1.9))
    on.period()
    assert told(on) == []
    on.feed("position", at(1.95))
    on.period()
    assert told(on) == [(PASSED, 2, 0)]


def test_the_last_way_point_is_told_with_the_flag_when_it_stops() -> None:
    on = bench()
    on.feed("path", way(START, CORNER, END))
    on.period()
    on.feed("position", at(2, 1))
    on.feed("status", RUNS, FINISH, FINISH)
    on.period()
    assert told(on) == [(PASSED, 0, 0), (PASSED, 2, 0), (PASSED, 2, 1), (STOPPED, 2, 1)]
    on.feed("status", FINISH)
    on.period()
    assert told(on) == []


def test_headings_are_told_in_0_to_2_pi() -> None:
    on = bench()
    on.feed("path", way(START, END))
    on.period()
    on.feed("status", RUNS, FINISH)
    on.period()
    assert on.taken("running_state")[-1].data.heading == 1.5 * pi


def test_a_finish_of_the_path_before_ends_no_new_path() -> None:
    on = bench()
    on.feed("status", RUNS, FINISH)
    on.feed("path", way(START, END))
    on.period()
    on.feed("status", FINISH)
    on.period()
    assert told(on) == [(PASSED, 0, 0)]


def test_a_new_path_takes_the_place_of_the_old_one() -> None:
    on = bench()
    on.feed("path", way(START, CORNER, END))
    on.period()
    (path,) = on.after("min_path", "path", way(START, Pose(0, 3)))
    assert poses_of(path)[-1] == Pose(0, 3)
    told(on)
    on.feed("position", at(5))
    on.period()
    assert told(on) == []


def test_no_way_points_mean_stop() -> None:
    on = bench()
    on.feed("path", way(START, END))
    on.period()
    (path,) = on.after("min_path", "path", way())
    assert path.pose == ()
    told(on)
    on.feed("status", RUNS, FINISH)
    on.period()
    assert told(on) == []


def test_the_start_alone_does_not_move() -> None:
    on = bench()
    (path,) = on.after("min_path", "path", way(CORNER))
    assert path.pose == ()
    assert told(on) == [(STOPPED, 2, 0)]


def test_a_path_with_a_number_that_is_none_is_passed_over() -> None:
    on = bench()
    spoilt = way(START, Pose(nan), END)
    assert on.after("min_path", "path", spoilt) == []
    on.feed("position", at(nan))
    (path,) = on.after("min_path", "path", way(START, END))
    assert poses_of(path)[0] == Pose()


def test_speeds_of_way_points_are_not_obeyed() -> None:
    there = way(START, CORNER).pose
    backward = iis.TimedPath2DSeq(pose=there, velocity=(Velocity2D(vx=-0.1),) * 2)
    (path,) = bench().after("min_path", "path", backward)
    assert (poses_of(path), path.velocity) == (plan(START, [CORNER]), ())
