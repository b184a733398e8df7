"""Faults of a byte line: flip, drop, dup, cut."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from tickrig.device.chance import Chance
from tickrig.emulators.rig.faults import Fault, FaultType


def _flip(chance: Chance, threshold: int) -> Fault[bytes]:
    def fault(now_us: int, data: bytes) -> bytes:
        return bytes(
            byte ^ sum(1 << bit for bit in range(8) if chance.hit(threshold)) for byte in data
        )

    return fault


def _drop(chance: Chance, threshold: int) -> Fault[bytes]:
    def fault(now_us: int, data: bytes) -> bytes:
        return bytes(byte for byte in data if not chance.hit(threshold))

    return fault


def _dup(chance: Chance, threshold: int) -> Fault[bytes]:
    def fault(now_us: int, data: bytes) -> bytes:
        return b"".join(bytes([byte]) * (1 + chance.hit(threshold)) for byte in data)

    return fault


def _cut(chance: Chance, threshold: int) -> Fault[bytes]:
    return lambda now_us, data: b""


BYTE_FAULTS: Final[Mapping[str, FaultType[bytes]]] = MappingProxyType(
    {
        "flip": FaultType("each bit is turned over at this rate", _flip),
        "drop": FaultType("each byte is lost at this rate", _drop),
        "dup": FaultType("each byte arrives twice at this rate", _dup),
        "cut": FaultType("nothing passes", _cut, rated=False),
    }
)
