"""What happens to a cart on its way: each with a documented result (docs/rh3.md)."""

from __future__ import annotations

from math import hypot, nan

import pytest

from tests.host.motion.port_bench import at
from tickrig.device.rh3.parameters import BaseParameters
from tickrig.emulators.rh3.cart.closed_loop import ClosedLoop
from tickrig.host.motion.components.ref_hard import RefHardRh3
from tickrig.host.motion.geometry import Pose
from tickrig.host.rtc import OutPort
from tickrig.host.rtc.ports.connect import connect
from tickrig.wire.rh3 import Status
from tickrig.wire.rtc_types import iis

AHEAD = Pose(1.0)
NEAR = 0.040
"""m: what the faithful set keeps to."""


class Ride:
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
        return finished and self.cart.truth.distance(goal) < NEAR

    @property
    def moves(self) -> bool:
        return hypot(self.speed_m_s, self.cart.base.ground.turn_rad_s) > 0.005

    @property
    def speed_m_s(self) -> float:
        return self.cart.base.ground.speed_m_s

    def state(self, component: str = "RefHardRh3") -> str:
        return self.loop.manager.state_of(component).name

    def restart(self) -> None:
        """Reset and activate what is in Error."""
        self.loop.manager.reset("RefHardRh3")
        self.run(0.02)
        self.loop.manager.activate("RefHardRh3")


def test_a_new_goal_takes_the_place_of_the_old_one_without_a_stop() -> None:
    ride = Ride()
    ride.entered.replace(Pose(2.0))
    ride.run(0.5)
    assert ride.speed_m_s > 0.25
    assert ride.arrives(Pose(2.0))
    assert ride.entered.finished == 1


def test_a_path_takes_the_place_of_a_goal() -> None:
    ride = Ride()
    ride.entered.replace(Pose(1.5), Pose(1.5, 1.0), Pose(1.0, 1.0))
    assert ride.arrives(Pose(1.0, 1.0), timeout_s=60.0)


def test_a_goal_entered_in_motion_waits() -> None:
    ride = Ride()
    ride.entered.goal(Pose(0.5))
    ride.loop.run_until(lambda: ride.entered.finished == 1, 20_000_000)
    assert ride.cart.truth.distance(AHEAD) < NEAR
    ride.loop.run_until(lambda: ride.entered.finished == 2, 60_000_000)
    assert ride.cart.truth.distance(Pose(0.5)) < NEAR


def test_the_present_pose_as_goal_is_finished_at_once() -> None:
    """It turns for a period, as the state machine has it; goal_angle is 0.02 rad."""
    ride = Ride(Pose(), drive_us=300_000)
    assert ride.entered.finished == 1
    ride.run(0.5)
    assert not ride.moves
    assert ride.cart.truth == pytest.approx((0.0, 0.0, 0.0), abs=0.02)


def test_a_goal_that_is_no_number_changes_nothing() -> None:
    ride = Ride()
    goal = OutPort("goal", iis.TimedPose2D)
    connect(goal, ride.chain.omni_to_2wd.goal)
    goal.write(at(nan, 1.0))
    assert ride.arrives(AHEAD)
    assert ride.chain.omni_to_2wd.refused == 1


def test_an_empty_list_stops_the_cart() -> None:
    ride = Ride()
    path = OutPort("path", iis.TimedPath2DSeq)
    connect(path, ride.chain.navigation.min_path)
    path.write(iis.TimedPath2DSeq())
    ride.run(2.0)
    assert not ride.moves
    assert ride.cart.truth.x < 0.9
    assert ride.entered.finished == 1


def test_an_unreachable_speed_is_the_highest_there_is() -> None:
    """10 rad/s at the wheels: 0.995 m/s over the ground."""
    ride = Ride(Pose(8.0), drive_us=0)
    ride.chain.navigation.configuration.set("max_vel", "5.0")
    ride.chain.path_follower.configuration.set("max_v", "5.0")
    speeds = []
    for _ in range(100):
        ride.run(0.1)
        speeds.append(ride.speed_m_s)
    assert max(speeds) == pytest.approx(0.995, abs=0.01)
    assert not ride.cart.base.status & Status.CLIPPED


