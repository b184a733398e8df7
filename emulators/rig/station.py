"""A device on a port, and when it has work."""

from __future__ import annotations

from typing import TYPE_CHECKING, Generic

from tickrig.device.core import Device, W
from tickrig.device.twin import Part
from tickrig.emulators.rig.port import Port
from tickrig.emulators.rig.wire_port import is_wire_port
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.emulators.rig.rig import Timetable


class Station(Part, Generic[W]):
    """A device on a port.

    Attributes:
        at_us: the tick for which it stands in the timetable of its rig.
    """

    __slots__ = ("_timetable", "at_us", "device", "port", "tick_us")

    def __init__(self, device: Device[W], port: Port[W]) -> None:
        self.device, self.port, self.tick_us = device, port, device.tick_us
        self.at_us: int = NEVER
        self._timetable: Timetable | None = None

    def stand_in(self, timetable: Timetable | None) -> None:
        """Enter itself in a timetable when traffic arrives; without one it is looked at anyway."""
        self._timetable = timetable
        if is_wire_port(self.port):
            self.port.attach(self.device, self._wake)

    def _wake(self, at_us: int) -> None:
        if at_us < self.at_us and self._timetable is not None:
            self._timetable.enter(self, at_us)

    def wake_us(self, now_us: int) -> int:
        """Return the first tick after `now_us` at which this station has work."""
        return next_tick_us(now_us, min(self.device.due_us, self.port.due_us), self.tick_us)


def next_tick_us(now_us: int, due_us: int, tick_us: int) -> int:
    """Return the first tick after `now_us` that is not before `due_us`, which may be `NEVER`."""
    first_us = now_us - now_us % tick_us + tick_us
    if due_us <= first_us:
        return first_us
    return -(-due_us // tick_us) * tick_us
