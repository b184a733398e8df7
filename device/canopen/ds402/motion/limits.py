"""Where a drive may go and how fast: limit switches, software limits, velocity (CiA 402-2)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from tickrig.device.canopen.ds402.motion.reference import Control
from tickrig.device.canopen.ds402.motion.stopping import Ramp
from tickrig.device.canopen.ds402.state.faults import ErrorCode

if TYPE_CHECKING:
    from tickrig.device.canopen.ds402.drive import Ds402


class Limits:
    """Cuts what a mode wants, and stops the motor at the end of its way.

    A pressed limit switch, and a software limit that could not be kept otherwise,
    stop the motor with the quick stop deceleration; it can be moved back. Each
    cut sets bit 11 of the statusword. For a drive whose `limits_are_faults`, it is a
    fault too.

    Args:
        drive: the drive.
    """

    def __init__(self, drive: Ds402) -> None:
        self._drive = drive

    def velocity(self, wanted: float) -> float:
        """Return a velocity, cut to the largest one."""
        most = self._drive.settings.max_velocity
        return self._cut(wanted, -most, most)

    def position(self, counts: float) -> float:
        """Return a position, cut to the software limits."""
        return self._cut(counts, *self._drive.axis.ends)

    def current(self, wanted_a: float) -> float:
        """Return a current, cut to the torque limits of both directions."""
        settings = self._drive.settings
        backward, forward = settings.limits_a
        most = settings.max_current_a
        return self._cut(wanted_a, -min(backward, most), min(forward, most))

    def guard(self, step: Callable[[int], bool], now_us: int) -> bool:
        """Make a step of a mode, or brake if it leads beyond a limit."""
        drive, reference = self._drive, self._drive.reference
        position, velocity = reference.position, reference.velocity
        settled = step(now_us)
        code = self._beyond()
        if code is None:
            return settled
        drive.limited = True
        reference.place(position, velocity)
        if drive.limits_are_faults:
            drive.fault(code)
        return drive.stopping.brake(Ramp.QUICK_STOP)

    def _beyond(self) -> ErrorCode | None:
        """Return what ends the way on which the reference leads, None while it is free."""
        drive, reference = self._drive, self._drive.reference
        towards = reference.velocity
        if drive.control is Control.CURRENT:
            towards = towards or reference.current_a
        if not towards:
            return None
        if towards * drive.axis.forward > 0:
            if drive.switches.positive_limit:
                return ErrorCode.POSITIVE_LIMIT
        elif drive.switches.negative_limit:
            return ErrorCode.NEGATIVE_LIMIT
        ends = drive.control is not Control.POSITION and self._room(towards) <= 0
        return ErrorCode.SOFTWARE_LIMIT if ends else None

    def _room(self, towards: float) -> float:
        """Return the counts that are left before the motor has to brake for a software limit."""
        drive, reference = self._drive, self._drive.reference
        low, high = drive.axis.ends
        way = high - reference.position if towards > 0 else reference.position - low
        return way - reference.velocity**2 / (2 * drive.settings.quick_stop_deceleration)

    def _cut(self, wanted: float, low: float, high: float) -> float:
        cut = max(low, min(high, wanted))
        if cut != wanted:
            self._drive.limited = True
        return cut
