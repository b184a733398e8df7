r"""What a host asks of a sensor: symbol, parameters, and a string that comes back with the reply.

>>> Command.parse(b"GD0044072501;left")
Command(symbol='GD', parameters='0044072501', string=';left')
>>> Command("TM", "0").encode()
b'TM0\n'
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from string import ascii_letters, digits
from typing import Final

SYMBOL_BYTES: Final = 2
MOST_STRING: Final = 16
"""Letters that a string may have (SCIP 2.0, communication format)."""

LETTERS: Final = frozenset(ascii_letters + digits + " ._+@")

SIZES: Final[Mapping[str, tuple[int, ...]]] = {
    "MD": (4, 4, 2, 1, 2),
    "MS": (4, 4, 2, 1, 2),
    "GD": (4, 4, 2),
    "GS": (4, 4, 2),
    "BM": (),
    "QT": (),
    "RS": (),
    "TM": (1,),
    "SS": (6,),
    "CR": (2,),
    "HS": (1,),
    "VV": (),
    "PP": (),
    "II": (),
}
"""Characters of each parameter."""


@dataclass(frozen=True, slots=True)
class Command:
    """One command, as it came or goes; nothing of it is checked.

    Attributes:
        symbol: two letters.
        parameters: all, one behind the other.
        string: with its semicolon, empty if there is none.
    """

    symbol: str
    parameters: str = ""
    string: str = ""

    @classmethod
    def parse(cls, line: bytes) -> Command:
        """Read a line without its end."""
        text = line.decode("latin-1")
        head, semicolon, rest = text.partition(";")
        return cls(head[:SYMBOL_BYTES], head[SYMBOL_BYTES:], semicolon + rest)

    @property
    def echo(self) -> bytes:
        """The line with which a reply begins."""
        return f"{self.symbol}{self.parameters}{self.string}".encode("latin-1")

    @property
    def fields(self) -> tuple[str, ...]:
        """The parameters, each for itself, cut as `SIZES` says."""
        out, at = [], 0
        for size in SIZES[self.symbol]:
            out.append(self.parameters[at : at + size])
            at += size
        return tuple(out)

    def encode(self) -> bytes:
        """Return the bytes on the line."""
        return self.echo + b"\n"
