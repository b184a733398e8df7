"""A base on its serial line: driver, wheels and ground in each millisecond."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar, Final, NamedTuple

from tickrig.device.body import Contact, Pose, arc
from tickrig.device.chance import Chance
from tickrig.device.modbus import ModbusSlave
from tickrig.device.physical import OutputSignal, QuantityBank
from tickrig.device.rh3.driver import INPUTS, OUTPUTS, Driver
from tickrig.device.rh3.parameters import COUNTS_PER_RAD, BaseParameters
from tickrig.device.twin import Copyable, Part

# Theory of operation
# ===================
#
# In each millisecond the base does the following, in this order, in `_pass_to`: waiting orders,
# watchdog, stall, servo, ground. A rig does not call `tick` in each millisecond: one cycle of a
# master takes 8.3 ms at 115 200 bit/s, and between two frames only `read` shows anything of the
# base, every `LOOK_US`. Therefore:
#
# - `due_us` is the end of the frame on the line, or the next look. In between the base sleeps.
# - A tick first computes the milliseconds that have passed (`_catch_up`). If something happens in
#   this tick (a frame ends, an input was set, a reset), it computes those before now; otherwise it
#   includes the millisecond of now.
# - Then follow a reset, inputs, bytes, and last the millisecond of now.
#
# So a request is served from the state at the beginning of its millisecond, and an order that the
# request writes takes effect in the same millisecond. The order of these steps must not change.
# `tests/device/rh3/test_milliseconds.py` compares a base that sleeps with a base that is ticked
# each millisecond; they must agree to the bit.
#
# Equal milliseconds are computed in one call (`Driver.step`, `Side.drive` with `steps`).
# Milliseconds are equal while the targets are constant speeds, no order waits, the watchdog does
# not expire and no wheel stalls. `Driver._alike` counts them. If you add something to the step of a
# millisecond, `_alike` must end the run before it, or the two kinds of ticking differ.
#
# Two pieces of code must compute the same numbers. `SpeedLoop.drive` repeats `Wheel.step` on local
# variables, because this loop is the hot one; `Wheel.step` itself serves coasting and braking.
# `Wheel.held` and `Side.resting` tell when a step would change nothing. Their condition is the
# inverse of the one that holds the wheel in `SpeedLoop.drive` and `Wheel.step`.
#
# Units: counts and milliseconds inside, because the loop of the driver uses them (23 844.6 counts
# are a radian of the wheel). Metres and radians begin at `Ground.roll`. Torque is in per mille of
# the rated torque. Gains have the units that the register table in driver.py gives.
#
# Numbers: geometry and gains come from the functional specification of RH3, and the laws from
# rh3-control, section 1.7 and 2.3. Mass, friction, torque and current are our choices;
# parameters.py marks them as such. The wheels' true radii and tread are the calibrated ones (0.0995
# and 0.464 m). The host computes commands from 0.1 and 0.441 m. This difference is intended.

# The ground under a base: where its wheels have taken it.

_STEP_S: Final = 1e-3
_HALF: Final = 2.0**63


class Ground(Part):
    """The contact of a two-wheeled base with the ground: converts turning wheels into motion.

    The path in each millisecond is an exact arc.

    Castors, slopes and walls are not emulated. A slipping wheel needs the same force as a wheel
    that does not slip, which is a simplification.

    Args:
        parameters: parameters of the base.

    Attributes:
        speed_m_s: forward speed in the latest step.
        turn_rad_s: turning speed to the left in the latest step.
        left: contact of the left wheel with the ground.
        right: contact of the right wheel with the ground.
    """

    def __init__(self, parameters: BaseParameters) -> None:
        share_kg, friction = parameters.mass_kg / 2, parameters.friction
        self.left = Contact(parameters.radius_left_m, share_kg, friction)
        self.right = Contact(parameters.radius_right_m, share_kg, friction)
        self._tread_m, self._noise = parameters.tread_m, parameters.noise
        self._grips = friction is None
        self._chance = Chance(parameters.seed, "ground")
        self.pose, self.speed_m_s, self.turn_rad_s = Pose(), 0.0, 0.0

    @property
    def pose(self) -> Pose:
        """Pose of the middle of the axle, which may be set."""
        return Pose(*self._place)

    @pose.setter
    def pose(self, pose: Pose) -> None:
        self._place = (pose.x_m, pose.y_m, pose.heading_rad)

    @property
    def resting(self) -> bool:
        """Whether a step without turning leaves everything unchanged."""
        return not (self.speed_m_s or self.turn_rad_s or self.left.slip_m_s or self.right.slip_m_s)

    def roll(self, lefts: Sequence[float], rights: Sequence[float]) -> None:
        """Move the base over the ground for some milliseconds.

        Args:
            lefts: turning of the left wheel in each millisecond, in counts of the encoder.
            rights: turning of the right wheel in each millisecond, in counts of the encoder.
        """
        left, right, tread_m, place = self.left, self.right, self._tread_m, self._place
        grips, noise, left_m, right_m = self._grips, self._noise, 0.0, 0.0
        # `grips` skips the slip model: without a coefficient of friction the rim and the wheel move
        # alike, computed with the same arithmetic.
        for each, other in zip(lefts, rights):  # noqa: B905 - strict takes as long as a step
            left_rad, right_rad = each / COUNTS_PER_RAD, other / COUNTS_PER_RAD
            if grips:
                left_m, right_m = left_rad * left.radius_m, right_rad * right.radius_m
            else:
                left_m, right_m = left.roll(left_rad, _STEP_S), right.roll(right_rad, _STEP_S)
            if noise:
                left_m, right_m = self._roughened(left_m), self._roughened(right_m)
            if left_m or right_m:
                place = arc(place, left_m, right_m, tread_m)
        self._place = place
        self.speed_m_s = (left_m + right_m) / 2 / _STEP_S
        self.turn_rad_s = (right_m - left_m) / tread_m / _STEP_S

    def _roughened(self, way_m: float) -> float:
        """Return a distance with the ground's noise, uniform and independent in each step."""
        if not way_m:
            return 0.0
        return way_m * (1 + self._noise * (self._chance.draw() / _HALF - 1))


