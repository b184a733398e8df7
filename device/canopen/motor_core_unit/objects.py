"""What the objects of the motor core unit ask for, in the units of its motion, and show."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.canopen.motor_core_unit.trajectory import MAX_VELOCITY_UDEG_S
from tickrig.device.canopen.pdo.pdo_consumer import PdoConsumer
from tickrig.device.twin import Part

FULL_SCALE: Final = 0x2010
ANGLE_OFFSET: Final = 0x2011
REFERENCE: Final = 0x6411
ERROR_MODE: Final = 0x6443
ERROR_VALUE: Final = 0x6444

I16_MAX: Final = 0x7FFF
MAX_CURRENT_MA: Final = 10_000
"""Peak (NEDO report, Table 6)."""


class References(Part):
    """Reference, limits and full scales.

    Full scale is 32767. After a failure the error value of 6444h:01 is the reference, if
    6443h:01 is not 0, until another reference comes.

    Args:
        node: the slave.
        on_reference: called when a reference comes after a failure.

    Attributes:
        entries: the objects.
        failed: no reference has come since the failure.
    """

    def __init__(self, node: CanopenSlave, on_reference: Callable[[], None]) -> None:
        dictionary = node.dictionary
        self._angle, self._velocity, self._current = dictionary.elements(FULL_SCALE)
        self._reference, self._velocity_limit, self._current_limit, _ = dictionary.elements(
            REFERENCE
        )
        self._offset = dictionary[ANGLE_OFFSET, 0]
        self._error_mode = dictionary[ERROR_MODE, 1]
        self._error_value = dictionary[ERROR_VALUE, 1]
        self.entries: list[Entry] = [
            *(*dictionary.elements(FULL_SCALE), *dictionary.elements(REFERENCE)),
            *(self._offset, self._error_mode, self._error_value),
        ]
        self.failed = False
        self._node, self._on_reference = node, on_reference
        self._reference.written = self._reference_written

    def start(self) -> None:
        """Know of no failure."""
        self.failed = False
        listeners = PdoConsumer.of(self._node).on_rpdo
        if self._reference_written not in listeners:
            listeners.append(self._reference_written)

    @property
    def number(self) -> int:
        """The reference that counts, -32767..32767."""
        if self.failed and self._error_mode.number:
            return _limited(self._error_value.number, I16_MAX)
        return _limited(self._reference.number, I16_MAX)

    @property
    def offset_mdeg(self) -> int:
        """Where the shaft is when the angle is 0."""
        return self._offset.number

    @property
    def target_ndeg(self) -> int:
        """Where the shaft shall be, in angle mode."""
        angle_ndeg = _part(self.number, self._angle.number * 1_000_000)
        return self.offset_mdeg * 1_000_000 + angle_ndeg

    @property
    def velocity_udeg_s(self) -> int:
        """How fast it shall turn, in velocity mode."""
        wanted = _part(self.number, self._velocity.number * 1_000)
        return _limited(wanted, MAX_VELOCITY_UDEG_S)

    @property
    def current_ma(self) -> int:
        """What shall flow, in current mode."""
        return _limited(_part(self.number, self._current.number), MAX_CURRENT_MA)

    @property
    def velocity_limit_udeg_s(self) -> int:
        """How fast it may turn in angle mode; 0 stands for the limit of the unit."""
        limit = abs(_part(self._velocity_limit.number, self._velocity.number * 1_000))
        return _limited(limit, MAX_VELOCITY_UDEG_S) or MAX_VELOCITY_UDEG_S

    @property
    def current_limit_ma(self) -> int:
        """What may flow; 0 stands for the peak current of the unit."""
        limit = abs(_part(self._current_limit.number, self._current.number))
        return _limited(limit, MAX_CURRENT_MA) or MAX_CURRENT_MA

    def _reference_written(self, source: Entry | int) -> None:
        if self.failed:
            self.failed = False
            self._on_reference()

    def angle(self, angle_mdeg: float) -> int:
        """Return an angle of the shaft as 6401h:01 shows it."""
        return _share(angle_mdeg - self.offset_mdeg, self._angle.number)

    def velocity(self, velocity_mdeg_s: float) -> int:
        """Return a velocity as 6401h:02 shows it."""
        return _share(velocity_mdeg_s, self._velocity.number)

    def current(self, current_ma: float) -> int:
        """Return a current as 6401h:03 shows it."""
        return _share(current_ma, self._current.number)


def _part(reference: int, full_scale: int) -> int:
    """Return reference / 32767 of a full scale, rounded."""
    return (2 * reference * full_scale + I16_MAX) // (2 * I16_MAX)


def _share(value: float, full_scale: int) -> int:
    """Return the 16-bit number that stands for a value; beyond full scale it stays there."""
    return _limited(round(value * I16_MAX / max(1, full_scale)), I16_MAX)


def _limited(value: int, most: int) -> int:
    return max(-most, min(most, value))
