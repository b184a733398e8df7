"""The axis of a drive: reference, motor, stopping, limits and limit switches."""

from __future__ import annotations

from enum import Enum, IntEnum, auto
from math import inf
from typing import Final

from tickrig.device.canopen.ds402 import indices
from tickrig.device.canopen.ds402.settings import ErrorCode, Parameters, Settings
from tickrig.device.physical import InputSignal, QuantityBank
from tickrig.device.servo.readings import nearest
from tickrig.device.servo.servo import Servo
from tickrig.device.twin import Part

# The present demand of the drive on its motor.

STEP_S: Final = 0.001
"""Period of the control, in seconds: one tick."""


class Control(Enum):
    """The control loop of the motor that a mode uses."""

    POSITION = auto()
    VELOCITY = auto()
    CURRENT = auto()


class Reference(Part):
    """The demanded motion of a drive. It belongs to the drive, so it survives a change of mode.

    Quantities that a mode does not control follow the motor. In velocity modes, the position
    follows. In torque modes, the position and the velocity follow. Therefore the reference does not
    jump when the next mode starts.

    Attributes:
        position: demanded position in counts of the motor's encoder.
        velocity: demanded velocity in counts per second.
        acceleration: acceleration for the feed-forward, in counts per second per second.
        current_a: demanded current in amperes.
    """

    __slots__ = ("acceleration", "current_a", "position", "velocity")

    def __init__(self) -> None:
        self.position: float = 0.0
        self.velocity: float = 0.0
        self.acceleration: float = 0.0
        self.current_a: float = 0.0

    def ramp(self, velocity: float, acceleration: float, deceleration: float) -> bool:
        """Change the demanded velocity towards a target for one control period.

        Args:
            velocity: target velocity in counts per second.
            acceleration: acceleration while the speed increases, above 0.
            deceleration: acceleration while the speed decreases, above 0.

        Returns:
            True if the target velocity is reached.
        """
        before = self.velocity
        braking = abs(velocity) < abs(before) or velocity * before < 0
        most = (deceleration if braking else acceleration) * STEP_S
        change = velocity - before
        if abs(change) <= most:
            self.move(velocity)
            return True
        self.move(before + (most if change > 0 else -most))
        return False

    def move(self, velocity: float) -> None:
        """Make a step with constant acceleration that ends with a velocity."""
        before, self.velocity = self.velocity, velocity
        self.acceleration = (velocity - before) / STEP_S
        self.position += (before + velocity) / 2 * STEP_S

    def place(self, position: float, velocity: float = 0.0, acceleration: float = 0.0) -> None:
        """Set the motion from a position generator."""
        self.position, self.velocity, self.acceleration = position, velocity, acceleration


# A motor without physics, for a drive without a servo.

_COUNTS_S2_PER_A: Final = 1_000.0


class IdealMotor(Part):
    """A motor that reaches each demanded position and velocity at once.

    When the motor is released, it stops at once. A current accelerates the motor like a mass
    without friction: 1 A gives 1000 counts per second per second.

    Not emulated: load, temperature, limits of current and voltage.
    """

    counts_per_turn: Final = 2_000
    supply_mv: Final = 24_000
    winding_dc: Final = 250
    current_limited: Final = False

    def __init__(self) -> None:
        self.current_limit_a = 0.0
        self._position = self._velocity = self._current_a = 0.0
        self._moves_by_itself = False
        self._now_us = 0

    @property
    def counts(self) -> int:
        """The position, rounded."""
        return round(self._position)

    @property
    def velocity_counts_s(self) -> int:
        """The velocity, rounded."""
        return round(self._velocity)

    @property
    def shaft_deg(self) -> float:
        """The position in degrees."""
        return self._position / self.counts_per_turn * 360

    @property
    def shaft_deg_s(self) -> float:
        """The velocity in degrees per second."""
        return self._velocity / self.counts_per_turn * 360

    @property
    def current_ma(self) -> int:
        """The demanded current."""
        return round(self._current_a * 1_000)

    @property
    def resting(self) -> bool:
        """Whether the motor stands and no current accelerates it."""
        return self._velocity == 0 and self._current_a == 0

    def release(self) -> None:
        """Stop."""
        self._velocity = self._current_a = 0.0

    def drive_current(self, current_a: float) -> None:
        """Accelerate with the current."""
        self._current_a, self._moves_by_itself = current_a, True

    def drive_velocity(self, velocity: float, acceleration: float = 0.0) -> None:
        """Turn at a velocity."""
        self._velocity, self._current_a, self._moves_by_itself = velocity, 0.0, True

    def drive_position(
        self, position: float, velocity: float = 0.0, acceleration: float = 0.0
    ) -> None:
        """Move to a position."""
        self._position, self._velocity, self._current_a = position, velocity, 0.0
        self._moves_by_itself = False

    def step_to(self, now_us: int) -> None:
        """Advance the position, unless a position is demanded."""
        passed_s, self._now_us = (now_us - self._now_us) / 1_000_000, now_us
        if self._moves_by_itself:
            before = self._velocity
            self._velocity += self._current_a * _COUNTS_S2_PER_A * passed_s
            self._position += (before + self._velocity) / 2 * passed_s


