"""The state machine of the reference hardware's navigation (rh3-control, state machine)."""

from __future__ import annotations

from math import nan, pi

import pytest

from tests.host.rtc.motion.port_bench import PortBench, at, way
from tickrig.host.rtc.motion.components.navigation import Navigation
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.host.rtc.motion.ports import NavigationState as State
from tickrig.host.rtc.motion.ports import RunMode
from tickrig.wire.rtc_types.rtc import Path

HERE, STEP, GOAL = Pose(), Pose(2.0, 0.0, 0.0), Pose(2.0, 0.0, 1.0)


class Judged:
    """A navigation that judges a pose each period."""

    def __init__(self, set_id: str = "default", **settings: str) -> None:
        self.on = PortBench(Navigation("Navigation0"), **settings)
        self.on.component.configuration.activate(set_id)

    def start(self, *relays: Pose, here: Pose = HERE) -> list[str]:
        """Give a list and judge a first pose."""
        self.on.feed("min_path", way(*relays))
        return self.judge(here)

    def judge(self, *poses: Pose) -> list[str]:
        """Return what was published and the state after each pose."""
        out: list[str] = []
        for pose in poses:
            self.on.feed("position", at(*pose))
            self.on.period()
            out += [shown(path) for path in self.on.taken("path")]
            out += [State(self.on.taken("status")[-1].data).name]
        return out


def shown(path: Path) -> str:
    match path.type:
        case RunMode.SPIN:
            return f"SPIN {path.theta:g} w={path.w:g}"
        case RunMode.LINEFOLLOW:
            return f"LINE {path.x:g},{path.y:g} v={path.v:.3g}"
        case _:
            return RunMode(path.type).name


def test_a_whole_way_is_turned_driven_and_turned() -> None:
    by = Judged()
    north = Pose(0.0, 0.0, pi / 2), Pose(0.0, 2.0, pi / 2)
    assert by.start(Pose(9.0, 9.0), *north, Pose(0.0, 2.0, 0.0)) == ["GOAL_CHECK"]
    assert by.judge(Pose()) == ["STOP", "ANGLE_CHECK"]
    assert by.judge(Pose()) == ["SPIN 1.5708 w=1", "TURNING"]
    assert by.judge(Pose(0, 0, 1.4)) == ["TURNING"]
    assert by.judge(Pose(0, 0, 1.42)) == ["GOAL_CHECK"]  # pi/20 is 0.157
    assert by.judge(Pose(0, 0, 1.5)) == ["STOP", "ANGLE_CHECK"]
    assert by.judge(Pose(0, 0, 1.5)) == ["GOAL_CHECK"]
    assert by.judge(Pose(0, 0, 1.5)) == ["LINE 0,2 v=0.3", "SPEED_DOWN"]
    assert by.judge(Pose(0, 1.49, pi / 2)) == ["SPEED_DOWN"]
    assert by.judge(Pose(0, 1.51, pi / 2)) == ["LINE 0,2 v=0.1", "STOPPING"]
    assert by.judge(Pose(0, 1.99, pi / 2)) == ["STOPPING"]
    assert by.judge(Pose(0, 2.01, pi / 2)) == ["STOP", "ANGLE_CHECK"]
    assert by.judge(Pose(0, 2.01, pi / 2)) == ["SPIN 0 w=1", "TURNING2"]
    assert by.judge(Pose(0, 2.01, 0.021)) == ["TURNING2"]
    assert by.judge(Pose(0, 2.01, 0.019)) == ["STOP", "FINISH"]
    assert by.judge(Pose(0, 2.01, 3.0)) == ["FINISH"]


@pytest.mark.parametrize(("heading", "state"), [(0.52, "GOAL_CHECK"), (0.53, "TURNING")])
def test_up_to_30_degrees_off_it_drives_at_once(heading: float, state: str) -> None:
    by = Judged()
    by.start(Pose(), STEP, GOAL)
    by.judge(Pose())
    assert by.judge(Pose(0, 0, heading))[-1] == state


@pytest.mark.parametrize(("x", "state"), [(1.94, "SPEED_DOWN"), (1.96, "ANGLE_CHECK")])
def test_a_relay_point_within_5_cm_is_reached(x: float, state: str) -> None:
    by = Judged()
    by.start(Pose(), STEP, GOAL, here=Pose(x))
    by.judge(Pose(x), Pose(x))
    assert by.judge(Pose(x))[-1] == state


def test_the_last_element_is_turned_to_and_never_driven_to() -> None:
    by = Judged()
    assert by.start(Pose(), Pose(5.0, 5.0, 1.0)) == ["GOAL_CHECK"]
    by.judge(Pose())
    assert by.judge(Pose()) == ["SPIN 1 w=1", "TURNING2"]


