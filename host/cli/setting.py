"""What an input can be set to, and how people write it."""

from __future__ import annotations

from math import isfinite

Setting = int | float | str
"""Most inputs take whole numbers alone."""


def parse_setting(word: str) -> Setting:
    """Read a value: a number where it looks like one, else text.

    >>> [parse_setting(word) for word in ("5", "-0x1F", "1e-3", "ready", "nan")]
    [5, -31, 0.001, 'ready', 'nan']
    """
    for kind in (_parse_whole, _parse_fraction):
        try:
            return kind(word)
        except ValueError:
            continue
    return word


def _parse_whole(word: str) -> int:
    return int(word, 0)


def _parse_fraction(word: str) -> float:
    value = float(word)
    if not isfinite(value):
        raise ValueError
    return value
