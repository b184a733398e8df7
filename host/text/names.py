"""Names that a person could have meant, in a line that is not too long."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

MOST: Final = 40
SHOWN: Final = 8


def known(names: Iterable[str]) -> str:
    """List the names, or say how many there are and give the first ones.

    >>> known(["stick", "lamp"])
    'stick, lamp'
    """
    everything = list(names)
    if len(everything) <= MOST:
        return ", ".join(everything)
    return ", ".join(everything[:SHOWN]) + f", ... ({len(everything)} in all)"


def near(name: str, names: Iterable[str]) -> str:
    """Say which name could be meant, or which there are.

    >>> near("stik", ["stick", "lamp"]), near("x", ["stick", "lamp"])
    ("did you mean 'stick'?", 'known: stick, lamp')
    """
    names = list(names)
    if close := closest(name, names):
        return f"did you mean {close[0]!r}?"
    return f"known: {known(names) or 'none'}"


def closest(name: str, names: Iterable[str]) -> list[str]:
    """Return the name that could be meant, if there is one; small and capital letters are alike.

    >>> closest("EPOS", ["epos", "rrc"]), closest("stik", ["left/stick", "right/stick"])
    (['epos'], ['left/stick'])
    """
    from difflib import get_close_matches  # noqa: PLC0415 - only for mistakes

    alike: dict[str, str] = {}
    for each in (names := list(names)):
        alike.setdefault(each.casefold(), each)
    for each in names:  # of a device that was not said
        alike.setdefault(each.rpartition("/")[2].casefold(), each)
    return [alike[each] for each in get_close_matches(name.casefold(), alike, n=1)]
