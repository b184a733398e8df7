"""Actual values: what a drive writes into its objects at the end of a tick."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Final

from tickrig.device.canopen.ds402.objects import indices
from tickrig.device.canopen.ds402.objects.parameters import clamped
from tickrig.device.canopen.ds402.state.statusword import statusword_of

if TYPE_CHECKING:
    from tickrig.device.canopen.ds402.drive import Ds402

Multiplexer = tuple[int, int]
Measure = Callable[["Ds402"], int]


def _velocity(drive: Ds402, counts_s: float) -> int:
    return round(counts_s / drive.settings.units.per_velocity)


MEASURES: Final[Mapping[Multiplexer, Measure]] = {
    (indices.STATUSWORD, 0): statusword_of,
    (indices.POSITION_DEMAND, 0): lambda drive: drive.axis.position_of(drive.reference.position),
    (indices.POSITION_ACTUAL_INTERNAL, 0): lambda drive: drive.motor.counts,
    (indices.POSITION_ACTUAL, 0): lambda drive: drive.axis.position,
    (indices.VELOCITY_DEMAND, 0): lambda drive: _velocity(drive, drive.reference.velocity),
    (indices.VELOCITY_ACTUAL, 0): lambda drive: _velocity(drive, drive.motor.velocity_counts_s),
    (indices.TORQUE_DEMAND, 0): lambda drive: drive.axis.per_mille_of(drive.reference.current_a),
    (indices.TORQUE_ACTUAL, 0): lambda drive: drive.axis.per_mille_of(
        drive.motor.current_ma / 1_000
    ),
    (indices.CURRENT_ACTUAL, 0): lambda drive: drive.axis.per_mille_of(
        drive.motor.current_ma / 1_000
    ),
    (indices.SUPPLY_VOLTAGE, 0): lambda drive: drive.motor.supply_mv,
    (indices.FOLLOWING_ERROR_ACTUAL, 0): lambda drive: round(
        drive.following_error / drive.settings.units.per_position
    ),
    (indices.POSITION_DEMAND_INTERNAL, 0): lambda drive: round(drive.reference.position),
    (indices.DIGITAL_INPUTS, 0): lambda drive: drive.switches.word,
}
"""What the objects say, by (index, sub-index)."""


class Telling:
    """Writes those objects that the device has.

    Args:
        drive: whose objects they are.
        measures: what they tell.
    """

    def __init__(self, drive: Ds402, measures: Mapping[Multiplexer, Measure]) -> None:
        self._drive = drive
        self._rows = [
            (entry, measure, entry.size, entry.description.signed)
            for at, measure in measures.items()
            if (entry := drive.node.dictionary.find(*at)) is not None
        ]

    def tell(self) -> None:
        """Write all of them; a value out of the range of its object is cut."""
        drive = self._drive
        for entry, measure, size, signed in self._rows:
            value = measure(drive)
            try:
                data = value.to_bytes(size, "little", signed=signed)
            except OverflowError:
                value = clamped(value, 8 * size, signed=signed)
                data = value.to_bytes(size, "little", signed=signed)
            entry.assign(data)
