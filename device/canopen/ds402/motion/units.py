"""Units of the user and counts of the encoder (CiA 402-2, factor group)."""

from __future__ import annotations

from typing import Final

from tickrig.device.canopen.ds402.objects import indices
from tickrig.device.canopen.ds402.objects.parameters import Parameters

POSITION_REVERSED: Final = 0x80
VELOCITY_REVERSED: Final = 0x40
"""Bits of the polarity 607Eh."""

REVOLUTIONS: Final = 0xB4
PER_MINUTE: Final = 0x47
"""Numerator and denominator of a velocity in an SI unit object (CiA 303-2)."""

RPM_DIMENSION: Final = 0xA4
"""Dimension index of revolutions per minute in 608Ch."""


class Units:
    """Converts between objects and the counts of the motor's encoder.

    A position unit is one count, or what 6091h and 6092h make of a revolution of
    the motor, which has as many counts as 608Fh says. A velocity unit is a
    position unit per second, or revolutions of the motor per minute if 60A9h or
    608Ch says so, with the power of ten that they give; an acceleration unit is a
    velocity unit per second. 607Eh turns the signs.

    Not emulated: 6090h, 6093h to 6097h; other dimensions.

    Args:
        parameters: the objects.
        counts_per_turn: of the motor's encoder, where 608Fh is not there.

    Attributes:
        per_position: counts in a position unit, with its sign.
        per_velocity: counts per second in a velocity unit, with its sign.
        per_acceleration: the same without sign.
    """

    def __init__(self, parameters: Parameters, counts_per_turn: int) -> None:
        polarity = parameters.number(indices.POLARITY)
        per_turn = _ratio(parameters, indices.ENCODER_RESOLUTION) or float(counts_per_turn)
        position = _counts_per_unit(parameters, per_turn)
        velocity = _velocity_unit(parameters, per_turn) or position
        self.per_position = -position if polarity & POSITION_REVERSED else position
        self.per_velocity = -velocity if polarity & VELOCITY_REVERSED else velocity
        self.per_acceleration = velocity


def _ratio(parameters: Parameters, index: int) -> float:
    """Return sub-index 1 by sub-index 2, 0 if one of them is 0."""
    numerator, denominator = parameters.number(index, 1), parameters.number(index, 2)
    return numerator / denominator if denominator else 0.0


def _counts_per_unit(parameters: Parameters, per_turn: float) -> float:
    feed = _ratio(parameters, indices.FEED_CONSTANT)
    gear = _ratio(parameters, indices.GEAR_RATIO)
    return per_turn * gear / feed if feed and gear else 1.0


def _velocity_unit(parameters: Parameters, per_turn: float) -> float:
    """Return the counts per second of a unit in rpm, 0 if the unit is another one."""
    unit = parameters.number(indices.SI_UNIT_VELOCITY)
    if unit >> 8 & 0xFFFF == REVOLUTIONS << 8 | PER_MINUTE:
        exponent = unit >> 24
    elif parameters.number(indices.VELOCITY_DIMENSION) == RPM_DIMENSION:
        exponent = parameters.number(indices.VELOCITY_NOTATION) & 0xFF
    else:
        return 0.0
    power: float = 10.0 ** ((exponent ^ 0x80) - 0x80)
    return per_turn / 60 * power
