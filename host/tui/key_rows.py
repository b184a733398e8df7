"""What keys do, laid out on few lines.

>>> keys = [Key("f1", "F1", "help"), Key("q", "q", "quit"), Key("space", "space", "pause")]
>>> [[key.text for key in row] for row in key_rows(keys, 16)]
[['F1 help', 'q quit'], ['space pause']]
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple


class Key(NamedTuple):
    """A key.

    Attributes:
        name: as Textual calls it.
        shown: as people do.
        description: what it does.
    """

    name: str
    shown: str
    description: str

    @property
    def text(self) -> str:
        """What stands on the line."""
        return f"{self.shown} {self.description}"


def key_rows(keys: Iterable[Key], width: int) -> list[list[Key]]:
    """Return the keys on lines of so many columns, a blank between two; none is cut or left out."""
    rows: list[list[Key]] = [[]]
    left = width
    for key in keys:
        if rows[-1] and len(key.text) > left:
            rows.append([])
            left = width
        rows[-1].append(key)
        left -= len(key.text) + 1
    return rows


def key_at(row: Iterable[Key], column: int) -> Key | None:
    """Return the key that stands in a column of a line; None between two and behind them."""
    for key in row:
        if 0 <= column < len(key.text):
            return key
        column -= len(key.text) + 1
    return None