_Pair = tuple[float, float]


class _BaseState(NamedTuple):
    """Observable state of a base; pairs are for the left and right wheel unless stated otherwise.

    Attributes:
        pose: pose of the middle of the axle.
        speed: speed forward in m/s, and turning speed to the left in rad/s.
        travel: encoder counts of the wheels.
        slip: slip of the wheels in m/s.
        torque: torque of the motors in per mille.
        status: status, as in the register.
        frames: number of served requests, and number of garbled frames.
    """

    pose: Pose
    speed: _Pair
    travel: _Pair
    slip: _Pair
    torque: _Pair
    status: int
    frames: tuple[int, int]


_READ: Final[Mapping[str, Callable[[_BaseState], float]]] = {
    "x_m": lambda state: state.pose.x_m,
    "y_m": lambda state: state.pose.y_m,
    "heading_rad": lambda state: state.pose.heading_rad,
    "speed_m_s": lambda state: state.speed[0],
    "turn_rad_s": lambda state: state.speed[1],
    "angle_left_rad": lambda state: state.travel[0] / COUNTS_PER_RAD,
    "angle_right_rad": lambda state: state.travel[1] / COUNTS_PER_RAD,
    "slip_left_m_s": lambda state: state.slip[0],
    "slip_right_m_s": lambda state: state.slip[1],
    "torque_left_pm": lambda state: state.torque[0],
    "torque_right_pm": lambda state: state.torque[1],
    "status": lambda state: state.status,
    "served": lambda state: state.frames[0],
    "garbled": lambda state: state.frames[1],
}
"""Functions that return the outputs, by name in `driver.OUTPUTS`."""


_TICK_US: Final = 1_000

LOOK_US: Final = 10_000
"""Period at which outputs are updated."""


