"""What an input can be set to, and how people write it."""

from __future__ import annotations

Setting = int | float | str
"""Most inputs take whole numbers alone."""


def parse_setting(word: str) -> Setting:
    """Read a value: a number where it looks like one, else text.

    >>> [parse_setting(word) for word in ("5", "-0x1F", "1e-3", "ready")]
    [5, -31, 0.001, 'ready']
    """
    for kind in (_parse_whole, float):
        try:
            return kind(word)
        except ValueError:
            continue
    return word


def _parse_whole(word: str) -> int:
    return int(word, 0)
