r"""The motion that the motor core unit plans: a trapezoid, exact in whole numbers.

>>> motion = Trajectory()
>>> ticks = 0
>>> while motion.position_ndeg != 90 * DEGREE:
...     motion.approach(90 * DEGREE, MAX_VELOCITY_UDEG_S)
...     ticks += 1
>>> ticks * CONTROL_US
350000
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isqrt
from typing import Final

CONTROL_US: Final = 10_000
"""The control tick (DECISION K19)."""

DEGREE: Final = 1_000_000_000
"""Nanodegrees."""

MAX_VELOCITY_UDEG_S: Final = 360_000_000
MAX_ACCELERATION_UDEG_S2: Final = 3_600_000_000
CHANGE_UDEG_S: Final = MAX_ACCELERATION_UDEG_S2 * CONTROL_US // 1_000_000
"""By how much the velocity changes in a control tick, at most."""

_NDEG: Final = CONTROL_US // 2_000
"""Nanodegrees that a tick adds for 1 udeg/s at its begin, and for 1 udeg/s at its end."""

_LANDING_NDEG: Final = 1_000
"""A microdegree: what whole velocities may leave at the end of an approach."""


@dataclass(slots=True)
class Trajectory:
    """Position and velocity, stepped by control ticks of constant acceleration.

    Not emulated: a limit of the jerk.

    Attributes:
        position_ndeg: at the end of the present control tick.
        velocity_udeg_s: likewise.
        begin_ndeg: position at the begin of the control tick.
        begin_udeg_s: velocity at the begin of the control tick.
    """

    position_ndeg: int = 0
    velocity_udeg_s: int = 0
    begin_ndeg: int = 0
    begin_udeg_s: int = 0

    def place(self, position_ndeg: int, velocity_udeg_s: int) -> None:
        """Go on from a motion that is not its own."""
        self.position_ndeg, self.velocity_udeg_s = position_ndeg, velocity_udeg_s
        self._begin()

    def approach(self, target_ndeg: int, limit_udeg_s: int) -> None:
        """Step so that it comes to a stop at the target, as early as the limits allow.

        Args:
            target_ndeg: where to stop.
            limit_udeg_s: velocity, positive.
        """
        distance = target_ndeg - self.position_ndeg
        last = _NDEG * self.velocity_udeg_s
        if abs(self.velocity_udeg_s) <= CHANGE_UDEG_S and abs(distance - last) <= _LANDING_NDEG:
            self._begin()
            self.position_ndeg, self.velocity_udeg_s = target_ndeg, 0
            return
        wanted = _stoppable_udeg_s(abs(distance - last))
        wanted = min(wanted, limit_udeg_s)
        self.run(wanted if distance >= last else -wanted)

    def run(self, velocity_udeg_s: int) -> None:
        """Step towards a velocity."""
        self._begin()
        change = velocity_udeg_s - self.velocity_udeg_s
        self.velocity_udeg_s += max(-CHANGE_UDEG_S, min(CHANGE_UDEG_S, change))
        self.position_ndeg += _NDEG * (self.begin_udeg_s + self.velocity_udeg_s)

    def at(self, since_us: int) -> tuple[float, float, float]:
        """Return position in deg, velocity in deg/s and acceleration in deg/s^2 within the tick.

        Args:
            since_us: since the begin of the control tick, 0..`CONTROL_US`.
        """
        acceleration = (self.velocity_udeg_s - self.begin_udeg_s) / CONTROL_US
        since_s, begin = since_us / 1e6, self.begin_udeg_s / 1e6
        position = self.begin_ndeg / DEGREE + since_s * (begin + acceleration * since_s / 2)
        return position, begin + acceleration * since_s, acceleration

    def _begin(self) -> None:
        self.begin_ndeg, self.begin_udeg_s = self.position_ndeg, self.velocity_udeg_s


def _stoppable_udeg_s(distance_ndeg: int) -> int:
    """Return the velocity at the end of a tick from which it stops just within a distance.

    The distance is what the tick itself adds for its end velocity v, and the
    stop: full brake ticks, the last one shorter. With m full ones it is
    (2 (m + 1) v - m (m + 1) CHANGE) * _NDEG; at v = m * CHANGE, m (m + 1) * CHANGE * _NDEG.
    """
    full = (isqrt(1 + 4 * (distance_ndeg // (_NDEG * CHANGE_UDEG_S))) - 1) // 2
    return (distance_ndeg // _NDEG + full * (full + 1) * CHANGE_UDEG_S) // (2 * (full + 1))
