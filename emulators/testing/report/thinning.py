"""Fewer samples of a signal, without losing a spike.

>>> thinned([(0, 0), (1, 1), (2, 9), (3, 1), (4, 0), (5, 0), (6, -7), (7, 0)], 6)
[(0, 0), (2, 9), (4, 0), (5, 0), (6, -7), (7, 0)]
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from tickrig.emulators.testing.report.bench_report import Value

Point = tuple[int, Value]
"""A time in microseconds, and what the signal was then."""

GROUP: Final = 4


def thinned(points: Sequence[Point], most: int) -> list[Point]:
    """Return at most so many samples: the first, the last, and least and greatest of every four.

    Of four with words among them the first and the last stay; where that are too many samples
    still, it is done again.

    Args:
        points: in the order of time.
        most: how many may stay, at least 4.
    """
    if len(points) <= most:
        return list(points)
    kept = list(points[1:-1])
    while len(kept) > most - 2:
        groups = (kept[at : at + GROUP] for at in range(0, len(kept), GROUP))
        kept = [point for group in groups for point in _ends(group)]
    return [points[0], *kept, points[-1]]


def _ends(group: list[Point]) -> list[Point]:
    """Return two of some samples, in the order of time."""
    numbers = [value for _, value in group if isinstance(value, int | float)]
    if len(numbers) < len(group) or min(numbers) == max(numbers):
        return [group[0], group[-1]] if len(group) > 1 else group
    low, high = sorted((numbers.index(min(numbers)), numbers.index(max(numbers))))
    return [group[low], group[high]]