def test_a_cut_line_stops_the_cart_and_it_goes_on_when_it_is_restored() -> None:
    ride = Ride()
    ride.cart.port.arm("cut")
    ride.run(0.4)
    assert ride.state() == "ERROR"
    ride.run(1.0)
    assert not ride.moves
    assert ride.cart.base.status & Status.WATCHDOG
    ride.cart.port.clear("cut")
    ride.restart()
    assert ride.arrives(AHEAD)


def test_a_fault_of_the_base_stops_the_cart_until_it_is_cleared() -> None:
    ride = Ride()
    ride.cart.base.inputs.set("emergency_stop", 1)
    ride.run(1.0)
    assert (ride.state(), ride.moves) == ("ERROR", False)
    ride.cart.base.inputs.set("emergency_stop", 0)
    ride.restart()
    assert ride.arrives(AHEAD)


def test_a_loss_of_power_costs_no_more_than_the_way_it_rolled_on() -> None:
    ride = Ride()
    ride.cart.base.inputs.set("power_cut", 1)
    ride.run(1.0)
    ride.cart.base.inputs.set("power_cut", 0)
    ride.restart()
    assert ride.arrives(AHEAD)


def test_the_bumper_holds_the_cart() -> None:
    ride = Ride()
    ride.cart.base.inputs.set("bumper", 1)
    ride.run(1.0)
    assert (ride.state(), ride.moves) == ("ACTIVE", False)
    ride.cart.base.inputs.set("bumper", 0)
    assert ride.arrives(AHEAD)


def test_stop_holds_the_cart_until_go() -> None:
    ride = Ride()
    ref_hard: RefHardRh3 = ride.chain.ref_hard
    ref_hard.Stop()
    ride.run(3.0)
    assert not ride.moves
    ref_hard.Go()
    assert ride.arrives(AHEAD)


def test_deactivation_stops_the_cart() -> None:
    ride = Ride()
    ride.chain.deactivate()
    ride.run(1.0)
    assert not ride.moves


def test_a_dead_host_stops_the_cart() -> None:
    ride = Ride()
    ride.loop.rig.run_for(1_000_000)  # nobody runs the components
    assert not ride.moves
    assert ride.cart.base.status & Status.WATCHDOG


def test_deactivate_and_activate_sets_the_odometry_to_its_initial_pose() -> None:
    ride = Ride()
    assert ride.arrives(AHEAD)
    odometry = ride.chain.odometry
    ride.loop.manager.deactivate("Odometry")
    ride.run(0.1)
    odometry.configuration.set("initialPose_x", "5.0")
    ride.loop.manager.activate("Odometry")
    ride.run(0.1)
    assert odometry.pose == pytest.approx((5.0, 0.0, 0.0))
    ride.entered.replace(Pose(6.0))
    ride.loop.run_until(lambda: ride.entered.finished == 2, 30_000_000)
    assert ride.cart.truth.x == pytest.approx(2.0, abs=2 * NEAR)


@pytest.mark.parametrize("turned", [0, 1, 3])
def test_the_order_of_activation_does_not_matter(turned: int) -> None:
    loop = ClosedLoop()
    names = [component.instance_name for component in loop.cart.chain.components]
    loop.cart.chain.position_input.goal(Pose(0.3))
    for name in names[turned:] + names[:turned]:
        loop.manager.activate(name)
        loop.run_to(loop.now_us + 100_000)
    assert loop.run_until(lambda: loop.cart.chain.position_input.finished == 1, 20_000_000)
    assert loop.cart.truth.distance(Pose(0.3)) < NEAR


@pytest.mark.parametrize("loss", [0.0, 0.002])
def test_dense_and_sparse_runs_are_the_same(loss: float) -> None:
    ends = []
    for dense in (False, True):
        loop = ClosedLoop(BaseParameters(noise=0.02, friction=0.5), seed=3, dense=dense)
        loop.activate("tuned")
        if loss:
            loop.cart.port.arm("drop", loss)
        loop.cart.chain.position_input.goal(Pose(0.3, 0.1, 0.5))
        loop.run_to(6_000_000)
        ends.append((loop.cart.truth, loop.cart.chain.odometry.pose, loop.cart.base.read("served")))
    assert ends[0] == ends[1]
