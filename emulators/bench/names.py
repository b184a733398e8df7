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
