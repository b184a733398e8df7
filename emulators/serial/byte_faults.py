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

    def hits(self) -> bool:
        """Draw once."""
        return self.chance.hit(self.threshold)


class _Flip(ByteFault):
    def __call__(self, now_us: int, data: bytes) -> bytes:
        return bytes(byte ^ sum(1 << bit for bit in range(8) if self.hits()) for byte in data)


class _Drop(ByteFault):
    def __call__(self, now_us: int, data: bytes) -> bytes:
        return bytes(byte for byte in data if not self.hits())


class _Dup(ByteFault):
    def __call__(self, now_us: int, data: bytes) -> bytes:
        return b"".join(bytes([byte]) * (1 + self.hits()) for byte in data)


class _Cut(ByteFault):
    def __call__(self, now_us: int, data: bytes) -> bytes:
        return b""


BYTE_FAULTS: Final[Mapping[str, FaultType[bytes]]] = {
    "flip": FaultType("each bit is turned over at this rate", _Flip),
    "drop": FaultType("each byte is lost at this rate", _Drop),
    "dup": FaultType("each byte arrives twice at this rate", _Dup),
    "cut": FaultType("nothing passes", _Cut, rated=False),
}
