"""What the words of macros say before they are played: what is written, and how long it lasts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final

from tickrig.host.canopen.conform.notation.names import Address

DOWNLOADS: Final = frozenset({"segdn", "blkdn"})
MAP: Final = "map"
ENABLE: Final = "enable"
REFUSE_SEGMENTS: Final = "refusesegments"
FOLLOW: Final = "follow"
TO_MAPPING: Final = 0x200
"""A mapping parameter is so far behind its communication parameter."""

PER_BYTE_US: Final = 2_500
"""What a byte of a transfer takes at most: two frames for seven, at 30 % of 125 kbit/s."""
TRANSFER_MS: Final = 5_000


def written_by(name: str, *words: Any) -> tuple[Address, ...]:
    """Return what a bound macro writes.

    >>> written_by("segdn", (0x2008, 0), "1000"), written_by("segup", (0x2008, 0), "1000")
    (((8200, 0),), ())
    """
    if name in DOWNLOADS or name in {FOLLOW, REFUSE_SEGMENTS}:
        return (words[0],)
    if name == ENABLE:
        communication = words[0][0]
        entries = ((communication + TO_MAPPING, sub) for sub in range(len(words) - 1))
        return ((communication, 1), *entries)
    if name == MAP:
        communication = words[0][0]
        entries = ((communication + TO_MAPPING, sub) for sub in range(len(words) - 2))
        return ((communication, 1), (communication, 2), *entries)
    return ()


def longest_ms(name: str, words: Sequence[Any]) -> int:
    """Return how long a bound macro lasts at most."""
    return _LONGEST_MS[name](words)


def _transfer(words: Sequence[Any]) -> int:
    """Return how long the pattern takes whose size is the second word."""
    return TRANSFER_MS + int(words[1]) * PER_BYTE_US // 1_000


_LONGEST_MS: Final[dict[str, Callable[[Sequence[Any]], int]]] = {
    "sync": lambda words: 20 * int(words[1]),
    "syncperiod": lambda words: 1_000 + 100 * int(words[2]),
    "segdn": _transfer,
    "segup": _transfer,
    "blkdn": _transfer,
    "blkup": _transfer,
    "upload": lambda words: TRANSFER_MS,
    "room": lambda words: TRANSFER_MS,
    "blockup": lambda words: 2 * TRANSFER_MS,
    "fastscan": lambda words: 10_000,
    "lssstore": lambda words: 1_000,
    "guard": lambda words: 1_500 * len(words),
    MAP: lambda words: TRANSFER_MS,
    ENABLE: lambda words: TRANSFER_MS,
    REFUSE_SEGMENTS: lambda words: TRANSFER_MS,
    FOLLOW: lambda words: TRANSFER_MS + 4 * int(words[4]),
}
