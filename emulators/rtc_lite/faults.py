"""Faults of the line between a node and its proxy: those of every line, noise and lost PINGs."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from tickrig.device.chance import Chance, threshold_of
from tickrig.emulators.rig.faults import Fault, FaultType
from tickrig.emulators.serial.byte_faults import BYTE_FAULTS
from tickrig.wire.rtc_lite.codes import Command

_PING_ANSWER: Final = re.compile(rb"\n" + Command.PING.value + rb"@..", re.DOTALL)


def _noise(chance: Chance, threshold: int) -> Fault[bytes]:
    def fault(now_us: int, data: bytes) -> bytes:
        out = bytearray()
        for byte in data:
            if chance.hit(threshold):
                out.append(chance.draw() & 0xFF)
            out.append(byte)
        return bytes(out)

    return fault


def _ping(chance: Chance, threshold: int) -> Fault[bytes]:
    """Count; there is no chance in it. A node sends an answer whole, in one tick."""
    every, seen = round(threshold_of(1) / threshold), 0

    def cut(match: re.Match[bytes]) -> bytes:
        nonlocal seen
        seen += 1
        return b"" if seen % every == 0 else match[0]

    return lambda now_us, data: _PING_ANSWER.sub(cut, data)


LINE_FAULTS: Final[Mapping[str, FaultType[bytes]]] = MappingProxyType(
    {
        **BYTE_FAULTS,
        "noise": FaultType("a byte of chance comes before each byte at this rate", _noise),
        "ping": FaultType("every n-th answer to a PING is lost, at a rate of 1/n", _ping),
    }
)
