from __future__ import annotations

from math import nan, pi

import pytest

from tests.host.rtc.motion.port_bench import PortBench, at, way
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.host.rtc.motion.iis_interfaces import PASSED, STOPPED, PathInterface
from tickrig.host.rtc.motion.ports import RunMode
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.rtc import Path, Velocity2D

START, CORNER, END = Pose(), Pose(2), Pose(2, 1, -pi / 2)


def bench() -> PortBench[PathInterface]:
    return PortBench(PathInterface("PathInterface0"))


def paced(*points: tuple[Pose, float]) -> iis.TimedPath2DSeq:
    """Return way points with their speeds."""
    poses = way(*(pose for pose, _ in points)).pose
    return iis.TimedPath2DSeq(pose=poses, velocity=tuple(Velocity2D(vx) for _, vx in points))


def told(on: PortBench[PathInterface]) -> list[tuple[int, float, float]]:
    """Return flag and place of what was told."""
    states = on.taken("running_state")
    return [(s.id[0], s.data.position.x, s.data.position.y) for s in states]


def ordered(on: PortBench[PathInterface], x: float, y: float = 0.0, heading: float = 0.0) -> Path:
    """Return what the follower is told last when the cart is at a pose."""
    path: Path = on.after("target_path", "position", at(x, y, heading))[-1]
    return path


def test_it_turns_then_drives_to_the_way_point() -> None:
    on = bench()
    on.feed("path", way(START, CORNER, END))
    turn = ordered(on, 0, 0, 1.0)
    assert (turn.type, turn.theta, turn.w) == (RunMode.SPIN, 0.0, 1.0)
    line = ordered(on, 0, 0, 0.005)
    assert (line.type, line.x, line.y, line.theta, line.v) == (RunMode.LINEFOLLOW, 2, 0, 0, 0.3)


def test_it_brakes_before_the_way_point() -> None:
    on = bench()
    on.feed("path", way(START, CORNER))
    ordered(on, 0)
    assert 0.01 < ordered(on, 1.95).v < 0.3
    assert ordered(on, 1.9979).v == 0.01


def test_it_begins_where_the_cart_is() -> None:
    on = bench()
    on.feed("path", way(START, CORNER, END))
    assert ordered(on, 2.0, -1.0, 0.0).theta == pytest.approx(pi / 2)


def test_each_way_point_is_told_when_it_is_passed() -> None:
    on = bench()
    on.feed("path", way(START, CORNER, END))
    ordered(on, 0)
    assert told(on) == [(PASSED, 0, 0)]
    ordered(on, 1.9)
    assert told(on) == []
    assert ordered(on, 1.999).type == RunMode.SPIN
    assert told(on) == [(PASSED, 2, 0)]


def test_the_last_way_point_is_told_with_the_flag_when_it_stops() -> None:
    on = bench()
    on.feed("path", way(START, END))
    ordered(on, 2, 0, pi / 2)
    turn = ordered(on, 2, 0.999, pi / 2)
    assert (turn.type, turn.theta) == (RunMode.SPIN, -pi / 2)
    assert told(on) == [(PASSED, 0, 0), (PASSED, 2, 1)]
    assert ordered(on, 2, 0.999, -pi / 2).type == RunMode.STOP
    assert told(on) == [(STOPPED, 2, 1)]
    assert on.after("target_path", "position", at(2, 0.999)) == []


def test_the_follower_has_one_message_a_period() -> None:
    on = bench()
    on.feed("path", way(START, START, CORNER, END))
    counts = [len(on.after("target_path", "position", at(x))) for x in (0, 0, 1, 1.999, 1.999)]
    assert counts == [1, 1, 1, 1, 0]


def test_headings_are_told_in_0_to_2_pi() -> None:
    on = bench()
    on.feed("path", way(START, END))
    ordered(on, 2, 1, -pi / 2)
    assert on.taken("running_state")[-1].data.heading == 1.5 * pi


def test_a_way_point_where_the_cart_is_already_is_passed_at_once() -> None:
    on = bench()
    on.feed("path", way(START, START, CORNER))
    assert ordered(on, 0).x == 2
    assert told(on) == [(PASSED, 0, 0), (PASSED, 0, 0)]


def test_speeds_of_way_points_are_obeyed_up_to_the_most() -> None:
    on = bench()
    on.feed("path", paced((START, 9.0), (CORNER, 0.1), (END, 9.0)))
    ordered(on, 0)
    assert ordered(on, 0.5).v == 0.1
    ordered(on, 2.0, 0.0, pi / 2)
    ordered(on, 2.0, 0.0, pi / 2)
    assert ordered(on, 2.0, 0.1, pi / 2).v == 0.3


def test_a_negative_speed_backs_up() -> None:
    on = bench()
    on.feed("path", paced((START, 0.0), (Pose(-2.0), -0.2)))
    line = ordered(on, 0)
    assert (line.type, line.theta) == (RunMode.LINEFOLLOW, 0.0)
    assert ordered(on, -1.0).v == -0.2
    assert -0.2 < ordered(on, -1.98).v < 0
    ordered(on, -1.999)
    ordered(on, -1.999)
    assert told(on) == [(PASSED, 0, 0), (PASSED, -2, 0), (STOPPED, -2, 0)]


def test_fewer_speeds_than_way_points_will_do() -> None:
    on = bench()
    there = way(START, CORNER).pose
    on.feed("path", iis.TimedPath2DSeq(pose=there, velocity=(Velocity2D(0.1),)))
    ordered(on, 0)
    assert ordered(on, 0.5).v == 0.3


def test_a_new_path_takes_the_place_of_the_old_one() -> None:
    on = bench()
    on.feed("path", way(START, CORNER, END))
    ordered(on, 0)
    on.feed("path", way(START, Pose(0, 3)))
    assert ordered(on, 1).theta == pytest.approx(pi - 1.2490457723982544)
    assert told(on) == [(PASSED, 0, 0), (PASSED, 0, 0)]


def test_no_way_points_mean_stop() -> None:
    on = bench()
    on.feed("path", way(START, CORNER))
    ordered(on, 0)
    told(on)
    (stop,) = on.after("target_path", "path", way())
    assert stop.type == RunMode.STOP
    assert told(on) == []
    assert on.after("target_path", "position", at(0.5)) == []


def test_the_start_alone_does_not_move() -> None:
    on = bench()
    (stop,) = on.after("target_path", "path", way(CORNER))
    assert stop.type == RunMode.STOP
    assert told(on) == [(STOPPED, 2, 0)]
    assert on.after("target_path", "position", at(0.5)) == []


@pytest.mark.parametrize("spoilt", [way(START, Pose(nan), END), paced((START, 0.0), (CORNER, nan))])
def test_a_path_with_a_number_that_is_none_is_passed_over(spoilt: iis.TimedPath2DSeq) -> None:
    on = bench()
    assert on.after("target_path", "path", spoilt) == []
    assert on.after("target_path", "position", at(nan)) == []


def test_activation_begins_without_a_path() -> None:
    on = bench()
    on.feed("path", way(START, CORNER))
    ordered(on, 0)
    on.deactivate()
    on.activate()
    assert on.after("target_path", "position", at(0)) == []
