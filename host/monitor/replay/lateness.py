"""How late frames went out: exact to a microsecond up to 100 ms, in little memory."""

from __future__ import annotations

from array import array
from itertools import accumulate
from typing import Final

MOST_US: Final = 100_000
"""What is later counts as this, but for the maximum."""


class Lateness:
    """Counts latenesses.

    Attributes:
        count: how many.
        max_us: the greatest.
        last_us: the latest one: at the end of a replay, its drift.
    """

    def __init__(self) -> None:
        self._counts = array("q", bytes(8 * (MOST_US + 1)))
        self.count = self.max_us = self.last_us = 0

    def add(self, late_us: int) -> None:
        """Count one; what is early counts as on time."""
        self.last_us = late_us = max(0, late_us)
        self.count += 1
        self.max_us = max(self.max_us, late_us)
        self._counts[min(late_us, MOST_US)] += 1

    def percentile_us(self, percent: float) -> int:
        """Return what so many percent, 0 to 100, are not later than; 0 if none were counted."""
        wanted = self.count * percent / 100
        sums = enumerate(accumulate(self._counts))
        return min(next(late_us for late_us, seen in sums if seen >= wanted), self.max_us)

    def __str__(self) -> str:
        """Say it to people."""
        p50, p99 = self.percentile_us(50), self.percentile_us(99)
        return f"late p50 {p50} us, p99 {p99} us, max {self.max_us} us; last {self.last_us} us"
