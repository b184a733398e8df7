r"""Motion of a motor core unit: objects, trajectory, shaft, modes.

>>> motion = Trajectory()
>>> ticks = 0
>>> while motion.position_ndeg != 90 * DEGREE:
...     motion.approach(90 * DEGREE, MAX_VELOCITY_UDEG_S)
...     ticks += 1
>>> ticks * CONTROL_US
350000
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, IntEnum, IntFlag, auto
from math import isqrt, remainder
from typing import Final, assert_never

from tickrig.device.canopen.dictionary import Dictionary, Entry
from tickrig.device.canopen.pdo.rpdo import PdoConsumer
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.device.servo.servo import Servo
from tickrig.device.twin import Part

CONTROL_US: Final = 10_000
"""Duration of a control tick (DECISION K19)."""

DEGREE: Final = 1_000_000_000
"""Number of nanodegrees in a degree."""

MAX_VELOCITY_UDEG_S: Final = 360_000_000
_MAX_ACCELERATION_UDEG_S2: Final = 3_600_000_000
CHANGE_UDEG_S: Final = _MAX_ACCELERATION_UDEG_S2 * CONTROL_US // 1_000_000
"""Largest change of the velocity in a control tick."""

_NDEG: Final = CONTROL_US // 2_000
"""Nanodegrees that a tick adds for each udeg/s of its start velocity, and of its end velocity. """

_LANDING_NDEG: Final = 1_000
"""A microdegree: the remainder that whole velocities may leave at the end of an approach."""


@dataclass(slots=True)
class Trajectory:
    """Demanded position and velocity of the shaft, planned one control tick at a time.

    The acceleration is constant within a control tick.

    Not emulated: a limit of the jerk.

    Attributes:
        position_ndeg: position at the end of the present control tick, in 1e-9 degrees.
        velocity_udeg_s: velocity at the end of the present control tick, in 1e-6 degrees per
            second.
        begin_ndeg: position at the start of the control tick.
        begin_udeg_s: velocity at the start of the control tick.
    """

    position_ndeg: int = 0
    velocity_udeg_s: int = 0
    begin_ndeg: int = 0
    begin_udeg_s: int = 0

    def place(self, position_ndeg: int, velocity_udeg_s: int) -> None:
        """Continue from a given motion."""
        self.position_ndeg, self.velocity_udeg_s = position_ndeg, velocity_udeg_s
        self._begin()

    def approach(self, target_ndeg: int, limit_udeg_s: int) -> None:
        """Plan one control tick towards an angle, to stop there as early as possible.

        Args:
            target_ndeg: angle at which to stop.
            limit_udeg_s: velocity limit, as a positive number.
        """
        distance = target_ndeg - self.position_ndeg
        last = _NDEG * self.velocity_udeg_s
        if abs(self.velocity_udeg_s) <= CHANGE_UDEG_S and abs(distance - last) <= _LANDING_NDEG:
            self._begin()
            self.position_ndeg, self.velocity_udeg_s = target_ndeg, 0
            return
        wanted = _stoppable_udeg_s(abs(distance - last))
        wanted = min(wanted, limit_udeg_s)
        self.run(wanted if distance >= last else -wanted)

    def run(self, velocity_udeg_s: int) -> None:
        """Step towards a velocity."""
        self._begin()
        change = velocity_udeg_s - self.velocity_udeg_s
        self.velocity_udeg_s += max(-CHANGE_UDEG_S, min(CHANGE_UDEG_S, change))
        self.position_ndeg += _NDEG * (self.begin_udeg_s + self.velocity_udeg_s)

    def at(self, since_us: int) -> tuple[float, float, float]:
        """Return the demanded motion at a time within the present control tick.

        Args:
            since_us: time since the start of the control tick, 0..`CONTROL_US`.

        Returns:
            Position in deg, velocity in deg/s and acceleration in deg/s^2.
        """
        acceleration = (self.velocity_udeg_s - self.begin_udeg_s) / CONTROL_US
        since_s, begin = since_us / 1e6, self.begin_udeg_s / 1e6
        position = self.begin_ndeg / DEGREE + since_s * (begin + acceleration * since_s / 2)
        return position, begin + acceleration * since_s, acceleration

    def _begin(self) -> None:
        self.begin_ndeg, self.begin_udeg_s = self.position_ndeg, self.velocity_udeg_s


def _stoppable_udeg_s(distance_ndeg: int) -> int:
    """Return the highest velocity at the end of a tick that allows a stop within a distance.

    The distance is the sum of the part that the tick itself adds for its end velocity v and the
    braking distance. Braking takes full brake ticks and a shorter last one. With m full brake
    ticks, the distance is (2 (m + 1) v - m (m + 1) CHANGE) * _NDEG.
    At v = m * CHANGE it is m (m + 1) * CHANGE * _NDEG.
    """
    full = (isqrt(1 + 4 * (distance_ndeg // (_NDEG * CHANGE_UDEG_S))) - 1) // 2
    return (distance_ndeg // _NDEG + full * (full + 1) * CHANGE_UDEG_S) // (2 * (full + 1))


# Demands and actual values of the motor core unit, between its objects and the units of its motion.

_FULL_SCALE: Final = 0x2010
_ANGLE_OFFSET: Final = 0x2011
_REFERENCE: Final = 0x6411
_ERROR_MODE: Final = 0x6443
_ERROR_VALUE: Final = 0x6444

_I16_MAX: Final = 0x7FFF
_MAX_CURRENT_MA: Final = 10_000
"""Peak (NEDO report, Table 6)."""


class References(Part):
    """The reference and the limits that the master writes to a motor core unit, in physical units.

    A motor core unit is a CANopen slave that drives one motor (NEDO report). On the bus the number
    32767 stands for the full scale of an angle, velocity or current. A communication error, such as
    a lost heartbeat of the master, is called a failure here. If the error mode (object 6443h:01) is
    not 0, the unit uses the error value (object 6444h:01) as its reference after a failure, until
    the master sends a new reference.

    Args:
        node: the slave.
        on_reference: function that is called when a reference arrives after a failure.

    Attributes:
        entries: entries of the objects.
        failed: whether there was a failure, and no reference has arrived since then.
    """

    def __init__(self, node: CanopenSlave, on_reference: Callable[[], None]) -> None:
        dictionary = node.dictionary
        self._angle, self._velocity, self._current = dictionary.elements(_FULL_SCALE)
        self._reference, self._velocity_limit, self._current_limit, _ = dictionary.elements(
            _REFERENCE
        )
        self._offset = dictionary[_ANGLE_OFFSET, 0]
        self._error_mode = dictionary[_ERROR_MODE, 1]
        self._error_value = dictionary[_ERROR_VALUE, 1]
        self.entries: list[Entry] = [
            *(*dictionary.elements(_FULL_SCALE), *dictionary.elements(_REFERENCE)),
            *(self._offset, self._error_mode, self._error_value),
        ]
        self.failed = False
        self._node, self._on_reference = node, on_reference
        self._reference.written = self._reference_written

    def start(self) -> None:
        """Clear the failure."""
        self.failed = False
        listeners = PdoConsumer.of(self._node).on_rpdo
        if self._reference_written not in listeners:
            listeners.append(self._reference_written)

    @property
    def number(self) -> int:
        """The effective reference, from -32767 to 32767."""
        if self.failed and self._error_mode.number:
            return _limited(self._error_value.number, _I16_MAX)
        return _limited(self._reference.number, _I16_MAX)

    @property
    def offset_mdeg(self) -> int:
        """Angle of the shaft at the user's angle 0."""
        return self._offset.number

    @property
    def target_ndeg(self) -> int:
        """Demanded angle of the shaft, in angle mode."""
        angle_ndeg = _part(self.number, self._angle.number * 1_000_000)
        return self.offset_mdeg * 1_000_000 + angle_ndeg

    @property
    def velocity_udeg_s(self) -> int:
        """Demanded velocity, in velocity mode."""
        wanted = _part(self.number, self._velocity.number * 1_000)
        return _limited(wanted, MAX_VELOCITY_UDEG_S)

    @property
    def current_ma(self) -> int:
        """Demanded current, in current mode."""
        return _limited(_part(self.number, self._current.number), _MAX_CURRENT_MA)

    @property
    def velocity_limit_udeg_s(self) -> int:
        """Largest velocity in angle mode; 0 stands for the limit of the unit."""
        limit = abs(_part(self._velocity_limit.number, self._velocity.number * 1_000))
        return _limited(limit, MAX_VELOCITY_UDEG_S) or MAX_VELOCITY_UDEG_S

    @property
    def current_limit_ma(self) -> int:
        """Largest current; 0 stands for the peak current of the unit."""
        limit = abs(_part(self._current_limit.number, self._current.number))
        return _limited(limit, _MAX_CURRENT_MA) or _MAX_CURRENT_MA

    def _reference_written(self, source: Entry | int) -> None:
        if self.failed:
            self.failed = False
            self._on_reference()

    def angle(self, angle_mdeg: float) -> int:
        """Return an angle of the shaft in the units of 6401h:01."""
        return _share(angle_mdeg - self.offset_mdeg, self._angle.number)

    def velocity(self, velocity_mdeg_s: float) -> int:
        """Return a velocity in the units of 6401h:02."""
        return _share(velocity_mdeg_s, self._velocity.number)

    def current(self, current_ma: float) -> int:
        """Return a current in the units of 6401h:03."""
        return _share(current_ma, self._current.number)


