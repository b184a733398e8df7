"""Times of values and of messages: one counts from the start of a system, the other from 1970."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

from tickrig.wire.rtc_types.basic import Time

FAR_US: Final = 1_000_000
"""A value that is farther from the present counts its time on another clock, or not at all."""

ASTRAY_NS: Final = 10_000_000_000
"""A system that is so late, or a clock that was set, has the times related anew."""


class Stamps:
    """Converts between the time of a system and that of the machine.

    Values of one time have one stamp, so a pose and its transform do. A value whose time is
    more than 1 s off that of the system gets the present one. What a late system makes up for
    has the time at which it was due.

    Args:
        now_us: tells the time of the system.
        clock: nanoseconds since 1970.
    """

    def __init__(self, now_us: Callable[[], int], clock: Callable[[], int] = time.time_ns) -> None:
        self._now_us, self._clock = now_us, clock
        self.start()

    def start(self) -> None:
        """Relate the present times."""
        self._start_ns = self._clock() - 1_000 * self._now_us()

    def to_ros(self, tm: Time) -> tuple[int, int]:
        """Return the stamp of a value, in seconds and nanoseconds."""
        now_us, tm_us = self._now_us(), tm.us
        if not -FAR_US <= tm_us - now_us <= FAR_US:
            tm_us = now_us
        if not -ASTRAY_NS <= self._start_ns + 1_000 * tm_us - self._clock() <= ASTRAY_NS:
            self.start()
        return divmod(self._start_ns + 1_000 * tm_us, 1_000_000_000)

    def to_system(self, sec: int = 0, nanosec: int = 0) -> Time:
        """Return the time of a message that has this stamp, the present without one."""
        now_us = self._now_us()
        at_us = (sec * 1_000_000_000 + nanosec - self._start_ns) // 1_000
        if not -FAR_US <= at_us - now_us <= FAR_US:
            at_us = now_us
        return Time.from_us(max(0, at_us))
