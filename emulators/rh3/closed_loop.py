"""Carts of Reference Hardware 3 in virtual time: components, line and base, closed loop."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import cos, sin
from typing import Any, Final, Protocol

from tickrig.device.rh3.base import LOOK_US, Rh3Base
from tickrig.device.rh3.parameters import BaseParameters
from tickrig.device.urg.sensor import Urg
from tickrig.device.urg.world import Post, World
from tickrig.emulators.rig.faults import FaultyPort
from tickrig.emulators.rig.rig import Coupling, Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.byte_faults import BYTE_FAULTS
from tickrig.emulators.serial.rs485_line import Rs485Line
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.control.clock import RealClock
from tickrig.host.rtc import Manager
from tickrig.host.rtc.motion.chain import MotionChain
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.wire.instant import NEVER

_BAUD: Final = 115_200
_USB_BAUD: Final = 12_000_000

_AHEAD_M: Final = 0.2
"""Distance from the middle of the axle to the sensor, which is an arbitrary choice."""

_OUTLINE_M: Final = 0.25
"""Radius of the post by which other robots see a robot, which is an arbitrary choice."""

PLACE: Final = ("x_m", "y_m", "heading_rad")


class Mounted:
    """An object carried by a base, as a coupling of the rig."""

    tick_us: Final = LOOK_US  # the update period of the base's outputs
    due_us: Final = NEVER  # a moving base has work itself


class MountedUrg(Mounted):
    """An emulated URG range finder mounted on a robot base, in front of the axle.

    The sensor moves with the base and sees the surroundings and other robots. The sensor does not
    see the robot's own body, and it sees every other robot as a circle.

    Args:
        base: base that carries the sensor.
        world: surroundings that the sensor sees.
        others: bases of other robots that the sensor sees.

    Attributes:
        urg: the emulated sensor.
        line: serial line of the sensor. Its end `b` is the host's end.
        world: surroundings that the sensor sees, which may be changed.
    """

    def __init__(self, base: Rh3Base, world: World, others: Sequence[Rh3Base] = ()) -> None:
        self._base, self._others, self.world = base, tuple(others), world
        self.urg, self.line = Urg(world=world), SerialLine(_USB_BAUD)

    def act(self, now_us: int, /) -> None:
        """Move the sensor with the base, and update the positions of other robots."""
        read, inputs = self._base.read, self.urg.inputs
        x_m, y_m, heading = read("x_m"), read("y_m"), read("heading_rad")
        place = (x_m + _AHEAD_M * cos(heading), y_m + _AHEAD_M * sin(heading), heading)
        for name, value in zip(PLACE, place, strict=True):
            if inputs[name] != value:
                inputs.set(name, value)
        posts = [Post(base.read("x_m"), base.read("y_m"), _OUTLINE_M) for base in self._others]
        self.urg.world = self.world.with_posts(*posts) if posts else self.world


class _Aboard(Coupling, Protocol):
    """An object carried by a cart, as a coupling of the rig."""

    @property
    def station(self) -> Station[bytes]:
        """The station of the object."""
        ...


@dataclass(frozen=True, slots=True)
class Cart:
    """An emulated Reference Hardware 3 base with the RT components that drive it.

    Attributes:
        base: the emulated base.
        chain: RT components that drive the base.
        port: port of the base, on which faults of its serial line are armed.
    """

    base: Rh3Base
    chain: MotionChain
    port: FaultyPort[bytes]

    @property
    def true_pose(self) -> Pose:
        """Pose of the cart."""
        pose = self.base.ground.pose
        return Pose(pose.x_m, pose.y_m, pose.wrapped_rad)


class ClosedLoop:
    """Carts, their lines and one manager, advanced together.

    Args:
        parameters: the parameters of each base.
        seed: seed of random wire faults.
        dense: whether to run every tick of every base.
        world: surroundings of the carts. If they are given, each cart carries a range finder that
            sees them.
        aboard: function that makes further loads of the first cart.
        pace: ratio of the loop's time to real time, or None to run as fast as possible.
        clock: clock for waiting, if a pace is given.

    Attributes:
        rig: rig with the bases on their lines.
        manager: manager of the components.
        carts: carts in the order of the parameters.
        cart: the first cart.
        chain: the components of the first cart.
        range_finders: range finders, in the order of the carts.
    """

    def __init__(  # noqa: PLR0913 - what a cart may be like
        self,
        *parameters: BaseParameters,
        seed: int = 0,
        dense: bool = False,
        world: World | None = None,
        aboard: Callable[[Rh3Base], _Aboard] | None = None,
        pace: float | None = None,
        clock: RealClock | None = None,
    ) -> None:
        self._pace, self._clock = pace, clock or RealClock()
        bases = [Rh3Base(each) for each in parameters or (BaseParameters(),)]
        lines = [Rs485Line(_BAUD, bursts=True) for _ in bases]
        ports = [FaultyPort(line.a, BYTE_FAULTS, seed + n) for n, line in enumerate(lines)]
        self.range_finders = _range_finders(bases, world) if world else ()
        stations: list[Station[Any]] = [Station(eye.urg, eye.line.a) for eye in self.range_finders]
        others = () if aboard is None else (aboard(bases[0]),)
        stations += [other.station for other in others]
        couplings = (*self.range_finders, *others)
        self.rig = Rig(*map(Station, bases, ports), *stations, couplings=couplings, dense=dense)
        self.manager = Manager()
        self.carts = tuple(
            Cart(base, MotionChain(self.manager, self._opener(line), n), port)
            for n, (base, line, port) in enumerate(zip(bases, lines, ports, strict=True))
        )
        self.cart = self.carts[0]
        self.chain = self.cart.chain

    @property
    def pose(self) -> Pose:
        """True pose of the first cart."""
        return self.cart.true_pose

    @property
    def now_us(self) -> int:
        """The present time."""
        return self.rig.now_us

    def activate(self, set_id: str = "default") -> None:
        """Activate all components with a configuration set."""
        for cart in self.carts:
            cart.chain.use(set_id)
            cart.chain.activate()

    def run_to(self, t_us: int) -> None:
        """Advance to a time."""
        if self._pace is not None:
            self._clock.wait_until(round(t_us / self._pace))
        while (due_us := self.manager.due_us) <= t_us:
            self.rig.run_to(due_us)
            self.manager.tick(due_us)
        if self.rig.now_us < t_us:
            self.rig.run_to(t_us)

    def run_until(self, done: Callable[[], bool], timeout_us: int, step_us: int = 20_000) -> bool:
        """Advance until a condition is true; return False after the time-out."""
        until_us = self.now_us + timeout_us
        while not done() and self.now_us < until_us:
            self.run_to(min(self.now_us + step_us, until_us))
        return done()

    def _opener(self, line: Rs485Line) -> Callable[[str], SimLink]:
        return lambda name: SimLink(self.rig, line.b)


def _range_finders(bases: Sequence[Rh3Base], world: World) -> tuple[MountedUrg, ...]:
    """Return a range finder for each base, which also sees the other robots."""
    return tuple(
        MountedUrg(base, world, [other for other in bases if other is not base]) for base in bases
    )
