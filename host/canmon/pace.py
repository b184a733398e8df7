"""The clock of a verb that sends."""

from __future__ import annotations

import time


class Pace:
    """Time since it was made, in microseconds.

    It sleeps to absolute moments, so what is paced by it does not drift.
    """

    def __init__(self) -> None:
        self._start_ns = time.monotonic_ns()

    @property
    def now_us(self) -> int:
        """The time."""
        return (time.monotonic_ns() - self._start_ns) // 1_000

    def wait_until(self, at_us: int) -> int:
        """Return when it is `at_us`; the answer is how late, in microseconds."""
        early_us = at_us - self.now_us
        if early_us > 0:
            time.sleep(early_us / 1e6)
        return max(0, self.now_us - at_us)