def _part(reference: int, full_scale: int) -> int:
    """Return reference / 32767 of a full scale, rounded."""
    return (2 * reference * full_scale + _I16_MAX) // (2 * _I16_MAX)


def _share(value: float, full_scale: int) -> int:
    """Return the 16-bit number of a value, limited to full scale."""
    return _limited(round(value * _I16_MAX / max(1, full_scale)), _I16_MAX)


def _limited(value: int, most: int) -> int:
    return max(-most, min(most, value))


# The shaft of the motor core unit, in degrees: motor, gear and both encoders.


class Shaft(Part):
    """The output shaft of a motor core unit: measures its angle and commands its servo.

    The angle comes from the counts of the motor encoder. The gear encoder defines the angle 0.

    Args:
        servo: servo with the motor, the gear and the control loops.
    """

    def __init__(self, servo: Servo) -> None:
        self.servo = servo
        self._counts_per_deg = servo.counts_per_turn * servo.gear_ratio / 360
        self._gear_deg = 360 / servo.parameters.encoders.gear_counts_per_turn
        self._zero_counts = 0.0

    @property
    def angle_ndeg(self) -> int:
        """Angle by the motor encoder."""
        return round((self.servo.counts - self._zero_counts) / self._counts_per_deg * 1e9)

    @property
    def velocity_udeg_s(self) -> int:
        """Velocity by the motor encoder."""
        return round(self.servo.velocity_counts_s / self._counts_per_deg * 1e6)

    @property
    def current_ma(self) -> int:
        """Current in the motor."""
        return self.servo.current_ma

    @property
    def slip_deg(self) -> float:
        """Difference between the encoders."""
        return abs(remainder(self.angle_ndeg / 1e9 - self._gear_angle_deg, 360))

    @property
    def _gear_angle_deg(self) -> float:
        """Angle by the gear encoder, -180..180."""
        return remainder(self.servo.gear_counts * self._gear_deg, 360)

    def find_zero(self) -> None:
        """Set the angle from the gear encoder, which does not count turns."""
        self._zero_counts = self.servo.counts - self._gear_angle_deg * self._counts_per_deg

    def release(self) -> None:
        """Switch the power off."""
        self.servo.release()

    def push(self, current_a: float) -> None:
        """Drive a current."""
        self.servo.drive_current(current_a)

    def turn(self, velocity_deg_s: float, acceleration_deg_s2: float) -> None:
        """Drive at a velocity."""
        scale = self._counts_per_deg
        self.servo.drive_velocity(velocity_deg_s * scale, acceleration_deg_s2 * scale)

    def point(self, position_deg: float, velocity_deg_s: float, acceleration_deg_s2: float) -> None:
        """Drive to a position."""
        scale = self._counts_per_deg
        self.servo.drive_position(
            position_deg * scale + self._zero_counts,
            velocity_deg_s * scale,
            acceleration_deg_s2 * scale,
        )


