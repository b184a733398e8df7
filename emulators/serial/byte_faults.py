"""Faults of a byte line: flip, drop, dup, cut."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from tickrig.device.chance import Chance
from tickrig.emulators.rig.faults import FaultType


@dataclass(slots=True)
class ByteFault:
    """A fault that hits bits or bytes by chance.

    Attributes:
        chance: what it is drawn from.
        threshold: of its rate, see `Chance.hit`.
    """

    chance: Chance
    threshold: int

    def hits(self, draws: int) -> list[int]:
        """Draw so often, and return which draws hit, counted from 0."""
        return self.chance.hits(self.threshold, draws)


class _Flip(ByteFault):
    def __call__(self, now_us: int, data: bytes) -> bytes:
        if not (hits := self.hits(8 * len(data))):
            return data
        turned = bytearray(data)
        for bit in hits:
            turned[bit >> 3] ^= 1 << (bit & 7)
        return bytes(turned)


class _Drop(ByteFault):
    def __call__(self, now_us: int, data: bytes) -> bytes:
        if not (hits := set(self.hits(len(data)))):
            return data
        return bytes(byte for at, byte in enumerate(data) if at not in hits)


class _Dup(ByteFault):
    def __call__(self, now_us: int, data: bytes) -> bytes:
        hits = set(self.hits(len(data)))
        return b"".join(bytes([byte]) * (1 + (at in hits)) for at, byte in enumerate(data))


class _Cut(ByteFault):
    def __call__(self, now_us: int, data: bytes) -> bytes:
        return b""


BYTE_FAULTS: Final[Mapping[str, FaultType[bytes]]] = {
    "flip": FaultType("each bit is turned over at this rate", _Flip),
    "drop": FaultType("each byte is lost at this rate", _Drop),
    "dup": FaultType("each byte arrives twice at this rate", _Dup),
    "cut": FaultType("nothing passes", _Cut, rated=False),
}
