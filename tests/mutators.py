"""What makers of mutated files share: letters, lines, cut off, noise, accidents.

A seed always gives the same file, so a fault that was found is found again.
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


def spoilt(data: bytes, chance: Random) -> bytes:
    """Return a file that was cut, spoilt, or edited by somebody in a hurry."""
    out = bytearray(data)
    for _ in range(chance.randint(1, 4)):
        at = chance.randrange(len(out)) if out else 0
        match chance.randrange(7):
            case 0:
                del out[at:]
            case 1:
                out[at : at + 1] = bytes([chance.randrange(256)])
            case 2:
                del out[at : at + chance.randint(1, 30)]
            case 3:
                out[at:at] = bytes(chance.choices(b'0123456789.#"{}[]:,=<>!~ \\nx-e', k=3))
            case 4:
                lines = bytes(out).split(b"\n")
                chance.shuffle(lines)
                out = bytearray(b"\n".join(lines))
            case 5:
                out[at:at] = bytes(out[: chance.randint(1, 60)])
            case 6:
                numbers = [b"-1", b"1e999", b"NaN", b"null", b"true", b'""', b"[]", b"9" * 40]
                out[at : at + 1] = chance.choice(numbers)
    return bytes(out)
