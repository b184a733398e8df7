"""The line of an RTC-Lite node: verbs of its scenarios, and faults of the line."""

from __future__ import annotations

import re
import shlex
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

from tickrig.device.chance import Chance
from tickrig.device.rtc_lite.component import LiteComponent
from tickrig.device.rtc_lite.node import BUFFER_BYTES, GAP_US, SILENCE_US, LiteReceiver
from tickrig.device.rtc_lite.server import LiteConfig
from tickrig.emulators.record.wire_log import Splitter
from tickrig.emulators.rig.faults import FaultArguments, FaultTrigger, FaultType, HoldingFault
from tickrig.emulators.scenario import Send, Sender, parse_raw
from tickrig.emulators.serial.byte_faults import BYTE_FAULTS, ByteFault
from tickrig.host.links.link import Link
from tickrig.host.text.byte_text import escape, unescape
from tickrig.host.text.names import near
from tickrig.host.text.trace import Mark
from tickrig.host.text.values import parse_setting
from tickrig.wire.instant import NEVER
from tickrig.wire.rtc_lite import rtno
from tickrig.wire.rtc_lite.codes import LiteCommand, LiteLinkFault
from tickrig.wire.rtc_lite.frame import HEADER, REPLIES, REQUESTS, Framing, LiteDecoder
from tickrig.wire.rtc_lite.messages import LitePortData
from tickrig.wire.rtc_lite.rtno import RtnoPacketDecoder
from tickrig.wire.rtc_lite.values import LitePortType

# Split the traffic into frames, as shown in the log, transcripts and `expect`.
#
# A frame is shown without header and checksum, such as `CX`, `CX@I` or
# `QV\x03\x04out*\x00\x00\x00`. A packet of RTno is shown as `X` or `XI`.

_SHOWN: Final = {
    LiteLinkFault.CHECKSUM: b"(wrong checksum)",
    LiteLinkFault.UNKNOWN: b"(unknown frame)",
    LiteLinkFault.TIMEOUT: b"(broken off)",
}
"""Text for bytes that are not a frame."""


def frame_splitter(config: LiteConfig) -> Callable[[Mark], Splitter]:
    """Return a function that makes the frame splitter for one direction of the line."""

    def make(mark: Mark) -> Splitter:
        if config.framing is Framing.RTNO:
            return _PacketSplitter().split
        layouts = REQUESTS if mark is Mark.TO_DEVICE else REPLIES
        receiver = LiteReceiver(LiteDecoder(layouts, config.checksum))
        return lambda at_us, data: _split(receiver, at_us, data)

    return make


class _PacketSplitter:
    """Splitter that shows packets of RTno without header, length and sum."""

    def __init__(self) -> None:
        self._decoder, self._received_us = RtnoPacketDecoder(), 0

    def split(self, at_us: int, data: bytes) -> list[bytes]:
        out, decoder = list[bytes](), self._decoder
        if at_us >= self._received_us + (SILENCE_US if decoder.lost else GAP_US):
            out += [_SHOWN[LiteLinkFault.TIMEOUT]] if decoder.begun else []
            decoder.clear()
        self._received_us = at_us
        for found in decoder.packets(data):
            out.append(_SHOWN[found] if isinstance(found, LiteLinkFault) else b"".join(found))
        return out


def _split(receiver: LiteReceiver, at_us: int, data: bytes) -> list[bytes]:
    """Split bytes as a node does, with the same time-outs."""
    out = [_SHOWN[LiteLinkFault.TIMEOUT]] if receiver.drop_broken_off(at_us) else []
    for at in range(0, len(data), BUFFER_BYTES):
        receiver.push(at_us, data[at : at + BUFFER_BYTES])
        while (found := receiver.pull()) is not None:
            out.append(_SHOWN[found] if isinstance(found, LiteLinkFault) else found.body)
    return out


_NAMES: Final = {command.value: command.name for command in LiteCommand}


class MonitoredLink:
    """A `Link[bytes]` to an RTC-Lite node that prints each frame in both directions.

    Args:
        link: the link that carries the frames.
        show: function that is called with a line of text for each frame, such as `> AE EXECUTE`.

    Attributes:
        shown: whether frames are printed at present.
    """

    def __init__(self, link: Link[bytes], show: Callable[[str], None]) -> None:
        self._link, self._show, self.shown = link, show, False
        make = frame_splitter(LiteConfig())
        self._split = {mark: make(mark) for mark in (Mark.TO_DEVICE, Mark.FROM_DEVICE)}

    @property
    def now_us(self) -> int:
        """Time on the link."""
        return self._link.now_us

    def send(self, traffic: bytes, /) -> None:
        """Send and report data."""
        self._report(Mark.TO_DEVICE, traffic)
        self._link.send(traffic)

    def receive(self, timeout_us: int, /) -> bytes:
        """Receive and report data."""
        data = self._link.receive(timeout_us)
        self._report(Mark.FROM_DEVICE, data)
        return data

    def close(self) -> None:
        """Close the link."""
        self._link.close()

    def _report(self, mark: Mark, data: bytes) -> None:
        for body in self._split[mark](self.now_us, data):
            if self.shown:
                self._show(f"{mark.value} {escape(body):<12} {_NAMES.get(body[:2], '')}".rstrip())


