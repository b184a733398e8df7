"""The time stamps of a CAN driver on the clock of the host."""

from __future__ import annotations

from typing import Final

DRIFT: Final = 5_000
"""Two clocks part by less than one in so many: 200 ppm."""


class StampClock:
    """Tells by a stamp of the driver when a frame had arrived.

    Where the driver's clock begins is unknown (1970, power-on), and it drifts. A frame
    is read after it has arrived, so the two clocks differ by the least difference that was
    seen. A frame that was not there at the last look has arrived since then: so bad stamps,
    and a driver's clock that is set, matter only while the host is late.

    >>> clock = StampClock()
    >>> clock.at_us(7.0, 0, 100), clock.at_us(7.3, 100, 900_000)  # stopped for 0.9 s
    (100, 300160)
    >>> clock.at_us(0.0, 900_000, 910_000)  # a driver without stamps
    910000
    """

    def __init__(self) -> None:
        self._ahead_us = 0
        self._stamp_us: int | None = None

    def at_us(self, stamp_s: float, looked_us: int, now_us: int) -> int:
        """Return when a frame had arrived.

        Args:
            stamp_s: what the driver says, in seconds on its clock; 0 if it says nothing.
            looked_us: when the last look found nothing more.
            now_us: when the frame was read.
        """
        stamp_us = round(stamp_s * 1e6)
        if stamp_us <= 0:
            return now_us
        ahead_us = now_us - stamp_us
        if self._stamp_us is not None and stamp_us >= self._stamp_us:
            least_us = self._ahead_us + (stamp_us - self._stamp_us) // DRIFT
            ahead_us = min(ahead_us, least_us)
        self._stamp_us, self._ahead_us = stamp_us, ahead_us
        return max(looked_us, stamp_us + ahead_us)
