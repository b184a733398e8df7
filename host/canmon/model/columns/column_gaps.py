"""The gaps of each identifier, block after block, the same as `Gaps` counts them; needs numpy.

What is kept does not grow with the number of gaps: sums, the shortest and the longest, which
are exact, and how many gaps each bucket has (see `gaps`), so that a quantile is at most one
part in 64 too long, and exact below 128 us. A histogram of whole microseconds would be exact
only up to the length that it ends at, and an exact quantile would take the log a second time.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np
import numpy.typing as npt

from tickrig.host.canmon.model.columns.columns import Ints, Runs, grown
from tickrig.host.canmon.model.traffic import EXACT_US, SUB_BITS, Gaps

_MANTISSA_BITS: Final = 52
_EXPONENT_BIAS: Final = 1023
_COARSE: Final = -1 << 12
"""Leaves as many bits of the longest times as the mantissa has."""

_BUCKET_BITS: Final = 12
_BUCKET_MASK: Final = (1 << _BUCKET_BITS) - 1
"""All buckets there are."""

_MERGED: Final = 1 << 16
"""Counts at least that are added up at once."""

_LONGEST_US: Final = np.iinfo(np.int64).max


class ColumnGaps:
    """Counts the gaps of each identifier of a bus.

    Attributes:
        latest_us: the latest gap of each.
    """

    def __init__(self) -> None:
        self.latest_us = self._frames = self._total_us = np.empty(0, np.int64)
        self._min_us = self._max_us = self._wander_us = self.latest_us
        self._keys, self._counts = np.empty(0, np.int64), np.empty(0, np.int64)
        self._new: list[tuple[Ints, Ints]] = []

    def take(self, runs: Runs, count: int) -> None:
        """Count the gaps of a block; there are `count` identifiers now."""
        self._grow(count)
        numbers, gaps_us, firsts = runs.numbers, runs.gaps_us, runs.begins[runs.fresh]
        self._total_us[numbers] += runs.sums(gaps_us)
        self._wander_us[numbers] += runs.sums(self._wander(runs))
        self._frames[numbers] += runs.lengths
        self.latest_us[numbers] = gaps_us[runs.ends - 1]
        longest = np.maximum.reduceat(gaps_us, runs.begins)
        self._max_us[numbers] = np.maximum(self._max_us[numbers], longest)
        self._count(runs, column_buckets(gaps_us))
        if len(firsts):
            self._min_us[numbers[runs.fresh]] = _LONGEST_US
            gaps_us = gaps_us.copy()
            gaps_us[firsts] = _LONGEST_US
        shortest = np.minimum.reduceat(gaps_us, runs.begins)
        self._min_us[numbers] = np.minimum(self._min_us[numbers], shortest)

    def rows(self) -> Iterator[Gaps]:
        """Yield what was counted of each identifier."""
        self._merge()
        yield from map(self._row, range(len(self._frames)))

    def _grow(self, count: int) -> None:
        self.latest_us, self._frames = grown(self.latest_us, count), grown(self._frames, count)
        self._total_us, self._wander_us = (
            grown(self._total_us, count),
            grown(self._wander_us, count),
        )
        self._min_us, self._max_us = grown(self._min_us, count), grown(self._max_us, count)

    def _wander(self, runs: Runs) -> Ints:
        """Return how much each gap differs from the one before; 0 of a first gap."""
        wander_us = np.abs(np.diff(runs.gaps_us, prepend=0))
        begins, frames = runs.begins, self._frames[runs.numbers]
        across = np.abs(runs.gaps_us[begins] - self.latest_us[runs.numbers])
        wander_us[begins] = np.where(frames > 1, across, 0)
        seconds = begins[runs.fresh] + 1
        wander_us[seconds[seconds < runs.ends[runs.fresh]]] = 0
        return wander_us

    def _count(self, runs: Runs, buckets: npt.NDArray[np.int16]) -> None:
        """Count what fell into each bucket of each identifier."""
        # 32 bits are sorted three times as fast as 64.
        places = np.repeat(
            np.arange(len(runs.numbers), dtype=np.int32) << _BUCKET_BITS, runs.lengths
        )
        places += buckets
        places = np.delete(places, runs.begins[runs.fresh])
        places.sort()
        begins = np.flatnonzero(np.diff(places, prepend=-1))
        found, counts = places[begins], np.diff(begins, append=len(places))
        keys = runs.numbers[found >> _BUCKET_BITS] << _BUCKET_BITS | found & _BUCKET_MASK
        self._new.append((keys, counts))
        if sum(len(new) for new, _ in self._new) > max(_MERGED, len(self._keys)):
            self._merge()

    def _merge(self) -> None:
        """Add up what is new; seldom enough that it takes no longer where buckets are many."""
        keys = np.concatenate([self._keys, *(new for new, _ in self._new)])
        counts = np.concatenate([self._counts, *(new for _, new in self._new)])
        order = np.argsort(keys, kind="stable")  # it merges what is sorted already
        keys, counts = keys[order], counts[order]
        begins = np.flatnonzero(np.diff(keys, prepend=-1))
        self._keys, self._new = keys[begins], []
        self._counts = np.add.reduceat(counts, begins) if len(begins) else counts

    def _row(self, number: int) -> Gaps:
        gaps = Gaps()
        gaps.count = int(self._frames[number]) - 1
        if gaps.count:
            gaps.total_us, gaps.wander_us = (
                int(self._total_us[number]),
                int(self._wander_us[number]),
            )
            gaps.min_us, gaps.max_us = int(self._min_us[number]), int(self._max_us[number])
            first = number << _BUCKET_BITS
            begin, end = np.searchsorted(self._keys, (first, first + (1 << _BUCKET_BITS)))
            buckets = (self._keys[begin:end] - first).tolist()
            gaps.buckets = dict(zip(buckets, self._counts[begin:end].tolist(), strict=True))
        return gaps


def column_buckets(times_us: Ints) -> npt.NDArray[np.int16]:
    """Return the bucket of each time, as `bucket_of` does.

    A bucket is the exponent and the first bits of the mantissa of a floating-point number: both
    are read off its bits. Longer times than it is exact for lose low bits first, so that none is
    rounded up.
    """
    exact = np.where(times_us >> _MANTISSA_BITS, times_us & _COARSE, times_us)
    bits = exact.astype(np.float64).view(np.int64) >> _MANTISSA_BITS - SUB_BITS
    wide = bits - (_EXPONENT_BIAS + SUB_BITS - 1 << SUB_BITS)
    return np.where(times_us < EXACT_US, times_us, wide).astype(np.int16)
