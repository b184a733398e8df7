from __future__ import annotations

import re
from math import degrees, inf, nan
from pathlib import Path

import pytest

from tests.host.rtc.motion.port_bench import PortBench, at
from tickrig.host.rtc.motion.components.position_input import USAGE, PositionInput
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.host.rtc.motion.ports import NavigationState
from tickrig.wire.rtc_types.rtc import TimedState

FINISH = TimedState(data=NavigationState.FINISH)
GOAL = Pose(1.0, 2.0, 0.5)


def bench() -> PortBench[PositionInput]:
    return PortBench(PositionInput("PositionInput0"))


def sent(on: PortBench[PositionInput]) -> list[tuple[tuple[int, ...], float]]:
    """Return ids and x of what was sent."""
    return [(message.id, message.data.position.x) for message in on.taken("position")]


def test_a_goal_carries_no_id() -> None:
    on = bench()
    on.component.goal(GOAL)
    on.period()
    (message,) = on.taken("position")
    assert (message.id, message.data) == ((), at(*GOAL).data)
    assert message.tm.sec * 10**9 + message.tm.nsec == on.context.now_us * 1_000


def test_a_path_carries_100_101_102() -> None:
    on = bench()
    on.component.path([Pose(float(n)) for n in range(4)])
    on.period()
    assert sent(on) == [((100,), 0.0), ((101,), 1.0), ((101,), 2.0), ((102,), 3.0)]


def test_a_command_waits_until_the_one_before_has_finished() -> None:
    on = bench()
    on.component.goal(Pose(1.0))
    on.component.goal(Pose(2.0))
    on.period(5)
    assert sent(on) == [((), 1.0)]
    on.feed("status", FINISH)
    on.period()
    assert sent(on) == [((), 2.0)]
    assert (on.component.finished, on.component.idle) == (1, False)


def test_only_finish_ends_a_command() -> None:
    on = bench()
    on.component.goal(GOAL)
    on.period()
    on.feed("status", TimedState(data=NavigationState.SPEED_DOWN))
    on.period()
    assert on.component.finished == 0


def test_a_goal_can_take_the_place_of_all() -> None:
    on = bench()
    on.component.goal(Pose(1.0))
    on.component.goal(Pose(2.0))
    on.period()
    on.component.replace(Pose(3.0))
    on.period()
    assert sent(on) == [((), 1.0), ((), 3.0)]


def test_after_the_last_command_it_goes_into_error() -> None:
    on = bench()
    on.component.goal(GOAL)
    on.component.end()
    on.period(3)
    assert on.state == "ACTIVE"
    on.feed("status", FINISH)
    on.period(2)
    assert on.state == "ERROR"


@pytest.mark.parametrize("number", [nan, inf, -inf, 1e10])
def test_what_is_no_number_is_refused(number: float) -> None:
    with pytest.raises(ValueError, match="a pose has three numbers, got"):
        bench().component.goal(Pose(0.0, number, 0.0))
    with pytest.raises(ValueError, match="a pose has three numbers, got"):
        bench().component.path([Pose(), Pose(0.0, 0.0, number)])


def test_a_refused_goal_replaces_nothing() -> None:
    on = bench()
    on.component.goal(GOAL)
    with pytest.raises(ValueError, match="a pose has three numbers"):
        on.component.replace(Pose(nan))
    on.period()
    assert len(on.taken("position")) == 1


def test_a_path_of_one_point_is_refused() -> None:
    with pytest.raises(ValueError, match="a path has 2 points or more, got 1"):
        bench().component.path([GOAL])


def test_its_configuration_changes_nothing() -> None:
    on = PortBench(PositionInput("PositionInput0"), **{"01_x": "9"})
    on.period(3)
    assert on.taken("position") == []


def passed(on: PortBench[PositionInput]) -> list[tuple[tuple[int, ...], float, float, float]]:
    """Return ids, x, y and degrees of what was sent."""
    return [
        (m.id, m.data.position.x, m.data.position.y, round(degrees(m.data.heading), 9))
        for m in on.taken("position")
    ]


def test_a_typed_goal_is_in_metres_and_degrees() -> None:
    on = bench()
    on.component.typed(" goal 1 -2 90 \r")
    on.period()
    assert passed(on) == [((), 1.0, -2.0, 90.0)]


def test_a_path_is_typed_or_comes_from_a_file_or_is_the_defined_one(tmp_path: Path) -> None:
    file = tmp_path / "my path.txt"
    file.write_text("1 0\n1 1 1.5707963267948966\n")
    on = bench()
    on.component.defined_path = (Pose(3.0), Pose(4.0))
    for line in ("path 2 0, 2 2 45", f"path {file}", "path"):
        on.component.typed(line)
        on.period()
        on.feed("status", FINISH)
        on.period()
    assert passed(on) == [
        *[((100,), 2.0, 0.0, 0.0), ((102,), 2.0, 2.0, 45.0)],
        *[((100,), 1.0, 0.0, 0.0), ((102,), 1.0, 1.0, 90.0)],
        *[((100,), 3.0, 0.0, 0.0), ((102,), 4.0, 0.0, 0.0)],
    ]


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("", "'' is not a command: goal X Y DEG; path FILE; path X Y, X Y DEG; path; end"),
        ("go 1 2 3", "'go 1 2 3' is not a command: goal X Y DEG;"),
        ("goal", "'goal' is not a command"),
        ("goal 1", "'1' is not X Y in metres, and a heading in degrees"),
        ("goal 1 2 3 4", "'1 2 3 4' is not X Y in metres"),
        ("goal 1 nan 3", "'1 nan 3' is not X Y in metres"),
        ("goal 1 2 3, 4 5", "is not a command"),
        ("goal 1001 0 0", "'1001 0 0' is beyond 1000 m"),
        ("path 1 2,", "'' is not X Y in metres"),
        ("path /no/such", "path /no/such: No such file or directory"),
        ("end now", "'end now' is not a command"),
    ],
)
def test_a_typed_line_that_is_no_command_says_why(line: str, error: str) -> None:
    on = bench()
    with pytest.raises(ValueError, match=re.escape(error)):
        on.component.typed(line)
    on.period()
    assert (on.taken("position"), on.component.idle) == ([], True)


def test_it_asks_tells_what_it_sends_and_asks_again_after_finish() -> None:
    component = PositionInput("PositionInput0")
    said: list[str] = []
    component.prompt = component.report = said.append
    on = PortBench(component)
    on.period(5)
    assert said == [USAGE]
    component.typed("goal 1 0 90")
    on.period(5)
    on.feed("status", FINISH)
    on.period(5)
    assert said[1:] == ["goal 1.000 0.000 m, 90.0 deg", "FINISH", USAGE]


def test_after_the_end_it_takes_commands_again_once_it_is_reset() -> None:
    on = bench()
    on.component.typed("end")
    with pytest.raises(ValueError, match="PositionInput0 has ended; reset it, then activate it"):
        on.component.typed("goal 1 0 0")
    on.period(2)
    assert on.state == "ERROR"
    on.manager.reset("PositionInput0")
    on.period()
    on.activate()
    on.component.typed("goal 1 0 0")
    on.period(3)
    assert (on.state, len(on.taken("position"))) == ("ACTIVE", 1)
