"""What is wrong with a bus.yml and the files that it goes with, a line each."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from tickrig.host.canopen.bus_file.item import Place


class Mistake(NamedTuple):
    """One thing that is wrong.

    Attributes:
        place: its file and line.
        text: which key, what came, and what was allowed.
    """

    place: Place
    text: str

    def __str__(self) -> str:
        """Write it as compilers do."""
        return f"{self.place}: {self.text}"


class BusMistakesError(ValueError):
    """Files of which no slaves can be made.

    Attributes:
        mistakes: all that is wrong, by file and line.
    """

    def __init__(self, mistakes: Iterable[Mistake]) -> None:
        self.mistakes = tuple(dict.fromkeys(sorted(mistakes)))
        super().__init__("\n".join(map(str, self.mistakes)))
