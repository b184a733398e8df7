"""Round numbers along an axis: 1, 2 and 5 times powers of ten.

>>> ticks(0.0, 1.0, 2)
((0.0, '0.0'), (0.5, '0.5'), (1.0, '1.0'))
"""

from __future__ import annotations

from math import ceil, floor, log10
from typing import Final

SMALLEST: Final = 1e-200
"""What is smaller counts as 0."""

Tick = tuple[float, str]
"""Where, and what is written there."""


def ticks(low: float, high: float, about: int) -> tuple[Tick, ...]:
    """Return round numbers between two others.

    Args:
        low: the least.
        high: the greatest, above `low`.
        about: how many are wanted; there are at most twice as many and one.
    """
    exponent, step = _step(low, high, max(1, about))
    digits = max(0, -exponent)
    numbers = [n * step for n in range(ceil(low / step), floor(high / step) + 1)]
    return tuple((number, _text(number, digits)) for number in numbers)


def widened(low: float, high: float) -> tuple[float, float]:
    """Return a range wide enough for floats to tell its ends apart."""
    size = max(abs(low), abs(high))
    if high - low > max(size * 1e-12, SMALLEST):
        return low, high
    margin = size * 0.1 if size > SMALLEST else 1.0
    return low - margin, high + margin


def _step(low: float, high: float, about: int) -> tuple[int, float]:
    rough = (high - low) / about
    exponent = floor(log10(rough))
    mantissa = rough / 10.0**exponent
    factor = next(factor for factor in (1, 2, 5, 10) if mantissa <= factor * 1.000001)
    if factor == 10:
        factor, exponent = 1, exponent + 1
    return exponent, factor * 10.0**exponent


def _text(number: float, digits: int) -> str:
    if digits > 6 or abs(number) >= 1e7:
        return f"{number:.6g}"
    return f"{number:.{digits}f}" if round(number, digits) else f"{0:.{digits}f}"
