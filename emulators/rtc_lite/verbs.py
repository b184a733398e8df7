r"""What a scenario can send to a node: `send CX`, `write in 42`, `raw 0a 43 58 9b`."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from typing import Any

from tickrig.device.rtc_lite.component import Component
from tickrig.device.rtc_lite.config import NodeConfig
from tickrig.emulators.bench.names import known
from tickrig.emulators.record.byte_text import unescape
from tickrig.emulators.scenario.scenario import Send, Sender, parse_raw
from tickrig.host.text.values import parse_setting
from tickrig.wire.rtc_lite import rtno
from tickrig.wire.rtc_lite.codes import Command
from tickrig.wire.rtc_lite.frame import HEADER, Framing
from tickrig.wire.rtc_lite.messages import PortData
from tickrig.wire.rtc_lite.values import PortType


def verbs(component: Component, config: NodeConfig) -> Mapping[str, Sender]:
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
            names = known(key.decode() for key in component.in_ports) or "none"
            raise ValueError(f"no in-port {name!r}; known: {names}")
        data = PortData(port.name, _value(port.port_type, words)).encode()
        return _packed((Command.WRITE.value if lite else b"S") + data, config)

    return {"send": send, "write": write, "raw": parse_raw}


def _packed(body: bytes, config: NodeConfig) -> Send:
    """Put a frame, or a packet of RTno, around a command and its data."""
    if config.framing is Framing.LITE:
        return Send(HEADER + body + bytes([config.checksum.of(body)]), body)
    return Send(rtno.pack(body[:1], body[1:]), body)


def _value(port_type: PortType[Any], words: list[str]) -> bytes:
    """Write the value that a person typed: a word, or one for each element."""
    if port_type.code in "cC":
        return port_type.encode(" ".join(words))
    values = tuple(parse_setting(word) for word in words)
    if port_type.sequence:
        return port_type.encode(values)
    if len(values) != 1:
        raise ValueError(f"{port_type.name} takes one value, got {len(values)}")
    return port_type.encode(values[0])
