"""Where a drive may go and how fast: limit switches, software limits, velocity (CiA 402-2)."""

from __future__ import annotations

from tickrig.device.canopen.ds402.motion.axis import Axis
from tickrig.device.canopen.ds402.motion.reference import Control
from tickrig.device.canopen.ds402.motion.switches import Switches
from tickrig.device.canopen.ds402.objects.error_codes import ErrorCode
from tickrig.device.twin import Part

Clamped = tuple[float, bool]
"""A demand, or the limit that is nearest to it, and whether that is another value."""


class Limits(Part):
    """What an axis may do.

    Args:
        axis: whose settings count.
        switches: its limit switches.
    """

    def __init__(self, axis: Axis, switches: Switches) -> None:
        self._axis, self._switches = axis, switches

    def velocity(self, wanted: float) -> Clamped:
        """Clamp a velocity, in counts per second, to the largest one."""
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
        """Return what ends the way on which the reference leads, None while it is free.

        That is a pressed limit switch, or a software limit that could not be kept otherwise.
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
        """Return the counts that are left before the motor has to brake for a software limit."""
        axis, reference = self._axis, self._axis.reference
        low, high = axis.ends
        way = high - reference.position if towards > 0 else reference.position - low
        return way - reference.velocity**2 / (2 * axis.settings.quick_stop_deceleration)


def _clamp(wanted: float, low: float, high: float) -> Clamped:
    value = max(low, min(high, wanted))
    return value, value != wanted
