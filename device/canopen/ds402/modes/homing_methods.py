"""Homing methods as a table (CiA 402-2, homing mode; figures of the methods)."""

from __future__ import annotations

from enum import IntFlag
from typing import Final, NamedTuple


class Switch(IntFlag):
    """The switches of an axis, by their bits in 60FDh."""

    NEGATIVE_LIMIT = 1
    POSITIVE_LIMIT = 2
    HOME = 4


class HomingMethod(NamedTuple):
    """Where home is and how it is looked for.

    Attributes:
        switch: whose edge is looked for, None if no edge is.
        first: direction of the search when the switch is not active.
        approach: direction in which the edge, then the index pulse, is crossed at last.
        active: whether the switch is active behind the edge, seen in that direction.
        turns: whether the search turns round at the limit switch of its first direction.
        by_index: whether home is the next index pulse behind the edge.
    """

    switch: Switch | None
    first: int
    approach: int
    active: bool
    turns: bool
    by_index: bool


_NEGATIVE: Final = Switch.NEGATIVE_LIMIT
_POSITIVE: Final = Switch.POSITIVE_LIMIT
_HOME: Final = Switch.HOME

_EDGES: Final = {
    17: (_NEGATIVE, -1, +1, False, False),
    18: (_POSITIVE, +1, -1, False, False),
    19: (_HOME, +1, -1, False, False),
    20: (_HOME, +1, +1, True, False),
    21: (_HOME, -1, +1, False, False),
    22: (_HOME, -1, -1, True, False),
    23: (_HOME, +1, -1, False, True),
    24: (_HOME, +1, +1, True, True),
    25: (_HOME, +1, -1, True, True),
    26: (_HOME, +1, +1, False, True),
    27: (_HOME, -1, +1, False, True),
    28: (_HOME, -1, -1, True, True),
    29: (_HOME, -1, +1, True, True),
    30: (_HOME, -1, -1, False, True),
}
"""Methods that end at an edge, as rows of `HomingMethod`; 16 less goes on to the index pulse."""

METHODS: Final[dict[int, HomingMethod]] = {
    **{number - 16: HomingMethod(*edge, by_index=True) for number, edge in _EDGES.items()},
    **{number: HomingMethod(*edge, by_index=False) for number, edge in _EDGES.items()},
    33: HomingMethod(None, -1, -1, active=False, turns=False, by_index=True),
    34: HomingMethod(None, +1, +1, active=False, turns=False, by_index=True),
    35: HomingMethod(None, 0, 0, active=False, turns=False, by_index=False),
    37: HomingMethod(None, 0, 0, active=False, turns=False, by_index=False),
}
"""By the number in 6098h; 35 and 37 take the present position."""

LIMIT: Final = {-1: Switch.NEGATIVE_LIMIT, 0: Switch(0), +1: Switch.POSITIVE_LIMIT}
"""The limit switch ahead, by direction."""
