"""Whether frames come as often as they should."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

MS_US: Final = 1_000
PERIOD_TOLERANCE: Final = 0.05
"""By this share may the mean of periods be off: CiA 301 says nothing; crystals are far better."""


def off_period(stamps: Sequence[int], each_ms: int, times: int, resolution_us: int) -> str:
    """Say what is wrong with the mean of periods, or with their number; empty if nothing is.

    Args:
        stamps: when frames came, in microseconds; of more than are wanted the first count.
        each_ms: the period that is wanted.
        times: so many periods are wanted, between one frame more.
        resolution_us: of the stamps.

    >>> off_period([0, 53_000, 106_000], 50, 2, 0)
    'each 53.0 ms, want 50 ms, 5 % off at most'
    >>> off_period([0, 50_000], 50, 2, 0), off_period([0, 50_000, 100_000], 50, 2, 0)
    ('came 2 times, want 2 periods of 50 ms', '')
    """
    stamps = stamps[: times + 1]
    seen = max(1, len(stamps) - 1)
    mean_ms = (stamps[-1] - stamps[0]) / seen / MS_US if stamps[1:] else each_ms
    if abs(mean_ms - each_ms) > each_ms * PERIOD_TOLERANCE + resolution_us / seen / MS_US:
        tolerance = f"{PERIOD_TOLERANCE * 100:g} % off at most"
        return f"each {mean_ms:.1f} ms, want {each_ms} ms, {tolerance}"
    if len(stamps) <= times:
        return f"came {len(stamps)} times, want {times} periods of {each_ms} ms"
    return ""
