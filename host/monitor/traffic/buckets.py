"""Buckets for times: exact below 128 us, above it to one part in 64.

>>> bucket_of(100), bucket_of(10_000), bucket_range(bucket_of(10_000))
(100, 526, (9984, 10111))
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Final

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