Motor = Servo | IdealMotor
"""The motors that a drive can have. It is no protocol, which a compiled drive would use by names of
attributes: 4 % of a drive."""


# The moved axis: its motor, its zero and its range.

_STANDSTILL_TURNS_S: Final = 0.5
"""Speed below which the motor counts as standing, because the encoder cannot resolve it in a
tick."""


class Axis(Part):
    """An axis of a drive: its motor, its demanded motion, and the conversion to units of the user.

    Positions in units of the user are INTEGER32. At an end of the position range limit (607Bh),
    they continue at the other end.

    Attributes:
        motor: the motor.
        reference: the demanded motion, in counts.
        control: control loop used in this tick: position, velocity or current.
        settings: the present configuration.
        zero: number of encoder counts at position 0 of the user.
        homed: whether a homing has set `zero`.
        standstill: velocity up to which the motor counts as standing, in counts per second.
    """

    def __init__(self, motor: Motor, settings: Settings) -> None:
        self.motor: Motor = motor
        self.settings: Settings = settings
        self.reference: Reference = Reference()
        self.control = Control.POSITION
        self.zero, self.homed = 0.0, False
        self.standstill = _STANDSTILL_TURNS_S * motor.counts_per_turn

    @property
    def position(self) -> int:
        """Position actual value, in units of the user."""
        return self.position_of(self.motor.counts)

    @property
    def stands(self) -> bool:
        """Whether the motor stands, according to its encoder."""
        return not self.is_fast(self.motor.velocity_counts_s)

    @property
    def forward(self) -> int:
        """Sign of the counts in the positive direction of the user."""
        return 1 if self.settings.units.per_position > 0 else -1

    @property
    def ends(self) -> tuple[float, float]:
        """Software limits in counts, lower limit first; a missing limit is infinite."""
        low, high = self.settings.software_limits
        return low + self.zero, high + self.zero

    @property
    def following_error(self) -> float:
        """Number of counts from the motor to the reference."""
        return self.reference.position - self.motor.counts

    @property
    def unwrapped(self) -> tuple[float, float]:
        """Lowest and highest counts, a unit inside the range, at which `wrap` does nothing."""
        low, high = self.settings.position_range
        unit = self.settings.units.per_position
        first, last = self.zero + (low + 1) * unit, self.zero + (high - 1) * unit
        return (first, last) if first <= last else (last, first)

    def is_fast(self, velocity: float) -> bool:
        """Return whether a velocity in counts per second is more than standstill."""
        return abs(velocity) > self.standstill

    def position_of(self, counts: float) -> int:
        """Return the position of the user at encoder counts."""
        low, high = self.settings.position_range
        position = nearest((counts - self.zero) / self.settings.units.per_position)
        return (position - low) % (high - low + 1) + low

    def counts_of(self, position: int) -> float:
        """Return the encoder counts at a position of the user."""
        return self.zero + position * self.settings.units.per_position

    def counts_near(self, position: int) -> float:
        """Return the counts at a position, on the shorter path from the reference."""
        low, high = self.settings.position_range
        span = high - low + 1
        unit = self.settings.units.per_position
        away = position - (self.reference.position - self.zero) / unit
        return self.reference.position + ((away + span / 2) % span - span / 2) * unit

    def per_mille_of(self, current_a: float) -> int:
        """Return a current in thousandths of the rated current, with the user's sign."""
        return round(1_000 * current_a / self.settings.rated_current_a) * self.forward

    def wrap(self) -> None:
        """Move the zero by a whole range when the motor has left the range."""
        low, high = self.settings.position_range
        unit = self.settings.units.per_position
        position = (self.motor.counts - self.zero) / unit
        if low <= position <= high:  # mostly, and without `round`: 4 % of a drive's tick
            return
        turns = (round(position) - low) // (high - low + 1)
        self.zero += turns * (high - low + 1) * unit

    def place_home(self, position: int, counts: int) -> None:
        """Define counts as a position of the user: homing is attained."""
        self.zero = counts - position * self.settings.units.per_position
        self.homed = True

    def command(self) -> None:
        """Command the motor with the reference; uncontrolled quantities follow the motor."""
        motor, reference, control = self.motor, self.reference, self.control
        if control is not Control.CURRENT:
            reference.current_a = motor.current_ma / 1_000
        if control is Control.POSITION:
            motor.drive_position(reference.position, reference.velocity, reference.acceleration)
        elif control is Control.VELOCITY:
            motor.drive_velocity(reference.velocity, reference.acceleration)
            reference.position = float(motor.counts)
        else:
            motor.drive_current(reference.current_a)
            reference.place(motor.counts, motor.velocity_counts_s)

    def release(self) -> None:
        """Switch the power stage off."""
        self.motor.release()
        self.reference.place(self.motor.counts, self.motor.velocity_counts_s)
        self.reference.current_a = 0.0

    def configure(self, settings: Settings) -> None:
        """Apply another configuration."""
        self.settings = settings
        self.motor.current_limit_a = min(settings.max_current_a, *settings.limits_a)


