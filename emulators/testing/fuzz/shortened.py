"""The acts that a finding needs."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")


def shortened(acts: list[T], fails: Callable[[list[T]], bool]) -> list[T]:
    """Leave out each act without which the same goes wrong.

    Args:
        acts: with all of them it does.
        fails: returns whether it does so with fewer.

    >>> shortened([1, 2, 3, 4], lambda fewer: 2 in fewer and 4 in fewer)
    [2, 4]
    """
    at = len(acts) - 1
    while at >= 0:
        fewer = acts[:at] + acts[at + 1 :]
        if fails(fewer):
            acts = fewer
        at -= 1
    return acts
