"""The limits of limit mode (RRC manual, `limit`; DECISION R19)."""

from __future__ import annotations

from math import isqrt

from tickrig.wire.rrc.commands import Limit


def apply_limits(v_pct: int, w_pct: int, limit: Limit) -> tuple[int, int]:
    """Return translation and rotation within the limits, signs kept.

    First each input is cut off at its own limit. Then one common factor, which
    keeps the direction, is the smallest that sum, product and radius ask for;
    all is integer and rounds down.

    >>> apply_limits(-100, -100, Limit(70, 100, 120, 30, 90))
    (-45, -65)
    """
    a, b = min(abs(v_pct), limit.v_pct), min(abs(w_pct), limit.w_pct)
    candidates = [(a, b)]
    if a + b > limit.sum_pct:
        candidates.append((a * limit.sum_pct // (a + b), b * limit.sum_pct // (a + b)))
    if a * b > (product := 100 * limit.product_pct):
        candidates.append((isqrt(product * a // b), isqrt(product * b // a)))
    if (square := a * a + b * b) > (most := limit.radius_pct * limit.radius_pct):
        candidates.append((isqrt(a * a * most // square), isqrt(b * b * most // square)))
    a, b = min(c[0] for c in candidates), min(c[1] for c in candidates)
    return (a if v_pct >= 0 else -a), (b if w_pct >= 0 else -b)
