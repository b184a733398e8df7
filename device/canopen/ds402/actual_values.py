"""Actual values: objects with the measurements of a drive, valid after a tick (CiA 402-2)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Final

from tickrig.device.canopen.ds402 import indices
from tickrig.device.canopen.ds402.settings import clamped
from tickrig.device.twin import Part
from tickrig.wire.canopen.drive import DriveState, Statusword

if TYPE_CHECKING:
    from tickrig.device.canopen.dictionary import Dictionary, Entry
    from tickrig.device.canopen.ds402.drive import Ds402

Measure = Callable[["Ds402"], int]

_STATE_BITS: Final = {state: int(state | Statusword.REMOTE) for state in DriveState}
"""Bits of the statusword by state, and the bit for control over the bus."""

_VOLTAGE_ENABLED: Final = int(Statusword.VOLTAGE_ENABLED)
_WARNING: Final = int(Statusword.WARNING)
_INTERNAL_LIMIT: Final = int(Statusword.INTERNAL_LIMIT)
_FOLLOWING_ERROR: Final = int(Statusword.MODE_13)


def statusword_of(drive: Ds402) -> int:
    """Return the present statusword 6041h of a drive."""
    limited = drive.limited  # first, as it catches up: the winding warms up in the ticks ahead
    supervision, state = drive.supervision, drive.automaton.state
    status = _STATE_BITS[state]
    if supervision.has_supply:
        status |= _VOLTAGE_ENABLED
    if supervision.warns:
        status |= _WARNING
    if limited:
        status |= _INTERNAL_LIMIT
    if state is DriveState.OPERATION_ENABLED:
        status |= drive.mode.flags
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
"""Functions for the actual values, by index."""


class ActualValues(Part):
    """The objects of a drive that show actual values, such as position, velocity and current.

    A value is computed when its object is read. Watchers are functions that are called when the
    value of an object changes. An object with watchers is computed in each tick. The other objects
    are not, which saves time, because most objects are seldom read.

    Args:
        drive: drive that supplies the values. Its attribute `measures` has a function for each
            index.
        dictionary: dictionary of the drive, which may lack some of the objects.

    Attributes:
        watched: whether any of the objects has watchers, so that each tick has to compute it.
    """

    def __init__(self, drive: Ds402, dictionary: Dictionary) -> None:
        self._drive = drive
        found = (dictionary.find(index) for index in drive.measures)
        self._entries = [entry for entry in found if entry is not None]
        for entry in self._entries:
            entry.source, entry.measured = self._shown, True
        self._kept, self.watched = True, False

    def keep(self) -> None:
        """Store the present values in the objects, before the drive changes something.

        Reads return the stored values until `renew` is called at the end of the tick. So the bus
        does not read a value from the middle of a tick.
        """
        if not self._kept:
            for entry in self._entries:
                entry.assign(self._encoded(entry))
            self._kept = True

    def begin(self) -> None:
        """Let the bus read the stored values while the drive works."""
        self._kept = True

    def renew(self) -> None:
        """Let the bus read the new values of the drive, and call the watchers."""
        self._kept = self.watched = False
        for entry in self._entries:
            if entry.watchers:
                self.watched = True
                entry.assign(self._encoded(entry))

    def _shown(self, entry: Entry) -> bytes:
        return entry.data if self._kept else self._encoded(entry)

    def _encoded(self, entry: Entry) -> bytes:
        """Return a value as bytes; a value outside the range of its object is truncated."""
        size, signed = entry.size, entry.description.signed
        value = self._drive.measures[entry.index](self._drive)
        try:
            return value.to_bytes(size, "little", signed=signed)
        except OverflowError:
            return clamped(value, 8 * size, signed=signed).to_bytes(size, "little", signed=signed)
