"""The gaps of all identifiers of a log, as `Gaps` counts them; needs numpy."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from tickrig.host.monitor.columns.runs import Ints, Runs
from tickrig.host.monitor.traffic.buckets import EXACT_US, SUB_BITS
from tickrig.host.monitor.traffic.gaps import Gaps

MANTISSA_BITS: Final = 52
EXPONENT_BIAS: Final = 1023
COARSE: Final = -1 << 12
"""Leaves as many bits of the longest times as the mantissa has."""


def column_gaps(runs: Runs, gaps_us: Ints) -> list[Gaps]:
    """Return the gaps of each run.

    Args:
        runs: frames by identifier.
        gaps_us: the gap before each row of `runs.order`.
    """
    wander_us = np.abs(np.diff(gaps_us, prepend=0))
    buckets = column_buckets(gaps_us)
    return [
        _of_run(gaps_us[begin + 1 : end], wander_us[begin + 2 : end], buckets[begin + 1 : end])
        for begin, end in zip(runs.begins.tolist(), runs.ends.tolist(), strict=True)
    ]


def _of_run(gaps_us: Ints, wander_us: Ints, buckets: npt.NDArray[np.int16]) -> Gaps:
    gaps = Gaps()
    if len(gaps_us):
        gaps.count, gaps.total_us = len(gaps_us), int(gaps_us.sum())
        gaps.min_us, gaps.max_us = int(gaps_us.min()), int(gaps_us.max())
        gaps.wander_us = int(wander_us.sum())
        lowest = int(buckets.min())
        counts = np.bincount(buckets - lowest)
        filled = np.flatnonzero(counts)
        gaps.buckets = dict(zip((filled + lowest).tolist(), counts[filled].tolist(), strict=True))
    return gaps


def column_buckets(times_us: Ints) -> npt.NDArray[np.int16]:
    """Return the bucket of each time, as `bucket_of` does.

    A bucket is the exponent and the first bits of the mantissa of a floating-point number: both
    are read off its bits. Longer times than it is exact for lose low bits first, so that none is
    rounded up.
    """
    exact = np.where(times_us >> MANTISSA_BITS, times_us & COARSE, times_us)
    bits = exact.astype(np.float64).view(np.int64) >> MANTISSA_BITS - SUB_BITS
    wide = bits - (EXPONENT_BIAS + SUB_BITS - 1 << SUB_BITS)
    return np.where(times_us < EXACT_US, times_us, wide).astype(np.int16)
