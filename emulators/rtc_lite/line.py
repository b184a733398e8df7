"""What is on the line of an RTC-Lite node: the verbs of its scenarios, and the line's faults."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping
from typing import Any, Final

from tickrig.device.chance import Chance, threshold_of
from tickrig.device.rtc_lite.component import LiteComponent
from tickrig.device.rtc_lite.config import LiteConfig
from tickrig.emulators.rig.faults import FaultType
from tickrig.emulators.scenario.scenario import Send, Sender, parse_raw
from tickrig.emulators.serial.byte_faults import BYTE_FAULTS, ByteFault
from tickrig.host.text.byte_text import unescape
from tickrig.host.text.names import near
from tickrig.host.text.values import parse_setting
from tickrig.wire.rtc_lite import rtno
from tickrig.wire.rtc_lite.codes import LiteCommand
from tickrig.wire.rtc_lite.frame import HEADER, Framing
from tickrig.wire.rtc_lite.messages import LitePortData
from tickrig.wire.rtc_lite.values import LitePortType


def verbs(component: LiteComponent, config: LiteConfig) -> Mapping[str, Sender]:
    """Return the verbs that send."""
    lite = config.framing is Framing.LITE

    def send(rest: str) -> Send:
        body = unescape(rest)
        if len(body) < (2 if lite else 1):
            example = "CX" if lite else "X"
            raise ValueError(f"send takes a command and its data, as {example!r}, got {rest!r}")
        return _packed(body, config)

    def write(rest: str) -> Send:
        name, *words = shlex.split(rest) or [""]
        port = component.in_ports.get(name.encode())
        if port is None:
            hint = near(name, [key.decode() for key in component.in_ports])
            raise ValueError(f"no in-port {name!r}; {hint}")
        data = LitePortData(port.name, _value(port.port_type, words)).encode()
        return _packed((LiteCommand.WRITE.value if lite else b"S") + data, config)

    return {"send": send, "write": write, "raw": parse_raw}


def _packed(body: bytes, config: LiteConfig) -> Send:
    """Put a frame, or a packet of RTno, around a command and its data."""
    if config.framing is Framing.LITE:
        return Send(HEADER + body + bytes([config.checksum.of(body)]), body)
    return Send(rtno.pack(body[:1], body[1:]), body)


def _value(port_type: LitePortType[Any], words: list[str]) -> bytes:
    """Write the value that a person typed: a word, or one for each element."""
    if port_type.code in "cC":
        return port_type.encode(" ".join(words))
    values = tuple(parse_setting(word) for word in words)
    if port_type.sequence:
        return port_type.encode(values)
    if len(values) != 1:
        raise ValueError(f"{port_type.name} takes one value, got {len(values)}")
    return port_type.encode(values[0])


_PING_ANSWER: Final = re.compile(rb"\n" + LiteCommand.PING.value + rb"@..", re.DOTALL)


class _Noise(ByteFault):
    def __call__(self, now_us: int, data: bytes) -> bytes:
        out = bytearray()
        for byte in data:
            if self.chance.hit(self.threshold):
                out.append(self.chance.draw() & 0xFF)
            out.append(byte)
        return bytes(out)


class _LostPing:
    """It counts; there is no chance in it. A node sends an answer whole, in one tick."""

    def __init__(self, chance: Chance, threshold: int) -> None:
        self._every, self._seen = round(threshold_of(1) / threshold), 0

    def __call__(self, now_us: int, data: bytes) -> bytes:
        return _PING_ANSWER.sub(self._cut, data)

    def _cut(self, match: re.Match[bytes]) -> bytes:
        self._seen += 1
        return b"" if self._seen % self._every == 0 else match[0]


LINE_FAULTS: Final[Mapping[str, FaultType[bytes]]] = {
    **BYTE_FAULTS,
    "noise": FaultType("a byte of chance comes before each byte at this rate", _Noise),
    "ping": FaultType("every n-th answer to a PING is lost, at a rate of 1/n", _LostPing),
}
