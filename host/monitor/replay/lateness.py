"""How late frames went out, in little memory: exact up to 100 ms, to a hundredth above."""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Iterator
from typing import Final

from tickrig.host.monitor.traffic.buckets import bucket_of, middle_us

EXACT_US: Final = 100_000


class Lateness:
    """Counts latenesses.

    Attributes:
        count: how many.
        max_us: the greatest.
        last_us: the latest one: at the end of a replay, its drift.
    """

    def __init__(self) -> None:
        self._exact = array("q", bytes(8 * (EXACT_US + 1)))
        self._above: Counter[int] = Counter()
        self.count = self.max_us = self.last_us = 0

    def add(self, late_us: int) -> None:
        """Count one; what is early counts as on time."""
        self.last_us = late_us = max(0, late_us)
        self.count += 1
        self.max_us = max(self.max_us, late_us)
        if late_us <= EXACT_US:
            self._exact[late_us] += 1
        else:
            self._above[bucket_of(late_us)] += 1

    def percentile_us(self, percent: float) -> int:
        """Return what so many percent, 0 to 100, are not later than; 0 if none were counted."""
        left = self.count * percent / 100
        for late_us, count in self._counts():
            left -= count
            if left <= 0:
                return min(late_us, self.max_us)
        return self.max_us

    def _counts(self) -> Iterator[tuple[int, int]]:
        """Give each lateness, the least first, and how many there are."""
        yield from enumerate(self._exact)
        for bucket in sorted(self._above):
            yield middle_us(bucket), self._above[bucket]

    def __str__(self) -> str:
        """Say it to people."""
        p50, p99 = self.percentile_us(50), self.percentile_us(99)
        return f"late p50 {p50} us, p99 {p99} us, max {self.max_us} us; last {self.last_us} us"
