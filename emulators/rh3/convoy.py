"""Robots in one map frame: carts on two wheels and on omni wheels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Final

from tickrig.device.body import OmniBody, OmniParameters, Velocity
from tickrig.device.body import Pose as BodyPose
from tickrig.device.rh3.parameters import BaseParameters
from tickrig.emulators.rh3.closed_loop import Cart, ClosedLoop
from tickrig.host.control.clock import RealClock
from tickrig.host.rtc import ExecutionContext, InPort, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.host.rtc.motion.options.follower import Follower
from tickrig.host.rtc.motion.ports import plausible, read_newest, to_pose_2d, write_velocity
from tickrig.wire.rtc_types import iis, rtc
from tickrig.wire.rtc_types.rtc import Time

_WIDE: Final = {"dataport.buffer.length": "64"}
_STEP_US: Final = 1_000

_WATCHDOG_US: Final = 500_000
"""Silence after which the cart stops, as a cart on two wheels does."""


class OmniCart(RtComponent):
    """RT component that emulates a robot on three omni wheels.

    The robot follows velocities of the type IIS::TimedVelocity2D, which have three parts: forward,
    left and turning. The component writes the true pose of the robot. A velocity with NaN stops the
    robot. A motor driver, its serial line, encoders and odometry errors are not emulated.

    Attributes:
        body: the emulated wheels and their pose.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("OmniCart", "Robot on three omni wheels, emulated")

    def __init__(self, instance_name: str, parameters: OmniParameters | None = None) -> None:
        super().__init__(instance_name)
        self.velocity = self.add_port(InPort("InTargetVelocity", iis.TimedVelocity2D))
        self.position = self.add_port(OutPort("OdometryPosition", iis.TimedPose2D))
        self.body = OmniBody(parameters or OmniParameters())
        self._wanted, self._received_us = Velocity(), 0

    @property
    def true_pose(self) -> Pose:
        """Pose of the robot."""
        pose = self.body.pose
        return Pose(pose.x_m, pose.y_m, pose.wrapped_rad)

    def place(self, pose: Pose) -> None:
        """Set the pose."""
        self.body.pose = BodyPose(*pose)

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Start at standstill."""
        self._wanted = Velocity()
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Run one period."""
        if (latest := read_newest(self.velocity)) is not None:
            numbers = (latest.data.vx, latest.data.vy, latest.data.va)
            self._wanted = Velocity(*numbers) if plausible(*numbers) else Velocity()
            self._received_us = ec.now_us
        elif ec.now_us - self._received_us > _WATCHDOG_US:
            self._wanted = Velocity()
        for _ in range(ec.period_us // _STEP_US):
            self.body.step(self._wanted)
        now = Time.from_us(ec.now_us)
        self.position.write(iis.TimedPose2D(now, data=to_pose_2d(self.true_pose)))
        return ReturnCode.RTC_OK


class MovingControl(RtComponent):
    """RT component that drives a base by a joystick, and stops it when the joystick stops sending.

    The component RefHardRh3, which drives the base, keeps the latest velocity. Without
    MovingControl the base would therefore continue to move if the connector to the joystick were
    removed while the stick is pushed.

    Args:
        instance_name: instance name of the component.
        phase: phase (version) of the common interface. In phase 1 velocities have the type
            RTC::TimedVelocity, and in phase 2 the type IIS::TimedVelocity.

    Attributes:
        twist: latest velocity forward and to the left in m/s, and turning rate in rad/s, or None
            while no command arrives.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("MovingControl", "Takes IIS velocities, phase 1 or 2")

    def __init__(self, instance_name: str, phase: int = 2) -> None:
        super().__init__(instance_name)
        self._first: InPort[rtc.TimedVelocity] | None = None
        self._second: InPort[iis.TimedVelocity] | None = None
        if phase == 1:
            self._first = self.add_port(InPort("in", rtc.TimedVelocity))
        else:
            self._second = self.add_port(InPort("in", iis.TimedVelocity))
        self._velocity = self.add_port(OutPort("out", iis.TimedVelocity2D))
        self.twist: tuple[float, float, float] | None = None
        self._received_us = 0

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Forward the latest command."""
        if (latest := self._newest()) is not None:
            self.twist, self._received_us = latest, ec.now_us
            write_velocity(self._velocity, ec, *latest)
        elif self.twist is not None and ec.now_us - self._received_us > _WATCHDOG_US:
            self.twist = None
            write_velocity(self._velocity, ec, 0.0, 0.0, 0.0)
        return ReturnCode.RTC_OK

    def _newest(self) -> tuple[float, float, float] | None:
        if self._first is not None and (first := read_newest(self._first)) is not None:
            return first.v, 0.0, first.w
        if self._second is not None and (second := read_newest(self._second)) is not None:
            return second.vx, second.vy, second.w
        return None


@dataclass(frozen=True, slots=True)
class _Robot:
    """A robot of a convoy, with the names of its ports.

    Attributes:
        position: port of the robot's self-position.
        velocity: port of the robot's velocity command.
        cart: the cart with the true pose.
        sideways: whether the robot can move in any direction.
    """

    position: str
    velocity: str
    cart: Cart | OmniCart
    sideways: bool = False

    @property
    def true_pose(self) -> Pose:
        """Pose of the robot."""
        return self.cart.true_pose


class Convoy:
    """Several emulated robots that drive one behind the other, with poses in one map frame.

    Only the first robot has a connected planner, the component `PathFollower0`, which drives it
    along paths. Each other robot follows the commands that arrive at its ports.

    Args:
        carts: initial poses of the robots on two wheels.
        omni: initial poses of the robots on omni wheels.
        clock: clock of a convoy in real time, or None for virtual time.

    Attributes:
        loop: carts, their serial lines and the manager of their RT components.
        robots: all robots. The carts come first.
    """

    def __init__(
        self, carts: Sequence[Pose], omni: Sequence[Pose] = (), clock: RealClock | None = None
    ) -> None:
        pace = None if clock is None else 1.0
        self.loop = ClosedLoop(*[BaseParameters() for _ in carts], pace=pace, clock=clock)
        self.robots = (
            *(self._cart(n, pose) for n, pose in enumerate(carts)),
            *(self._omni_cart(n, pose) for n, pose in enumerate(omni)),
        )
        self._leaders: dict[int, int] = {}

    def follow(self, robot: int, leader: int) -> None:
        """Let a robot follow another leader from now on."""
        manager, name = self.loop.manager, f"Follower{robot}"
        if robot not in self._leaders:
            self._add_follower(robot, name)
        else:
            before = self.robots[self._leaders[robot]]
            manager.disconnect(before.position, f"{name}.leader")
        manager.connect(self.robots[leader].position, f"{name}.leader", _WIDE)
        self._leaders[robot] = leader

    def command(self, source: str) -> None:
        """Drive all robots by one OutPort of IIS velocities instead of their planners."""
        manager = self.loop.manager
        manager.disconnect("PathFollower0.velocity", self.robots[0].velocity)
        for robot in self.robots:
            manager.connect(source, robot.velocity, _WIDE)

    def _add_follower(self, robot: int, name: str) -> None:
        manager, own = self.loop.manager, self.robots[robot]
        follower = Follower(name)
        follower.configuration.set("sideways", str(int(own.sideways)))
        context = manager.context_of(own.velocity.partition(".")[0])
        manager.add(follower, context=context)
        manager.connect(own.position, f"{name}.position", _WIDE)
        manager.connect(f"{name}.velocity", own.velocity, _WIDE)
        manager.activate(name)

    def _cart(self, number: int, pose: Pose) -> _Robot:
        cart, manager = self.loop.carts[number], self.loop.manager
        place(cart, pose)
        velocity = f"RefHardRh3{number}.InTargetVelocity"
        if number:
            manager.disconnect(f"PathFollower{number}.velocity", velocity)
        return _Robot(f"Odometry{number}.OdometryPosition", velocity, cart)

    def _omni_cart(self, number: int, pose: Pose) -> _Robot:
        name = f"OmniCart{number}"
        cart = self.loop.manager.add(OmniCart(name), rate_hz=50.0)
        cart.place(pose)
        self.loop.manager.activate(name)
        return _Robot(f"{name}.OdometryPosition", f"{name}.InTargetVelocity", cart, sideways=True)


def place(cart: Cart, pose: Pose) -> None:
    """Set the pose of a cart and of its odometry."""
    cart.base.ground.pose = BodyPose(*pose)
    configuration = cart.chain.odometry.configuration
    for name, number in zip(("x", "y", "theta"), pose, strict=True):
        configuration.set(f"initialPose_{name}", repr(number))