def verbs(component: LiteComponent, config: LiteConfig) -> Mapping[str, Sender]:
    """Return the sending verbs."""
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
    """Make a frame, or a packet of RTno, from a command and its data."""
    if config.framing is Framing.LITE:
        return Send(HEADER + body + bytes([config.checksum.of(body)]), body)
    return Send(rtno.pack(body[:1], body[1:]), body)


def _value(port_type: LitePortType[Any], words: list[str]) -> bytes:
    """Return the bytes of a value written as one word, or as one word for each element."""
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
            if self.trigger.hit():
                out.append(self.trigger.chance.draw() & 0xFF)
            out.append(byte)
        return bytes(out)


class _LostPing:
    """A fault without random numbers, which counts answers. A node sends an answer in one tick."""

    def __init__(self, trigger: FaultTrigger, arguments: FaultArguments) -> None:
        self._every, self._seen, self._tally = round(1 / arguments.rate), 0, trigger.tally

    def __call__(self, now_us: int, data: bytes) -> bytes:
        return _PING_ANSWER.sub(self._cut, data)

    def _cut(self, match: re.Match[bytes]) -> bytes:
        self._seen += 1
        lost = self._seen % self._every == 0 and self._tally.allow()
        return b"" if lost else match[0]


@dataclass(frozen=True, slots=True)
class RadioSettings:
    """Parameters of an emulated radio link between host and node.

    Attributes:
        latency_us: shortest delay of a packet, in microseconds.
        jitter_us: largest random additional delay. Packets keep their order.
        gap_us: silence after which the radio sends the collected bytes as one packet.
        up_us: mean time from one dropout to the next, or 0 for no dropouts. Each actual time is
            random, between half and one and a half of the mean.
        dropout_us: mean duration of a dropout. Each actual duration is random, between half and one
            and a half of the mean.
    """

    latency_us: int = 15_000
    jitter_us: int = 10_000
    gap_us: int = 2_000
    up_us: int = 60_000_000
    dropout_us: int = 2_000_000


class _Dropouts:
    """The dropouts of a radio link, which both directions share."""

    def __init__(self, chance: Chance, settings: RadioSettings) -> None:
        self._chance, self._settings = chance, settings
        self._down, self._until_us = True, 0

    def down(self, now_us: int) -> bool:
        """Return whether the radio has a dropout at a time.

        The times must not decrease from call to call.
        """
        while self._settings.up_us and now_us >= self._until_us:
            self._down = not self._down
            mean_us = self._settings.dropout_us if self._down else self._settings.up_us
            self._until_us += mean_us // 2 + self._chance.draw() % (mean_us + 1)
        return self._down and self._settings.up_us > 0


class Radio(HoldingFault[bytes]):
    """One direction of an emulated radio link, which delays packets and loses some of them.

    A packet is lost at random, or because of a dropout of the link.
    """

    def __init__(
        self, settings: RadioSettings, trigger: FaultTrigger, arguments: FaultArguments
    ) -> None:
        self._settings, self._trigger = settings, trigger
        self._dropouts = _Dropouts(Chance(trigger.chance.draw()), settings)
        self._taken, self._taken_us = b"", 0
        self._flying: deque[tuple[int, bytes]] = deque()

    @property
    def due_us(self) -> int:
        """Time at which a packet is sent or arrives."""
        leaves_us = self._taken_us + self._settings.gap_us if self._taken else NEVER
        return min(leaves_us, self._flying[0][0] if self._flying else NEVER)

    def pair(self, other: HoldingFault[bytes]) -> None:
        """Share the dropouts with the other direction."""
        assert isinstance(other, Radio)
        other._dropouts = self._dropouts

    def __call__(self, now_us: int, data: bytes, /) -> bytes:
        """Accept bytes."""
        self._leave(now_us)
        self._taken += data
        self._taken_us = now_us
        return b""

    def release(self, now_us: int) -> bytes | None:
        """Return the packets that have arrived."""
        self._leave(now_us)
        arrived = b""
        while self._flying and self._flying[0][0] <= now_us:
            arrived += self._flying.popleft()[1]
        return arrived or None

    def _leave(self, now_us: int) -> None:
        """Send the bytes collected before the last gap."""
        leaves_us = self._taken_us + self._settings.gap_us
        if not self._taken or now_us < leaves_us:
            return
        packet, self._taken = self._taken, b""
        lost, late_us = self._trigger.hit(), self._trigger.chance.draw()
        if self._dropouts.down(leaves_us) or lost:
            return
        at_us = leaves_us + self._settings.latency_us + late_us % (self._settings.jitter_us + 1)
        after_us = self._flying[-1][0] if self._flying else 0
        self._flying.append((max(at_us, after_us), packet))


def radio(settings: RadioSettings) -> FaultType[bytes]:
    """Return a fault type that makes a serial line behave like a radio link.

    The `rate` of the fault is the probability that a packet is lost.
    """
    text = "a radio link: packets are late, lost at this rate, and dropouts last seconds"
    return FaultType(text, partial(Radio, settings), usual_rate=0.05)


LINE_FAULTS: Final[Mapping[str, FaultType[bytes]]] = {
    **BYTE_FAULTS,
    "noise": FaultType("a random byte precedes each byte at this rate", _Noise),
    "ping": FaultType("every n-th answer to a PING is lost, at a rate of 1/n", _LostPing),
    "radio": radio(RadioSettings()),
}
