"""The times between frames of one identifier.

>>> bucket_of(100), bucket_of(10_000), bucket_range(bucket_of(10_000))
(100, 526, (9984, 10111))
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Final, NamedTuple

SUB_BITS: Final = 6
EXACT_US: Final = 1 << SUB_BITS + 1
"""Times below it have a bucket each."""

KEPT: Final = 2_048
"""Buckets whose middle need not be computed again: all there are below an hour."""


def bucket_of(time_us: int) -> int:
    """Return the bucket of a time, 0 or more."""
    if time_us < EXACT_US:
        return time_us
    shift = time_us.bit_length() - SUB_BITS - 1
    return (shift << SUB_BITS) + (time_us >> shift)


def bucket_range(bucket: int) -> tuple[int, int]:
    """Return the shortest and the longest time of a bucket."""
    if bucket < EXACT_US:
        return bucket, bucket
    shift = (bucket >> SUB_BITS) - 1
    low = (bucket & (1 << SUB_BITS) - 1 | 1 << SUB_BITS) << shift
    return low, low + (1 << shift) - 1


@lru_cache(maxsize=KEPT)
def middle_us(bucket: int) -> int:
    """Return the time in the middle of a bucket."""
    low, high = bucket_range(bucket)
    return (low + high) // 2


def quantile(counts: Mapping[int, int], per_mille: int) -> int:
    """Return the bucket that holds the value at a share of all, counted from the lowest.

    Args:
        counts: how many values each bucket has, at least one in all.
        per_mille: the share, 1 to 1000.
    """
    rank = -(-sum(counts.values()) * per_mille // 1_000)
    for bucket in sorted(counts):
        rank -= counts[bucket]
        if rank <= 0:
            return bucket
    raise ValueError("no values")


MEDIAN: Final = 500
P99: Final = 990

NEAR_CYCLE: Final = 4
"""A gap is near the cycle if it differs from it by no more than this part of it."""

CYCLIC_PERCENT: Final = 75
"""So many gaps must be near the cycle, else there is none."""


class GapRow(NamedTuple):
    """What the gaps of one identifier were, all of them.

    Attributes:
        min_us: the shortest.
        mean_us: rounded down.
        p99_us: no more than 1 % were longer; it is at most one part in 64 too long.
        max_us: the longest.
        jitter_us: mean of how much a gap differs from the one before, rounded down.
        cycle_us: of frames that came and frames that missed; None unless three quarters of the
            gaps are within a quarter of the median.
        missed: frames of that cycle that did not come, at most; None without a cycle.
    """

    min_us: int
    mean_us: int
    p99_us: int
    max_us: int
    jitter_us: int
    cycle_us: int | None
    missed: int | None


class Gaps:
    """Counts gaps; what it keeps does not grow with their number.

    Attributes:
        count: how many gaps.
        total_us: their sum.
        min_us: the shortest.
        max_us: the longest.
        wander_us: the sum of how much each differs from the one before.
        buckets: how many gaps each bucket has.
    """

    __slots__ = ("_last_us", "buckets", "count", "max_us", "min_us", "total_us", "wander_us")

    def __init__(self) -> None:
        self.count = self.total_us = self.min_us = self.max_us = self.wander_us = 0
        self.buckets: dict[int, int] = {}
        self._last_us = 0

    def take(self, gap_us: int) -> None:
        """Count a gap, 0 or more."""
        if not self.count:
            self.min_us = self.max_us = self._last_us = gap_us
        elif gap_us < self.min_us:
            self.min_us = gap_us
        elif gap_us > self.max_us:
            self.max_us = gap_us
        self.count += 1
        self.total_us += gap_us
        self.wander_us += abs(gap_us - self._last_us)
        self._last_us = gap_us
        bucket = bucket_of(gap_us)
        self.buckets[bucket] = self.buckets.get(bucket, 0) + 1

    def row(self) -> GapRow | None:
        """Return what they were; None before the first."""
        if not self.count:
            return None
        p99_us = min(self.max_us, bucket_range(quantile(self.buckets, P99))[1])
        about_us = self._median_if_cyclic()
        missed = None if about_us is None else self._missed(about_us)
        return GapRow(
            self.min_us,
            self.total_us // self.count,
            p99_us,
            self.max_us,
            self.wander_us // max(1, self.count - 1),
            None if missed is None else self.total_us // (self.count + missed),
            missed,
        )

    def _median_if_cyclic(self) -> int | None:
        cycle_us = middle_us(quantile(self.buckets, MEDIAN))
        near = sum(
            count
            for bucket, count in self.buckets.items()
            if abs(middle_us(bucket) - cycle_us) * NEAR_CYCLE <= cycle_us
        )
        return cycle_us if cycle_us and near * 100 >= self.count * CYCLIC_PERCENT else None

    def _missed(self, cycle_us: int) -> int:
        """Count whole cycles in which nothing came: a gap of 1.5 to 2.5 cycles missed one."""
        return sum(
            count * max(0, (2 * middle_us(bucket) + cycle_us) // (2 * cycle_us) - 1)
            for bucket, count in self.buckets.items()
        )
