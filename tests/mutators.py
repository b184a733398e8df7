"""What makers of mutated files share: letters, lines, cut off, noise.

What comes of a seed stays: a fault that was found is found again.
"""

from __future__ import annotations

from collections.abc import Sequence
from random import Random


def with_piece(pieces: Sequence[str], text: str, chance: Random) -> str:
    """Return a text with a piece in it somewhere, or without a few letters."""
    at = chance.randrange(len(text) + 1)
    return text[:at] + chance.choice([chance.choice(pieces), ""]) + text[at + chance.randrange(3) :]


def with_line(text: str, chance: Random) -> str:
    """Return a text of which a line is elsewhere, twice, or gone."""
    lines = text.split("\n")
    line = lines.pop(chance.randrange(len(lines)))
    for _ in range(chance.choice([0, 1, 1, 2])):
        lines.insert(chance.randrange(len(lines) + 1), line)
    return "\n".join(lines)


def damaged(data: bytes, chance: Random, how: int) -> bytes:
    """Return a file that is cut off (0), or has noise in it (1); any other number: as it is."""
    match how:
        case 0:
            return data[: chance.randrange(len(data) + 1)]
        case 1:
            at = chance.randrange(len(data) + 1)
            return data[:at] + chance.randbytes(chance.choice([1, 2, 40])) + data[at:]
    return data
