"""What happens to a cart on its way: each with a documented result (docs/reference/rtc/rh3.md)."""

from __future__ import annotations

from math import hypot, nan

import pytest

from tests.host.rtc.motion.port_bench import at
from tickrig.device.rh3.parameters import BaseParameters
from tickrig.emulators.rh3.closed_loop import ClosedLoop
from tickrig.host.rtc import OutPort
from tickrig.host.rtc.motion.components.ref_hard import RefHardRh3
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.host.rtc.ports.connect import connect
from tickrig.wire.modbus import Status
from tickrig.wire.rtc_types import iis

AHEAD = Pose(1.0)
NEAR = 0.040
"""m: what the faithful set keeps to."""


class DrivenCart:
    """A cart that has a goal a metre ahead and is on its way."""

    def __init__(self, goal: Pose = AHEAD, drive_us: int = 2_500_000) -> None:
        self.loop = ClosedLoop()
        self.cart, self.chain = self.loop.cart, self.loop.cart.chain
        self.loop.activate()
        self.run(0.1)
        self.entered = self.chain.position_input
        self.entered.goal(goal)
        self.loop.run_to(self.loop.now_us + drive_us)

    def run(self, duration_s: float) -> None:
        self.loop.run_to(self.loop.now_us + round(duration_s * 1e6))

    def arrives(self, goal: Pose, timeout_s: float = 30.0) -> bool:
        finished = self.loop.run_until(lambda: self.entered.finished > 0, round(timeout_s * 1e6))
        self.run(1.0)
        return finished and self.cart.true_pose.distance(goal) < NEAR

    @property
    def moves(self) -> bool:
        return hypot(self.speed_m_s, self.cart.base.ground.turn_rad_s) > 0.005

    @property
    def speed_m_s(self) -> float:
        return self.cart.base.ground.speed_m_s

    def state(self, component: str = "RefHardRh30") -> str:
        return self.loop.manager.state_of(component).name

    def restart(self) -> None:
        """Reset and activate what is in Error."""
        self.loop.manager.reset("RefHardRh30")
        self.run(0.02)
        self.loop.manager.activate("RefHardRh30")


def test_a_new_goal_takes_the_place_of_the_old_one_without_a_stop() -> None:
    driven = DrivenCart()
    driven.entered.replace(Pose(2.0))
    driven.run(0.5)
    assert driven.speed_m_s > 0.25
    assert driven.arrives(Pose(2.0))
    assert driven.entered.finished == 1


def test_a_path_takes_the_place_of_a_goal() -> None:
    driven = DrivenCart()
    driven.entered.replace(Pose(1.5), Pose(1.5, 1.0), Pose(1.0, 1.0))
    assert driven.arrives(Pose(1.0, 1.0), timeout_s=60.0)


def test_a_goal_entered_in_motion_waits() -> None:
    driven = DrivenCart()
    driven.entered.goal(Pose(0.5))
    driven.loop.run_until(lambda: driven.entered.finished == 1, 20_000_000)
    assert driven.cart.true_pose.distance(AHEAD) < NEAR
    driven.loop.run_until(lambda: driven.entered.finished == 2, 60_000_000)
    assert driven.cart.true_pose.distance(Pose(0.5)) < NEAR


def test_the_present_pose_as_goal_is_finished_at_once() -> None:
    """It turns for a period, as the state machine has it; goal_angle is 0.02 rad."""
    driven = DrivenCart(Pose(), drive_us=300_000)
    assert driven.entered.finished == 1
    driven.run(0.5)
    assert not driven.moves
    assert driven.cart.true_pose == pytest.approx((0.0, 0.0, 0.0), abs=0.02)


def test_a_goal_that_is_no_number_changes_nothing() -> None:
    driven = DrivenCart()
    goal = OutPort("goal", iis.TimedPose2D)
    connect(goal, driven.chain.omni_to_2wd.goal)
    goal.write(at(nan, 1.0))
    assert driven.arrives(AHEAD)
    assert driven.chain.omni_to_2wd.refused == 1


def test_an_empty_list_stops_the_cart() -> None:
    driven = DrivenCart()
    path = OutPort("path", iis.TimedPath2DSeq)
    connect(path, driven.chain.navigation.min_path)
    path.write(iis.TimedPath2DSeq())
    driven.run(2.0)
    assert not driven.moves
    assert driven.cart.true_pose.x < 0.9
    assert driven.entered.finished == 1


