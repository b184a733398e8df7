"""Times of frames, as logs tell them in seconds.

>>> to_us(1.25), to_us(0)
(1250000, 0)
"""

from __future__ import annotations

from typing import Final

END_S: Final = 10**12
"""Twelve digits of seconds: what a candump log may have in front of the dot."""


def to_us(seconds: float) -> int:
    """Return microseconds; ValueError if that is no time: nan, below 0, `END_S` or more."""
    if not 0 <= seconds < END_S:
        raise ValueError(f"{seconds!r} s is not 0 to below 1e12 s")
    return round(seconds * 1e6)
