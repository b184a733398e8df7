"""Configuration of a drive by its objects: parameters, settings, error codes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from math import inf, tau
from typing import Final

from tickrig.device.canopen.dictionary import Dictionary, OnEntry
from tickrig.device.canopen.ds402 import indices
from tickrig.device.canopen.ds402.indices import DEFAULTS, NO_LIMIT
from tickrig.device.twin import Immutable, Part
from tickrig.wire.canopen.emcy import ErrorRegister

# Error codes of a drive, and how it reacts to them (CiA 402-2, error codes).


class ErrorCode(IntEnum):
    """Error codes of the faults of a drive."""

    OVER_CURRENT = 0x2310
    OVER_VOLTAGE = 0x3210
    UNDER_VOLTAGE = 0x3220
    DRIVE_TEMPERATURE = 0x4310
    MOTOR_BLOCKED = 0x7121
    MOTOR_PHASE = 0x7122
    INCREMENTAL_SENSOR = 0x7305
    POSITION_SENSOR = 0x7320
    COMMUNICATION = 0x8100
    HEARTBEAT = 0x8130
    FOLLOWING_ERROR = 0x8611
    NEGATIVE_LIMIT = 0xFF06
    POSITIVE_LIMIT = 0xFF07
    SOFTWARE_LIMIT = 0xFF09


_CONTROLLABLE: Final = frozenset(
    (
        *(ErrorCode.DRIVE_TEMPERATURE, ErrorCode.FOLLOWING_ERROR, ErrorCode.MOTOR_BLOCKED),
        *(ErrorCode.NEGATIVE_LIMIT, ErrorCode.POSITIVE_LIMIT, ErrorCode.SOFTWARE_LIMIT),
    )
)
"""Faults after which the motor can still be slowed down according to 605Eh. Other faults switch the
motor off."""

COMMUNICATION_ERRORS: Final = range(0x8100, 0x8200)

_REGISTERS: Final = {
    0x2: ErrorRegister.CURRENT,
    0x3: ErrorRegister.VOLTAGE,
    0x4: ErrorRegister.TEMPERATURE,
}
"""Bit of the error register by the first digit of the error code."""


def is_controllable(code: int) -> bool:
    """Return whether the motor can be slowed down after a fault."""
    return code in _CONTROLLABLE or code in COMMUNICATION_ERRORS


def register_of(code: int) -> ErrorRegister:
    """Return the bit of the error register for an emergency error code.

    >>> [register_of(code).name for code in (0x3220, 0x8130, 0x8611)]
    ['VOLTAGE', 'COMMUNICATION', 'DEVICE_PROFILE']
    """
    if code in COMMUNICATION_ERRORS:
        return ErrorRegister.COMMUNICATION
    return _REGISTERS.get(code >> 12, ErrorRegister.DEVICE_PROFILE)


# The objects of a drive as numbers, with defaults for missing ones.


class Parameters(Part):
    """Gives a drive access to its objects, even if its dictionary lacks some of them.

    Reading a missing object returns its default. Writing to a missing object has no effect.

    Args:
        dictionary: the dictionary of the slave.
        defaults: values of objects that the device does not have, by (index, sub-index).
    """

    def __init__(
        self, dictionary: Dictionary, defaults: Mapping[tuple[int, int], int] = DEFAULTS
    ) -> None:
        self._dictionary, self._defaults = dictionary, defaults

    def number(self, index: int, sub: int = 0) -> int:
        """Return the value of an object as a number.

        If the device does not have the object, return its default, or 0 if it has no default.
        """
        entry = self._dictionary.find(index, sub)
        return self._defaults.get((index, sub), 0) if entry is None else entry.number

    def write(self, index: int, value: int, sub: int = 0) -> None:
        """Set the value of an object; do nothing if the device does not have the object.

        A value out of the range of the data type is replaced by the nearest value in it.
        """
        entry = self._dictionary.find(index, sub)
        if entry is not None:
            entry.value = clamped(value, 8 * entry.size, signed=entry.description.signed)

    def watch(self, indices: Iterable[int], changed: OnEntry) -> None:
        """Call `changed` whenever one of the given objects changes."""
        for index in indices:
            for entry in self._dictionary.object(index):
                entry.watch(changed)


def clamped(value: int, bits: int, *, signed: bool) -> int:
    """Return the nearest number that an integer of a given size can hold.

    >>> clamped(40_000, 16, signed=True), clamped(-1, 16, signed=False)
    (32767, 0)
    """
    low = -(1 << bits - 1) if signed else 0
    return max(low, min(low + (1 << bits) - 1, value))


# How a drive is set up: the configuration objects in the units of its motor.

_NO_TORQUE_LIMIT: Final = 0xFFFF

_POSITION_REVERSED: Final = 0x80
_VELOCITY_REVERSED: Final = 0x40
"""Bits of the polarity 607Eh."""

_REVOLUTIONS: Final = 0xB4
_PER_MINUTE: Final = 0x47
"""Numerator and denominator of a velocity in an SI unit object (CiA 303-2)."""

_ANGLES: Final = {0x10: tau, 0x41: 360.0, _REVOLUTIONS: 1.0}
"""Radians, degrees and revolutions in a turn, by their SI unit number."""

_RPM_DIMENSION: Final = 0xA4
"""Dimension index of revolutions per minute in 608Ch."""

CONFIGURATION: Final = (
    *range(indices.QUICK_STOP_OPTION, indices.FAULT_REACTION_OPTION + 1),
    *range(indices.FOLLOWING_ERROR_WINDOW, indices.POSITION_WINDOW_TIME + 1),
    *range(indices.VELOCITY_WINDOW, indices.VELOCITY_THRESHOLD_TIME + 1),
    *(indices.ABORT_CONNECTION, indices.MAX_TORQUE, indices.MAX_CURRENT),
    *(indices.RATED_CURRENT, indices.RATED_TORQUE, indices.POSITION_RANGE),
    *range(indices.HOME_OFFSET, indices.TORQUE_SLOPE + 1),
    *(indices.VELOCITY_NOTATION, indices.VELOCITY_DIMENSION, indices.ENCODER_RESOLUTION),
    *(indices.GEAR_RATIO, indices.FEED_CONSTANT, indices.HOMING_SPEEDS),
    *(indices.HOMING_ACCELERATION, indices.SI_UNIT_POSITION, indices.SI_UNIT_VELOCITY),
    indices.INTERPOLATION_PERIOD,
    *(indices.MAX_ACCELERATION, indices.MAX_DECELERATION),
    *(indices.POSITIVE_TORQUE_LIMIT, indices.NEGATIVE_TORQUE_LIMIT),
)
"""Objects whose change updates the settings."""


class Units(Part):
    """Converts between objects and the counts of the motor's encoder.

    A position unit is one of these:

    - one count
    - a part of a revolution of the motor according to 6091h and 6092h; a revolution has the
      number of counts in 608Fh
    - an angle after the gear of 6091h, if 60A8h selects an angle, with the power of ten in 60A8h

    A velocity unit is a position unit per second. If 60A9h or 608Ch selects revolutions, the unit
    is revolutions of the motor per minute, with the power of ten in that object. An acceleration
    unit is a velocity unit per second. 607Eh reverses the signs.

    Not emulated: 6090h, 6093h to 6097h; other dimensions.

    Args:
        parameters: objects of the drive, with defaults.
        counts_per_turn: number of counts per revolution of the motor's encoder, if 608Fh does not
            exist.

    Attributes:
        per_position: number of counts in a position unit, with the sign of the unit.
        per_velocity: number of counts per second in a velocity unit, with the sign of the unit.
        per_acceleration: number of counts per second per second in an acceleration unit, without
            sign.
    """

    def __init__(self, parameters: Parameters, counts_per_turn: int) -> None:
        polarity = parameters.number(indices.POLARITY)
        per_turn = _ratio(parameters, indices.ENCODER_RESOLUTION) or float(counts_per_turn)
        position = _angle_unit(parameters, per_turn) or _counts_per_unit(parameters, per_turn)
        velocity = _velocity_unit(parameters, per_turn) or position
        self.per_position = -position if polarity & _POSITION_REVERSED else position
        self.per_velocity = -velocity if polarity & _VELOCITY_REVERSED else velocity
        self.per_acceleration = velocity


@dataclass(frozen=True, slots=True)
class Settings(Immutable):
    """A snapshot of the configuration.

    Positions are in counts from the position at which the encoder was switched on, less the home
    position. Velocities are in counts per second and accelerations in counts per second per
    second. None of these values has the sign of the units. `inf` means no limit.

    Attributes:
        units: units of the user.
        max_velocity: smaller one of 607Fh and 6080h (6080h is in revolutions per minute of the
            motor).
        software_limits: software limits 607Dh with the home offset, as distances from the user's
            zero.
        following_error_us: time for which the following error may be too large (6066h).
        interpolation_us: the interpolation period 60C2h.
        rated_current_a: the rated current 6075h.
        max_current_a: the largest current, from 6072h and 6073h.
        torque_slope_a_s: the torque slope 6087h, in amperes per second.
        limits_a: the current limits from 60E0h and 60E1h, both positive.
    """

    units: Units
    max_velocity: float
    profile_velocity: float
    end_velocity: float
    acceleration: float
    deceleration: float
    quick_stop_deceleration: float
    max_acceleration: float
    max_deceleration: float
    homing_speeds: tuple[float, float]
    homing_acceleration: float
    software_limits: tuple[float, float]
    position_range: tuple[int, int]
    following_error_window: float
    following_error_us: int
    position_window: float
    position_window_us: int
    velocity_window: float
    velocity_window_us: int
    velocity_threshold: float
    velocity_threshold_us: int
    interpolation_us: int
    rated_current_a: float
    max_current_a: float
    limits_a: tuple[float, float]
    torque_slope_a_s: float


def read_settings(parameters: Parameters, counts_per_turn: int) -> Settings:
    """Return the present configuration."""
    read, units = parameters.number, Units(parameters, counts_per_turn)
    velocity, acceleration, position = (
        *(abs(units.per_velocity), units.per_acceleration, abs(units.per_position)),
    )
    rated_current_a = max(1, read(indices.RATED_CURRENT)) / 1_000

    def rate(index: int, most: float = inf) -> float:
        value = read(index)
        return most if value == NO_LIMIT else min(most, max(1, value) * acceleration)

    max_acceleration = rate(indices.MAX_ACCELERATION)
    max_deceleration = rate(indices.MAX_DECELERATION)
    max_velocity = min(
        _limit(read(indices.MAX_PROFILE_VELOCITY), velocity),
        _limit(read(indices.MAX_MOTOR_SPEED), counts_per_turn / 60),
    )
    return Settings(
        units=units,
        max_velocity=max_velocity,
        profile_velocity=min(max_velocity, read(indices.PROFILE_VELOCITY) * velocity),
        end_velocity=min(max_velocity, read(indices.END_VELOCITY) * velocity),
        acceleration=rate(indices.PROFILE_ACCELERATION, max_acceleration),
        deceleration=rate(indices.PROFILE_DECELERATION, max_deceleration),
        quick_stop_deceleration=rate(indices.QUICK_STOP_DECELERATION, max_deceleration),
        max_acceleration=max_acceleration,
        max_deceleration=max_deceleration,
        homing_speeds=(
            max(1, read(indices.HOMING_SPEEDS, 1)) * velocity,
            max(1, read(indices.HOMING_SPEEDS, 2)) * velocity,
        ),
        homing_acceleration=rate(indices.HOMING_ACCELERATION, max_acceleration),
        software_limits=_software_limits(parameters, units),
        position_range=_position_range(parameters),
        following_error_window=_limit(read(indices.FOLLOWING_ERROR_WINDOW), position),
        following_error_us=read(indices.FOLLOWING_ERROR_TIME_OUT) * 1_000,
        position_window=_limit(read(indices.POSITION_WINDOW), position),
        position_window_us=read(indices.POSITION_WINDOW_TIME) * 1_000,
        velocity_window=read(indices.VELOCITY_WINDOW) * velocity,
        velocity_window_us=read(indices.VELOCITY_WINDOW_TIME) * 1_000,
        velocity_threshold=read(indices.VELOCITY_THRESHOLD) * velocity,
        velocity_threshold_us=read(indices.VELOCITY_THRESHOLD_TIME) * 1_000,
        interpolation_us=_period_us(parameters),
        rated_current_a=rated_current_a,
        max_current_a=rated_current_a
        * min(_per_mille(read(indices.MAX_TORQUE)), _per_mille(read(indices.MAX_CURRENT))),
        limits_a=(
            rated_current_a * _per_mille(read(indices.NEGATIVE_TORQUE_LIMIT)),
            rated_current_a * _per_mille(read(indices.POSITIVE_TORQUE_LIMIT)),
        ),
        torque_slope_a_s=_limit(read(indices.TORQUE_SLOPE), rated_current_a / 1_000),
    )


def _limit(value: int, unit: float) -> float:
    return inf if value == NO_LIMIT else value * unit


def _per_mille(value: int) -> float:
    return inf if value == _NO_TORQUE_LIMIT else value / 1_000


def _software_limits(parameters: Parameters, units: Units) -> tuple[float, float]:
    """Return the limits in counts, lower limit first; no limits unless lower is below upper."""
    lower = parameters.number(indices.SOFTWARE_LIMIT, 1)
    upper = parameters.number(indices.SOFTWARE_LIMIT, 2)
    if lower >= upper:
        return -inf, inf
    first, second = sorted((lower * units.per_position, upper * units.per_position))
    widest = abs(units.per_position) * indices.I32_MAX
    return (-inf if first <= -widest else first), (inf if second >= widest else second)


def _position_range(parameters: Parameters) -> tuple[int, int]:
    """Return the range 607Bh, or the whole INTEGER32 if its ends are equal."""
    low, high = (parameters.number(indices.POSITION_RANGE, sub) for sub in (1, 2))
    return (low, high) if low < high else (indices.I32_MIN, indices.I32_MAX)


def _period_us(parameters: Parameters) -> int:
    """Return the period 60C2h, which is at least one tick."""
    value = parameters.number(indices.INTERPOLATION_PERIOD, 1)
    exponent = parameters.number(indices.INTERPOLATION_PERIOD, 2)
    if not -6 <= exponent <= 0:
        return 1_000
    return int(max(1_000, value * 10 ** (6 + exponent)))


def _ratio(parameters: Parameters, index: int) -> float:
    """Return sub-index 1 divided by sub-index 2, or 0 if one of them is 0."""
    numerator, denominator = parameters.number(index, 1), parameters.number(index, 2)
    return numerator / denominator if denominator else 0.0


def _counts_per_unit(parameters: Parameters, per_turn: float) -> float:
    feed = _ratio(parameters, indices.FEED_CONSTANT)
    gear = _ratio(parameters, indices.GEAR_RATIO)
    return per_turn * gear / feed if feed and gear else 1.0


def _angle_unit(parameters: Parameters, per_turn: float) -> float:
    """Return the counts of an angle unit, or 0 if the unit is not an angle."""
    unit = parameters.number(indices.SI_UNIT_POSITION)
    angle = _ANGLES.get(unit >> 16 & 0xFF, 0.0)
    if not angle:
        return 0.0
    gear = _ratio(parameters, indices.GEAR_RATIO) or 1.0
    return per_turn * gear / angle * _power_of_ten(unit >> 24)


def _velocity_unit(parameters: Parameters, per_turn: float) -> float:
    """Return the counts per second of a unit in rpm, or 0 if the unit is not rpm."""
    unit = parameters.number(indices.SI_UNIT_VELOCITY)
    if unit >> 8 & 0xFFFF == _REVOLUTIONS << 8 | _PER_MINUTE:
        exponent = unit >> 24
    elif parameters.number(indices.VELOCITY_DIMENSION) == _RPM_DIMENSION:
        exponent = parameters.number(indices.VELOCITY_NOTATION) & 0xFF
    else:
        return 0.0
    return per_turn / 60 * _power_of_ten(exponent)


def _power_of_ten(exponent: int) -> float:
    """Return the power of ten of an INTEGER8, as a byte."""
    power: float = 10.0 ** ((exponent ^ 0x80) - 0x80)
    return power