# Actions of the motor: the modes of 2000h, and braking.


class Mode(IntEnum):
    """Mode in 2000h."""

    FREE = 0
    CURRENT = 1
    VELOCITY = 2
    ANGLE = 3


class Action(Enum):
    """Action of the motor."""

    COAST = auto()  # without power
    PUSH = auto()  # current follows the reference
    TURN = auto()  # velocity follows the reference
    POINT = auto()  # angle follows the reference
    BRAKE = auto()  # velocity goes to zero


ACTIONS: Final = {
    Mode.FREE: Action.COAST,
    Mode.CURRENT: Action.PUSH,
    Mode.VELOCITY: Action.TURN,
    Mode.ANGLE: Action.POINT,
}
"""Action of each mode while references are effective."""

_DEVIATION_DEG: Final = 1.0
_DEVIATION_DEG_S: Final = 10.0
_DEVIATION_MA: Final = 200

_LOOPS: Final = (Action.TURN, Action.POINT, Action.BRAKE)
"""Actions with a planned velocity."""


class Motion(Part):
    """Plans the motion of a motor core unit, and commands its motor each millisecond.

    At the start of each control tick of 10 ms, the motion for this tick is planned. Each action
    starts from the present motion: from the planned velocity (or the measured velocity if none is
    planned), the measured angle and the present current.

    Args:
        shaft: the shaft after the gear of the motor.
        references: reference and limits from the master.

    Attributes:
        action: present action of the motor.
        reached: whether the planned motion has ended at the reference and the motor has reached it.
    """

    def __init__(self, shaft: Shaft, references: References) -> None:
        self._shaft, self._references = shaft, references
        self._trajectory = Trajectory()
        self.action, self.reached = Action.COAST, False
        self._begin_ma = self._end_ma = 0

    @property
    def on(self) -> bool:
        """Whether the power stage is on."""
        return self.action is not Action.COAST

    @property
    def loops(self) -> bool:
        """Whether a velocity is demanded."""
        return self.action in _LOOPS

    @property
    def steady(self) -> bool:
        """Whether the next control tick would be the same as the present one."""
        trajectory = self._trajectory
        stands = trajectory.begin_udeg_s == trajectory.velocity_udeg_s == 0
        return stands and self._begin_ma == self._end_ma

    def deviates(self, since_us: int) -> bool:
        """Return whether the motor is far from its demand."""
        position_deg, velocity_deg_s, _ = self._trajectory.at(since_us)
        match self.action:
            case Action.COAST:
                return False
            case Action.PUSH:
                return abs(self._shaft.current_ma - self._end_ma) > _DEVIATION_MA
            case Action.POINT:
                return abs(self._shaft.angle_ndeg / DEGREE - position_deg) > _DEVIATION_DEG
            case Action.TURN | Action.BRAKE:
                return abs(self._shaft.velocity_udeg_s / 1e6 - velocity_deg_s) > _DEVIATION_DEG_S
            case _:
                assert_never(self.action)

    def plan(self, action: Action) -> None:
        """Plan the control tick that starts now."""
        if action is not self.action:
            self._begin(action)
        match action:
            case Action.COAST:
                self.reached = False
            case Action.PUSH:
                self._begin_ma, self._end_ma = self._end_ma, self._references.current_ma
                self.reached = self._begin_ma == self._end_ma
            case Action.TURN:
                self._run(self._references.velocity_udeg_s)
            case Action.POINT:
                self._approach()
            case Action.BRAKE:
                self._run(0)
                self.reached = False
            case _:
                assert_never(action)
        self.reached = self.reached and not self.deviates(0)

    def drive(self, since_us: int) -> None:
        """Command the motor for the next millisecond of the planned motion.

        Args:
            since_us: time since the start of the control tick.
        """
        position_deg, velocity_deg_s, acceleration_deg_s2 = self._trajectory.at(since_us)
        match self.action:
            case Action.COAST:
                self._shaft.release()
            case Action.PUSH:
                change_ma = (self._end_ma - self._begin_ma) * since_us / CONTROL_US
                self._shaft.push((self._begin_ma + change_ma) / 1_000)
            case Action.POINT:
                self._shaft.point(position_deg, velocity_deg_s, acceleration_deg_s2)
            case Action.TURN | Action.BRAKE:
                self._shaft.turn(velocity_deg_s, acceleration_deg_s2)
            case _:
                assert_never(self.action)

    def _begin(self, action: Action) -> None:
        """Continue from the present motion."""
        shaft, trajectory = self._shaft, self._trajectory
        velocity = trajectory.velocity_udeg_s if self.loops else shaft.velocity_udeg_s
        current_ma = shaft.current_ma
        self.action = action
        trajectory.place(shaft.angle_ndeg, velocity if self.loops else 0)
        self._end_ma = current_ma if action is Action.PUSH else 0
        self._begin_ma = self._end_ma

    def _run(self, velocity_udeg_s: int) -> None:
        self._trajectory.run(velocity_udeg_s)
        self.reached = self._trajectory.begin_udeg_s == velocity_udeg_s

    def _approach(self) -> None:
        target_ndeg = self._references.target_ndeg
        trajectory = self._trajectory
        trajectory.approach(target_ndeg, self._references.velocity_limit_udeg_s)
        self.reached = trajectory.begin_ndeg == target_ndeg and not trajectory.begin_udeg_s


