"""A cart with a range finder in a world, closed loop in virtual time."""

from __future__ import annotations

from math import pi

from tickrig.device.rh3.parameters import BaseParameters
from tickrig.device.urg.world import Post, World
from tickrig.emulators.rh3.closed_loop import ClosedLoop
from tickrig.emulators.rh3.convoy import place
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.host.links.game_pad import StickPosition
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.host.rtc.motion.options.game_pad import GamePad
from tickrig.host.rtc.motion.options.obstacles import CollisionGuard
from tickrig.host.rtc.motion.options.switch_input import SwitchInput

SECOND_US = 1_000_000
EMPTY = World()
BLOCKED = EMPTY.with_posts(Post(1.2, 0.1, 0.2))


class Seeing:
    """A cart that looks where it goes."""

    def __init__(self, world: World, *, dense: bool = False) -> None:
        self.loop = ClosedLoop(world=world, dense=dense)
        (self.eye,) = self.loop.range_finders
        line = self.eye.line.b
        self.guard = CollisionGuard(
            self.loop.manager, self.loop.chain, lambda name: SimLink(self.loop.rig, line)
        )
        self.loop.activate("tuned")
        self.guard.activate()
        self.loop.run_to(SECOND_US // 2)

    def run(self, seconds: float) -> Pose:
        self.loop.run_to(self.loop.now_us + round(seconds * SECOND_US))
        return self.loop.pose

    def goal(self, x: float, y: float = 0.0) -> None:
        self.loop.chain.position_input.goal(Pose(x, y, 0.0))

    @property
    def finished(self) -> int:
        return self.loop.chain.position_input.finished


def test_it_stops_before_a_post_and_goes_on_when_that_has_gone() -> None:
    cart = Seeing(BLOCKED)
    cart.goal(1.6)
    waiting = cart.run(5)
    assert waiting == cart.run(0.5)
    assert 0.25 < BLOCKED.clearance_m(waiting.x, waiting.y) < 0.75
    cart.eye.world = EMPTY
    end = cart.run(8)
    assert cart.finished == 1
    assert end.distance(Pose(1.6)) < 0.005


def test_somebody_who_steps_in_its_way_stops_it() -> None:
    cart = Seeing(EMPTY)
    cart.goal(3.0)
    cart.run(1)
    for name, value in (("post_x_m", 1.2), ("post_radius_m", 0.2)):
        cart.eye.urg.inputs.set(name, value)
    waiting = cart.run(4)
    assert waiting.x < 0.8
    cart.eye.urg.inputs.set("post_radius_m", 0.0)
    assert cart.run(2).x > waiting.x + 0.3


def test_without_its_eyes_it_does_not_move() -> None:
    cart = Seeing(EMPTY)
    cart.goal(2.0)
    cart.run(1)
    cart.eye.urg.inputs.set("power_cut", 1)
    stopped = cart.run(2)
    assert cart.run(0.5) == stopped
    cart.eye.urg.inputs.set("power_cut", 0)
    assert cart.run(3).x > stopped.x + 0.3


def test_idle_ticks_of_the_sensor_are_not_visible() -> None:
    ways = []
    for dense in (True, False):
        cart = Seeing(BLOCKED, dense=dense)
        cart.goal(2.0)
        ways.append([cart.run(0.25) for _ in range(6)])
    assert ways[0] == ways[1]


def test_a_cart_waits_until_another_has_left_its_way() -> None:
    loop = ClosedLoop(BaseParameters(), BaseParameters(), world=EMPTY)
    first, second = loop.carts
    place(second, Pose(1.5, 0.0, pi / 2))
    line = loop.range_finders[0].line.b
    guard = CollisionGuard(loop.manager, first.chain, lambda name: SimLink(loop.rig, line))
    loop.activate("tuned")
    guard.activate()
    loop.run_to(SECOND_US // 2)
    first.chain.position_input.goal(Pose(1.8))
    loop.run_to(4 * SECOND_US)
    assert 0.5 < first.true_pose.distance(second.true_pose) < 1.0
    second.chain.position_input.goal(Pose(1.5, 1.0, pi / 2))
    loop.run_to(14 * SECOND_US)
    assert first.true_pose.distance(Pose(1.8)) < 0.005


class Push:
    """A hand that pushes back between two times."""

    def poll(self, now_us: int, /) -> StickPosition:
        return (
            StickPosition(forward=-1.0)
            if 3 * SECOND_US < now_us < 4 * SECOND_US
            else StickPosition()
        )

    def close(self) -> None:
        """Nothing is open."""


def test_a_hand_takes_the_cart_over_and_the_planner_finishes() -> None:
    loop = ClosedLoop()
    manager, context = loop.manager, loop.chain.context
    manager.add(GamePad("GamePad0", lambda name: Push()), context=context)
    manager.add(SwitchInput("SwitchInputRTC0"), context=context)
    base = "RefHardRh30.InTargetVelocity"
    manager.disconnect("PathFollower0.velocity", base)
    manager.connect("GamePad0.velocity", "SwitchInputRTC0.joystick")
    manager.connect("PathFollower0.velocity", "SwitchInputRTC0.automatic")
    manager.connect("SwitchInputRTC0.velocity", base)
    loop.activate("tuned")
    manager.activate("GamePad0", "SwitchInputRTC0")
    loop.run_to(SECOND_US // 2)
    loop.chain.position_input.goal(Pose(1.0))
    loop.run_to(3 * SECOND_US)
    before = loop.pose.x
    loop.run_to(4 * SECOND_US)
    assert loop.pose.x < before - 0.1
    loop.run_to(14 * SECOND_US)
    assert loop.chain.position_input.finished == 1
    assert loop.pose.distance(Pose(1.0)) < 0.005
