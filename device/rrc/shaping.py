"""Stick shaping: dead zones and exponent (RRC manual, `joystick` #1 to #6)."""

from __future__ import annotations

from functools import lru_cache


@lru_cache(maxsize=256)
def shape_table(low_pct: int, high_pct: int, exponent: int) -> tuple[int, ...]:
    """Return the output magnitude for each input magnitude from 0 to 100 %.

    The exponent acts on the stick position between the dead zones, and the
    result is rounded half up (DECISION R16).

    Args:
        low_pct: what counts as 0, 0..99 %.
        high_pct: what counts as 100, above `low_pct`, at most 100 %.
        exponent: 0..15; the power is 1 + 0.1 * exponent.
    """
    span, power = high_pct - low_pct, 1 + 0.1 * exponent
    positions = [min(max(a - low_pct, 0), span) / span for a in range(101)]
    return tuple(int(100 * s**power + 0.5 + 1e-9) for s in positions)


def shape(value_pct: int, low_pct: int, high_pct: int, exponent: int) -> int:
    """Shape one axis, -100..100 %; the sign is kept.

    >>> shape(-50, 0, 100, 5)
    -35
    """
    table = shape_table(low_pct, high_pct, exponent)
    return table[value_pct] if value_pct >= 0 else -table[-value_pct]
