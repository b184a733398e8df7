"""Less current for a hot winding."""

from __future__ import annotations

DERATING_K = 15.0  # the limit falls to 0 over these last kelvins below the hottest


def derated_a(limit_a: float, winding_c: float, winding_max_c: float) -> float:
    """Return what is left of a current limit at a temperature of the winding.

    >>> [derated_a(10.0, winding_c, 125.0) for winding_c in (110.0, 119.0, 125.0)]
    [10.0, 4.0, 0.0]
    """
    left = (winding_max_c - winding_c) / DERATING_K
    return limit_a * min(max(left, 0.0), 1.0)
