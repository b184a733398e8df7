from __future__ import annotations

from math import inf, nan

import pytest

from tests.host.motion.port_bench import PortBench, at
from tickrig.host.motion.components.position_input import PositionInput
from tickrig.host.motion.geometry import Pose
from tickrig.wire.rtc_types.basic import TimedState
from tickrig.wire.rtc_types.rh2 import NavigationState

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
