"""What is wrong with a value of a file, and where it stands."""

from __future__ import annotations

from typing import NamedTuple

Keys = tuple[str | int, ...]
"""Keys and indices from the top of a file, as `("device", "left", "start", "supply_v")`."""


class Mistake(NamedTuple):
    """One mistake.

    Attributes:
        keys: where it is.
        reason: what came, and what was allowed.

    >>> print(Mistake(("signal", "load", "over"), "it is missing"))
    signal.load.over: it is missing
    """

    keys: Keys
    reason: str

    def __str__(self) -> str:
        """Write it in one line."""
        return f"{'.'.join(map(str, self.keys))}: {self.reason}"