def mode_of(number: int) -> Mode:
    """Return the mode of a value of 2000h; an unknown value means no mode.

    >>> mode_of(3).name, mode_of(4).name
    ('ANGLE', 'FREE')
    """
    return Mode(number) if number in tuple(Mode) else Mode.FREE


_STATUS: Final = 0x2001
_MEASURED: Final = 0x6401


class Status(IntFlag):
    """Bits of 2001h (DECISION K19)."""

    ON = 1
    REACHED = 2
    LIMITED = 4
    FAULT = 8


class Display(Part):
    """Writes the status (2001h) and the measured values (6401h) of a motor core unit.

    The object writes these values to the dictionary once in each control tick.

    Args:
        dictionary: the dictionary of the unit.
        shaft: shaft that supplies the measurements.
        references: object with the full scales of angle, velocity and current. It converts
            measurements to the numbers in 6401h.
    """

    def __init__(self, dictionary: Dictionary, shaft: Shaft, references: References) -> None:
        self._status = dictionary[_STATUS, 0]
        self._angle, self._velocity, self._current, self._supply = dictionary.elements(_MEASURED)
        self._shaft, self._references = shaft, references

    def show(self, motion: Motion, *, faulty: bool) -> None:
        """Write the present values."""
        shaft, references = self._shaft, self._references
        self._angle.value = references.angle(shaft.angle_ndeg / 1e6)
        self._velocity.value = references.velocity(shaft.velocity_udeg_s / 1e3)
        self._current.value = references.current(shaft.current_ma)
        self._supply.value = shaft.servo.supply_mv // 10
        self._status.value = self._bits(motion, faulty=faulty)

    def _bits(self, motion: Motion, *, faulty: bool) -> int:
        status = Status.FAULT if faulty else Status(0)
        if motion.on:
            status |= Status.ON
            if motion.reached:
                status |= Status.REACHED
            if self._shaft.servo.current_limited:
                status |= Status.LIMITED
        return int(status)