def test_the_goal_where_the_cart_stands_is_finished_at_once() -> None:
    by = Judged()
    by.start(Pose(), Pose())
    assert by.judge(Pose(), Pose(), Pose())[-2:] == ["STOP", "FINISH"]


def test_the_first_element_is_where_the_cart_is() -> None:
    by = Judged()
    assert by.start(Pose(7.0, 7.0, 3.0), STEP, GOAL) == ["GOAL_CHECK"]


def test_a_new_list_takes_the_place_of_the_old_one_without_a_stop() -> None:
    by = Judged()
    by.start(Pose(), STEP, GOAL)
    by.judge(*[Pose()] * 4)
    assert by.on.component.state is State.SPEED_DOWN
    assert by.start(Pose(), Pose(0.0, 5.0, 1.5), GOAL, here=Pose(0.5)) == ["GOAL_CHECK"]


def test_of_several_lists_the_newest_counts() -> None:
    by = Judged()
    by.on.feed("min_path", way(Pose(), STEP, GOAL))
    by.start(Pose(), Pose(0, 0, 2.0))
    assert by.judge(Pose(), Pose())[-2:] == ["SPIN 2 w=1", "TURNING2"]


def test_an_empty_list_means_stop_and_finish() -> None:
    by = Judged()
    by.start(Pose(), STEP, GOAL)
    by.judge(*[Pose()] * 3)
    assert by.start() == ["STOP", "FINISH"]
    assert by.judge(Pose(), Pose()) == ["FINISH", "FINISH"]


def test_a_list_of_the_start_alone_moves_nothing() -> None:
    by = Judged()
    by.start(Pose(0, 0, 0))
    assert by.judge(Pose(0, 0, 0))[-1] == "FINISH"


def test_a_list_with_a_number_that_is_none_changes_nothing() -> None:
    by = Judged()
    by.start(Pose(), STEP, GOAL)
    by.judge(*[Pose()] * 3)
    assert by.start(Pose(), Pose(nan), here=Pose(0.1)) == ["SPEED_DOWN"]


def test_a_pose_with_a_number_that_is_none_is_not_judged() -> None:
    by = Judged()
    by.start(Pose(), STEP, GOAL)
    assert by.judge(Pose(nan)) == ["GOAL_CHECK"]


def test_without_a_new_pose_nothing_is_judged_and_the_state_is_told() -> None:
    by = Judged()
    by.on.feed("min_path", way(Pose(), STEP, GOAL))
    by.on.taken("status")
    by.on.period(3)
    assert [status.data for status in by.on.taken("status")] == [State.ANGLE_CHECK] * 3
    assert by.on.taken("path") == []


def test_before_a_list_the_state_is_finish() -> None:
    assert Judged().judge(Pose()) == ["FINISH"]


def test_activation_forgets_the_list() -> None:
    by = Judged()
    by.start(Pose(), STEP, GOAL)
    by.on.deactivate()
    by.on.activate()
    assert by.judge(Pose()) == ["FINISH"]


def test_max_vel_and_judge_radius_come_from_the_configuration() -> None:
    by = Judged(max_vel="0.2", judge_radius="1.0")
    by.start(Pose(), STEP, GOAL)
    assert by.judge(*[Pose()] * 3)[-2:] == ["LINE 2,0 v=0.2", "SPEED_DOWN"]
    assert by.judge(Pose(1.01)) == ["LINE 2,0 v=0.1", "STOPPING"]


def test_the_tuned_set_aligns_before_it_drives() -> None:
    by = Judged("tuned")
    by.start(Pose(), STEP, GOAL)
    assert by.judge(Pose(), Pose(0, 0, 0.02))[-1] == "TURNING"


def test_the_tuned_set_brakes_so_that_it_can_stop_at_the_line() -> None:
    by = Judged("tuned")
    by.start(Pose(), STEP, GOAL)
    by.judge(*[Pose()] * 2)
    assert by.judge(Pose(0), Pose(1.0), Pose(1.9), Pose(1.99), Pose(1.9985)) == [
        *("LINE 2,0 v=0.3", "SPEED_DOWN"),
        *("LINE 2,0 v=0.3", "SPEED_DOWN"),
        *("LINE 2,0 v=0.188", "SPEED_DOWN"),  # sqrt(2 * 0.24 * (0.1 - 0.002 - 0.3 * 0.08))
        *("LINE 2,0 v=0.01", "SPEED_DOWN"),
        *("STOP", "ANGLE_CHECK"),
    ]