# Stopping a drive: the option codes 605Ah to 605Eh (CiA 402-2).


class Ramp(IntEnum):
    """Ways to slow the motor down."""

    NONE = 0  # the power stage is switched off, the shaft coasts
    SLOW_DOWN = 1  # with the deceleration of the profile, 6084h
    QUICK_STOP = 2  # with the quick stop deceleration, 6085h
    CURRENT_LIMIT = 3  # as hard as the current limit allows


_STAYING: Final = 4
"""Number that is added to a quick stop option if the drive stays in Quick stop active."""


class Stopping(Part):
    """Brakes an axis according to an option code, such as 605Ah for a quick stop.

    The options 4 and 8 (voltage limit) and options of a manufacturer are not emulated.

    Args:
        axis: axis whose demanded velocity is reduced.
        parameters: objects with the option codes.
    """

    def __init__(self, axis: Axis, parameters: Parameters) -> None:
        self._axis, self._parameters = axis, parameters

    @property
    def stays(self) -> bool:
        """Whether a quick stop ends in Quick stop active."""
        return self._parameters.number(indices.QUICK_STOP_OPTION) > _STAYING

    def quick_stop(self) -> bool:
        """Make a step according to 605Ah; return whether the motor stands."""
        return self.brake(self._parameters.number(indices.QUICK_STOP_OPTION) % _STAYING)

    def by(self, index: int) -> bool:
        """Make a step according to another option code; return whether the motor stands."""
        return self.brake(self._parameters.number(index))

    def brake(self, ramp: int) -> bool:
        """Brake the motor for one control period on the ramp that an option code chooses.

        Args:
            ramp: number from the enumeration `Ramp`. The number 0 means no braking, 1 the profile
                deceleration, 2 the quick stop deceleration, and 3 the largest deceleration that the
                current limit allows.

        Returns:
            True if the motor stands or does not need to be slowed down.
        """
        axis, settings = self._axis, self._axis.settings
        if ramp == Ramp.NONE:
            return True
        if axis.control is Control.CURRENT:
            axis.control = Control.VELOCITY
        deceleration = {
            Ramp.SLOW_DOWN: settings.deceleration,
            Ramp.QUICK_STOP: settings.quick_stop_deceleration,
        }.get(Ramp(ramp), inf)
        return axis.reference.ramp(0.0, deceleration, deceleration) and axis.stands


# Limit switches and home switch of an axis (CiA 402-2, 60FDh).

FAR_DEG: Final = 1e9
"""Angle that no shaft reaches, in degrees."""

_NEGATIVE_LIMIT: Final = 0x01
_POSITIVE_LIMIT: Final = 0x02
_HOME: Final = 0x04
"""Bits of 60FDh."""

INPUTS: Final[tuple[InputSignal, ...]] = (
    InputSignal("negative_limit_switch", "limit switch in negative direction is pressed by hand"),
    InputSignal("positive_limit_switch", "limit switch in positive direction is pressed by hand"),
    InputSignal("home_switch", "home switch is pressed by hand"),
    *(
        InputSignal(name, text, low=-FAR_DEG, high=FAR_DEG, unit="deg", initial=initial, real=True)
        for name, text, initial in (
            ("negative_limit_at", "angle at and below which the shaft presses it", -FAR_DEG),
            ("positive_limit_at", "angle at and above which the shaft presses it", FAR_DEG),
            ("home_from", "angle from which the shaft presses the home switch", FAR_DEG),
            ("home_to", "angle up to which the shaft presses the home switch", -FAR_DEG),
        )
    ),
)