class Rh3Base(Copyable):
    """The base of Reference Hardware 3 as a Modbus RTU slave; a `Device[bytes]`.

    The real base speaks an unpublished protocol. rh3-control proposes Modbus RTU in its place, with
    the register map of `register_map`. In each millisecond the base processes bytes from the line,
    targets, watchdog and faults, servo, and ground, in this order. You need not call `tick` in each
    millisecond: a tick computes the milliseconds since the latest tick. `read` returns the outputs
    at the latest multiple of `LOOK_US`.

    Not emulated: the library libsvm, battery, heat, the outline of the robot.

    Args:
        parameters: parameters of the base.

    Attributes:
        type_name: name of the device type, for traces.
        inputs: physical inputs; see `driver.INPUTS`.
        ground: motion of the base over the ground. The pose may be set.
        sides: left and right wheel with their control loops.
        slave: Modbus slave of the base on the line.
    """

    type_name: ClassVar[str] = "rh3-base"

    def __init__(self, parameters: BaseParameters | None = None) -> None:
        self.parameters: BaseParameters = parameters or BaseParameters()
        self.inputs = QuantityBank(INPUTS)
        self.ground = Ground(self.parameters)
        self._driver = driver = Driver(self.parameters, self.inputs)
        self.sides = driver.sides
        self.slave = ModbusSlave(driver.registers, driver.written, self.parameters.address)
        self._on, self._moving, self._unseen, self._now_us = True, False, True, 0
        self._restarted = False
        self._seen = self._observed()

    @property
    def tick_us(self) -> int:
        """The period of the servo."""
        return _TICK_US

    @property
    def due_us(self) -> int:
        """The time of the next event without input."""
        if self.inputs.changed or self._restarted:
            return 0
        due_us = self.slave.due_us
        if self._unseen:
            due_us = min(due_us, self._now_us - self._now_us % LOOK_US + LOOK_US)
        return due_us

    @property
    def outputs(self) -> Mapping[str, OutputSignal]:
        """The outputs that `read` accepts."""
        return _OUTPUTS

    @property
    def status(self) -> int:
        """Status register of the driver, which is 0 without supply."""
        return self._driver.status if self._on else 0

    def reset(self) -> None:
        """Restore the state after power-up, at the present pose."""
        self._restarted = True

    def read(self, name: str, /) -> int | float:
        """Return the value that a physical output had after the latest tick.

        Args:
            name: name of an output in `outputs`.

        Returns:
            The value of the output.

        Raises:
            KeyError: there is no output of that name.
        """
        return _READ[name](self._seen)

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        """Advance the base by one tick, or by several ticks that were skipped.

        Args:
            now_us: time since the rig was started, a multiple of `tick_us`.
            rx: bytes that have arrived since the latest tick.

        Returns:
            The bytes that the base sends in this tick.
        """
        heard, before_us = self.slave.due_us <= now_us, now_us - _TICK_US
        # Events of this tick must find the base in the state at the end of the previous
        # millisecond.
        happens = heard or self.inputs.changed or self._restarted
        made = self._catch_up(before_us if happens else now_us) and not happens
        if self._restarted:
            self._restart(before_us)
        self._now_us = self._driver.now_us = now_us
        if self.inputs.changed:
            self._inputs_changed()
        sent = b""
        if self._on:
            # Served and garbled frames are outputs too: the next look has to be taken.
            self._unseen |= heard or bool(rx)
            sent = self.slave.tick(now_us, rx)
        if not made:
            self._pass_to(now_us)
        if now_us % LOOK_US == 0:
            self._seen, self._unseen = self._observed(), self._moving
        return sent

    def _power_up(self) -> None:
        self._driver.power_up()
        self.slave.reset()

    def _observed(self) -> _BaseState:
        ground, (left, right) = self.ground, self.sides
        return _BaseState(
            ground.pose,
            (ground.speed_m_s, ground.turn_rad_s),
            (left.wheel.travel, right.wheel.travel),
            (ground.left.slip_m_s, ground.right.slip_m_s),
            (left.torque, right.torque),
            self.status,
            (self.slave.served, self.slave.garbled),
        )

    def _catch_up(self, until_us: int) -> bool:
        """Run the milliseconds up to a time while the base moves; return whether all were run."""
        driver = self._driver
        while self._moving and driver.now_us < until_us:
            driver.now_us += _TICK_US
            self._pass_to(until_us)
        return driver.now_us >= until_us

    def _restart(self, now_us: int) -> None:
        self._restarted, self._driver.now_us = False, max(0, now_us)
        self._power_up()
        self._on = self.inputs.changed = True

    def _pass_to(self, until_us: int) -> None:
        """Run the present millisecond, and the equal milliseconds after it."""
        driver, ground = self._driver, self.ground
        if self._on:
            lefts, rights = driver.step(self.slave.last_request_us, until_us)
        else:
            lefts, rights = driver.coast()
        ground.roll(lefts, rights)
        # Speed first: it is the cheap test, and true in most milliseconds of a drive.
        if ground.speed_m_s or not (ground.resting and driver.resting):
            self._moving = self._unseen = True
        else:
            self._moving = False

    def _inputs_changed(self) -> None:
        self.inputs.changed, self._unseen = False, True
        for side in self.sides:
            side.inputs_changed(self.inputs)
        on = not self.inputs["power_cut"]
        if on != self._on:
            self._on = on
            self._power_up()
        self._driver.find_faults()


_OUTPUTS: Final = {output.name: output for output in OUTPUTS}
