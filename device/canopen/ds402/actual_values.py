"""Actual values: what a drive writes into its objects at the end of a tick (CiA 402-2)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Final

from tickrig.device.canopen.ds402.objects import indices
from tickrig.device.canopen.ds402.objects.parameters import clamped
from tickrig.device.canopen.ds402.state.automaton import DriveState, Statusword

if TYPE_CHECKING:
    from tickrig.device.canopen.core.dictionary import Dictionary
    from tickrig.device.canopen.ds402.drive import Ds402

Measure = Callable[["Ds402"], int]

STATE_BITS: Final = {state: int(state | Statusword.REMOTE) for state in DriveState}
"""What the statusword shows of a state, and that the bus is in control."""

_VOLTAGE_ENABLED: Final = int(Statusword.VOLTAGE_ENABLED)
_WARNING: Final = int(Statusword.WARNING)
_INTERNAL_LIMIT: Final = int(Statusword.INTERNAL_LIMIT)
_FOLLOWING_ERROR: Final = int(Statusword.MODE_13)


def statusword_of(drive: Ds402) -> int:
    """Return what 6041h of a drive shows now."""
    supervision, state = drive.supervision, drive.automaton.state
    status = STATE_BITS[state]
    if supervision.has_supply:
        status |= _VOLTAGE_ENABLED
    if supervision.warns:
        status |= _WARNING
    if drive.limited:
        status |= _INTERNAL_LIMIT
    if state is DriveState.OPERATION_ENABLED:
        status |= int(drive.mode.flags)
        if supervision.not_following and drive.mode.shows_following_error:
            status |= _FOLLOWING_ERROR
    return status


def _velocity(drive: Ds402, counts_s: float) -> int:
    return round(counts_s / drive.axis.settings.units.per_velocity)


MEASURES: Final[Mapping[int, Measure]] = {
    indices.STATUSWORD: statusword_of,
    indices.POSITION_DEMAND: lambda drive: drive.axis.position_of(drive.axis.reference.position),
    indices.POSITION_ACTUAL_INTERNAL: lambda drive: drive.axis.motor.counts,
    indices.POSITION_ACTUAL: lambda drive: drive.axis.position,
    indices.VELOCITY_DEMAND: lambda drive: _velocity(drive, drive.axis.reference.velocity),
    indices.VELOCITY_ACTUAL: lambda drive: _velocity(drive, drive.axis.motor.velocity_counts_s),
    indices.TORQUE_DEMAND: lambda drive: drive.axis.per_mille_of(drive.axis.reference.current_a),
    indices.TORQUE_ACTUAL: lambda drive: drive.axis.per_mille_of(
        drive.axis.motor.current_ma / 1_000
    ),
    indices.CURRENT_ACTUAL: lambda drive: drive.axis.per_mille_of(
        drive.axis.motor.current_ma / 1_000
    ),
    indices.SUPPLY_VOLTAGE: lambda drive: drive.axis.motor.supply_mv,
    indices.FOLLOWING_ERROR_ACTUAL: lambda drive: round(
        drive.axis.following_error / drive.axis.settings.units.per_position
    ),
    indices.POSITION_DEMAND_INTERNAL: lambda drive: round(drive.axis.reference.position),
    indices.DIGITAL_INPUTS: lambda drive: drive.switches.word,
}
"""What the objects show, by index."""


class ActualValues:
    """Writes those objects that the device has.

    Args:
        dictionary: with the objects.
        indices: of actual values.
    """

    def __init__(self, dictionary: Dictionary, indices: Iterable[int]) -> None:
        self._entries = [
            (index, entry, entry.size, entry.description.signed)
            for index in indices
            if (entry := dictionary.find(index)) is not None
        ]

    def update(self, drive: Ds402) -> None:
        """Write all of them; a value out of the range of its object is cut."""
        measures = drive.measures
        for index, entry, size, signed in self._entries:
            value = measures[index](drive)
            try:
                data = value.to_bytes(size, "little", signed=signed)
            except OverflowError:
                value = clamped(value, 8 * size, signed=signed)
                data = value.to_bytes(size, "little", signed=signed)
            entry.assign(data)