def test_an_unreachable_speed_is_the_highest_there_is() -> None:
    """10 rad/s at the wheels: 0.995 m/s over the ground."""
    driven = DrivenCart(Pose(8.0), drive_us=0)
    driven.chain.navigation.configuration.set("max_vel", "5.0")
    driven.chain.path_follower.configuration.set("max_v", "5.0")
    speeds = []
    for _ in range(100):
        driven.run(0.1)
        speeds.append(driven.speed_m_s)
    assert max(speeds) == pytest.approx(0.995, abs=0.01)
    assert not driven.cart.base.status & Status.CLIPPED


def test_a_cut_line_stops_the_cart_and_it_goes_on_when_it_is_restored() -> None:
    driven = DrivenCart()
    driven.cart.port.arm("cut")
    driven.run(0.4)
    assert driven.state() == "ERROR"
    driven.run(1.0)
    assert not driven.moves
    assert driven.cart.base.status & Status.WATCHDOG
    driven.cart.port.clear("cut")
    driven.restart()
    assert driven.arrives(AHEAD)


def test_a_fault_of_the_base_stops_the_cart_until_it_is_cleared() -> None:
    driven = DrivenCart()
    driven.cart.base.inputs.set("emergency_stop", 1)
    driven.run(1.0)
    assert (driven.state(), driven.moves) == ("ERROR", False)
    driven.cart.base.inputs.set("emergency_stop", 0)
    driven.restart()
    assert driven.arrives(AHEAD)


def test_a_loss_of_power_costs_no_more_than_the_way_it_rolled_on() -> None:
    driven = DrivenCart()
    driven.cart.base.inputs.set("power_cut", 1)
    driven.run(1.0)
    driven.cart.base.inputs.set("power_cut", 0)
    driven.restart()
    assert driven.arrives(AHEAD)


def test_the_bumper_holds_the_cart() -> None:
    driven = DrivenCart()
    driven.cart.base.inputs.set("bumper", 1)
    driven.run(1.0)
    assert (driven.state(), driven.moves) == ("ACTIVE", False)
    driven.cart.base.inputs.set("bumper", 0)
    assert driven.arrives(AHEAD)


def test_stop_holds_the_cart_until_go() -> None:
    driven = DrivenCart()
    ref_hard: RefHardRh3 = driven.chain.ref_hard
    ref_hard.Stop()
    driven.run(3.0)
    assert not driven.moves
    ref_hard.Go()
    assert driven.arrives(AHEAD)


def test_deactivation_stops_the_cart() -> None:
    driven = DrivenCart()
    driven.chain.deactivate()
    driven.run(1.0)
    assert not driven.moves


def test_a_dead_host_stops_the_cart() -> None:
    driven = DrivenCart()
    driven.loop.rig.run_for(1_000_000)  # nobody runs the components
    assert not driven.moves
    assert driven.cart.base.status & Status.WATCHDOG


def test_deactivate_and_activate_sets_the_odometry_to_its_initial_pose() -> None:
    driven = DrivenCart()
    assert driven.arrives(AHEAD)
    odometry = driven.chain.odometry
    driven.loop.manager.deactivate("Odometry0")
    driven.run(0.1)
    odometry.configuration.set("initialPose_x", "5.0")
    driven.loop.manager.activate("Odometry0")
    driven.run(0.1)
    assert odometry.pose == pytest.approx((5.0, 0.0, 0.0))
    driven.entered.replace(Pose(6.0))
    driven.loop.run_until(lambda: driven.entered.finished == 2, 30_000_000)
    assert driven.cart.true_pose.x == pytest.approx(2.0, abs=2 * NEAR)


@pytest.mark.parametrize("turned", [0, 1, 3])
def test_the_order_of_activation_does_not_matter(turned: int) -> None:
    loop = ClosedLoop()
    names = [component.instance_name for component in loop.cart.chain.components]
    loop.cart.chain.position_input.goal(Pose(0.3))
    for name in names[turned:] + names[:turned]:
        loop.manager.activate(name)
        loop.run_to(loop.now_us + 100_000)
    assert loop.run_until(lambda: loop.cart.chain.position_input.finished == 1, 20_000_000)
    assert loop.cart.true_pose.distance(Pose(0.3)) < NEAR


@pytest.mark.parametrize("loss", [0.0, 0.002])
def test_dense_and_sparse_runs_are_the_same(loss: float) -> None:
    ends = []
    for dense in (False, True):
        loop = ClosedLoop(BaseParameters(noise=0.02, friction=0.5), seed=3, dense=dense)
        loop.activate("tuned")
        if loss:
            loop.cart.port.arm("drop", str(loss))
        loop.cart.chain.position_input.goal(Pose(0.3, 0.1, 0.5))
        loop.run_to(6_000_000)
        ends.append(
            (loop.cart.true_pose, loop.cart.chain.odometry.pose, loop.cart.base.read("served"))
        )
    assert ends[0] == ends[1]