class Switches(Part):
    """The limit switches and the home switch of an axis, as the drive reads them.

    A switch is pressed by a physical input ("by hand"), or by the shaft at certain angles. The
    negative limit switch limits the direction in which the position in user units decreases. The
    positive limit switch limits the opposite direction. The position in user units is the position
    with the sign that the polarity 607Eh gives it.

    Attributes:
        word: value of bits 0 to 2 of 60FDh.
        by_angle: whether the shaft can press at least one of the switches.
    """

    def __init__(self) -> None:
        self.word: int = 0
        self._hand = 0
        self._angles = (-inf, inf, inf, -inf)
        self.by_angle = False

    def set(self, inputs: QuantityBank) -> None:
        """Update from the physical inputs."""
        hand, angles = INPUTS[:3], INPUTS[3:]
        self._hand = sum(1 << bit for bit, item in enumerate(hand) if inputs[item.name])
        low, high, first, last = (inputs[item.name] for item in angles)
        self._angles = low, high, first, last
        self.by_angle = any(inputs[item.name] != item.initial for item in angles)
        self.word = self._hand

    def look(self, shaft_deg: float) -> None:
        """Update from the angle of the shaft."""
        low, high, first, last = self._angles
        self.word = (
            self._hand
            | (_NEGATIVE_LIMIT if shaft_deg <= low else 0)
            | (_POSITIVE_LIMIT if shaft_deg >= high else 0)
            | (_HOME if first <= shaft_deg <= last else 0)
        )

    @property
    def free(self) -> bool:
        """Whether no limit switch is pressed, and the shaft cannot press one."""
        return not (self.by_angle or self.word & (_NEGATIVE_LIMIT | _POSITIVE_LIMIT))

    @property
    def negative_limit(self) -> bool:
        """Whether the negative limit switch is pressed."""
        return bool(self.word & _NEGATIVE_LIMIT)

    @property
    def positive_limit(self) -> bool:
        """Whether the positive limit switch is pressed."""
        return bool(self.word & _POSITIVE_LIMIT)

    @property
    def home(self) -> bool:
        """Whether the home switch is pressed."""
        return bool(self.word & _HOME)


# Limits of position and velocity of a drive: limit switches and software limits (CiA 402-2).

Clamped = tuple[float, bool]
"""A demand or the nearest limit, and whether the limit has changed the demand."""


class Limits(Part):
    """Limits the demands on an axis: its velocity, its position and its current.

    Args:
        axis: the axis, whose settings contain the limits.
        switches: limit switches of the axis.
    """

    def __init__(self, axis: Axis, switches: Switches) -> None:
        self._axis, self._switches = axis, switches

    def velocity(self, wanted: float) -> Clamped:
        """Clamp a velocity, in counts per second, to the largest velocity."""
        most = self._axis.settings.max_velocity
        return _clamp(wanted, -most, most)

    def position(self, counts: float) -> Clamped:
        """Clamp a position to the software limits."""
        low, high = self._axis.ends
        return _clamp(counts, low, high)

    def current(self, wanted_a: float) -> Clamped:
        """Clamp a current to the torque limits of both directions."""
        settings = self._axis.settings
        backward, forward = settings.limits_a
        most = settings.max_current_a
        return _clamp(wanted_a, -min(backward, most), min(forward, most))

    def reached(self) -> ErrorCode | None:
        """Return the error code if a limit must end the present motion, otherwise None.

        The limit is a limit switch that is pressed in the direction of motion, or a software limit
        that the motion would exceed if it did not brake now.
        """
        axis, reference = self._axis, self._axis.reference
        towards = reference.velocity
        if axis.control is Control.CURRENT:
            towards = towards or reference.current_a
        if not towards:
            return None
        if towards * axis.forward > 0:
            if self._switches.positive_limit:
                return ErrorCode.POSITIVE_LIMIT
        elif self._switches.negative_limit:
            return ErrorCode.NEGATIVE_LIMIT
        ends = axis.control is not Control.POSITION and self._room(towards) <= 0
        return ErrorCode.SOFTWARE_LIMIT if ends else None

    def _room(self, towards: float) -> float:
        """Return the counts left before the motor must brake for a software limit."""
        axis, reference = self._axis, self._axis.reference
        low, high = axis.ends
        way = high - reference.position if towards > 0 else reference.position - low
        return way - reference.velocity**2 / (2 * axis.settings.quick_stop_deceleration)


def _clamp(wanted: float, low: float, high: float) -> Clamped:
    value = max(low, min(high, wanted))
    return value, value != wanted
