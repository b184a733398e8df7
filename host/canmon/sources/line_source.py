"""Serial ports as a source, like buses, with the lines of the devices on them.

A port can have only one reader. To listen to a host and its device, use two adapters, and connect
the receive line of one to each of the two wires.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import fields
from functools import partial
from pathlib import PurePath
from typing import Final

from tickrig.host.canmon.model.decode.decoded import Decoded, Signal
from tickrig.host.canmon.model.decode.node_memory import write_bytes
from tickrig.host.canmon.model.frames import LineRecord
from tickrig.host.canmon.model.logs.log_file import LogTally
from tickrig.host.canmon.sources.source import LineSpec
from tickrig.host.links.serial_link import SerialLink
from tickrig.wire.errors import WireError
from tickrig.wire.lines import LineSplitter
from tickrig.wire.rrc.commands import Command, parse_command
from tickrig.wire.rrc.message import strip_check
from tickrig.wire.rrc.replies import Event, Ok, Refusal, StatusA, Text, parse_reply
from tickrig.wire.rtc_lite import messages
from tickrig.wire.rtc_lite.codes import LiteCommand, LiteLinkFault, LiteState, LiteStatus
from tickrig.wire.rtc_lite.frame import (
    REPLIES,
    REQUESTS,
    WITH_STATE,
    Checksum,
    LiteDecoder,
    LiteFrame,
)

# Frames of RTC-Lite on a serial line, decoded into the trace of the buses.


_LITE_KIND: Final = "rtc-lite"
_FRAME_GAP_US: Final = 100_000
"""Pause after which an incomplete frame is dropped (DECISION L7)."""
_LOST_GAP_US: Final = 20_000
"""Pause after which the search for a header starts again."""
_UNASKED: Final = (LiteCommand.DATA, LiteCommand.IN_PROFILE, LiteCommand.OUT_PROFILE)


class RtcLiteLine:
    """Decoder of the traffic between a host and an RTC-Lite device on a serial line.

    An RTC-Lite device has a small processor. Both directions are decoded. The bytes may arrive in
    chunks of any size.

    Args:
        channel: name of the line in the records.
        checksum: checksum algorithm of the protocol frames.
    """

    def __init__(self, channel: str, checksum: Checksum = Checksum.SUM8) -> None:
        self._channel = channel
        self._decoders = {
            True: LiteDecoder(REQUESTS, checksum),
            False: LiteDecoder(REPLIES, checksum),
        }
        self._received_us = {True: 0, False: 0}

    def take(self, at_us: int, data: bytes, *, to_device: bool) -> list[LineRecord]:
        """Process bytes of one direction. Return the frames that are now complete."""
        decoder, gap_us = self._decoders[to_device], at_us - self._received_us[to_device]
        if gap_us >= (_LOST_GAP_US if decoder.lost else _FRAME_GAP_US):
            decoder.clear()
        self._received_us[to_device] = at_us
        return [self._line(at_us, to_device, found) for found in decoder.push(data)]

    def _line(self, at_us: int, to_device: bool, found: LiteFrame | LiteLinkFault) -> LineRecord:
        if isinstance(found, LiteLinkFault):
            decoded = Decoded(_LITE_KIND, None, f"no frame: {found.name.lower()}")
            return LineRecord(at_us, self._channel, to_device, b"", decoded)
        decoded = _decode_request(found) if to_device else _decode_answer(found)
        return LineRecord(at_us, self._channel, to_device, found.body, decoded)


def _decode_request(frame: LiteFrame) -> Decoded:
    """Decode a frame to the device.

    >>> _decode_request(LiteFrame(LiteCommand.ACTIVATE)).text
    'activate'
    """
    name = _name(frame.command)
    if frame.command is LiteCommand.WRITE:
        return _port(name, frame.data)
    text = f"{name} {write_bytes(frame.data)}" if frame.data else name
    return Decoded(_LITE_KIND, None, text, (Signal("command", name),))


def _decode_answer(frame: LiteFrame) -> Decoded:
    """Decode a frame from the device.

    >>> _decode_answer(LiteFrame(LiteCommand.STATE, b"@C")).text
    'state: ok, created'
    """
    name = _name(frame.command)
    try:
        if frame.command is LiteCommand.DATA:
            return _port(name, frame.data)
        if frame.command in _UNASKED:
            profile = messages.parse_port_profile(frame.data)
            port = f"{profile.name.decode('latin-1')}: {profile.code}"
            return Decoded(_LITE_KIND, None, f"{name} {port}")
        if frame.command not in REPLIES or frame.command.value.startswith(b"F"):
            return Decoded(_LITE_KIND, None, name)
        return _reply(name, frame)
    except WireError as error:
        return Decoded(_LITE_KIND, None, f"{name}: {error}")


def _reply(name: str, frame: LiteFrame) -> Decoded:
    reply = messages.parse_reply(frame)
    known = reply.status in LiteStatus.__members__.values()
    status = LiteStatus(reply.status).name.lower().replace("_", " ") if known else f"{reply.status}"
    signals = [Signal("command", name), Signal("status", status)]
    words = [f"{name}: {status}"]
    if frame.command in WITH_STATE and reply.fields:
        state = _state(reply.fields[0])
        signals.append(Signal("state", state))
        words.append(state)
    elif frame.command is LiteCommand.PROFILE and reply.ok:
        words.append(messages.parse_component_profile(reply.fields).type_name.decode("latin-1"))
    elif reply.fields:
        words.append(write_bytes(reply.fields))
    return Decoded(_LITE_KIND, None, ", ".join(words), tuple(signals))


def _port(name: str, data: bytes) -> Decoded:
    port = messages.parse_port_data(data)
    label = port.name.decode("latin-1")
    text = f"{name} {label}: {port.data.hex(' ').upper()}"
    return Decoded(_LITE_KIND, None, text, (Signal("command", name), Signal(label, port.data)))


def _state(code: int) -> str:
    known = code in LiteState.__members__.values()
    return LiteState(code).name.lower() if known else f"{code:02X}h"


def _name(command: LiteCommand) -> str:
    return command.name.lower().replace("_", " ")


# Lines of an RRC's serial port, decoded into the trace of the buses.

_KIND: Final = "rrc"


class RrcLines:
    """Decoder of the traffic between a host and an RRC on a serial line.

    An RRC (Robotic Relay Communicator) is a device that controls a wheelchair for a host. Both
    directions are decoded. The bytes may arrive in chunks of any size.

    Args:
        channel: name of the line in the records.
    """

    def __init__(self, channel: str) -> None:
        self._channel = channel
        self._splitters = {True: LineSplitter(), False: LineSplitter()}

    def take(self, at_us: int, data: bytes, *, to_device: bool) -> list[LineRecord]:
        """Process bytes of one direction. Return the lines that are now complete."""
        decode = _decode_command if to_device else _decode_reply
        return [
            LineRecord(at_us, self._channel, to_device, line, decode(line))
            for line in self._splitters[to_device].push(data)
        ]


def _decode_command(line: bytes) -> Decoded:
    """Decode a line to the RRC, with or without CHECK at the end.

    >>> _decode_command(b"output1eff").text, _decode_command(b"output1e007").text
    ('output v_pct=30 w_pct=-1', 'output v_pct=30 w_pct=0')
    """
    try:
        return _command(parse_command(line))
    except WireError as error:
        try:
            return _command(parse_command(strip_check(line)))
        except WireError:
            return Decoded(_KIND, None, str(error))


def _decode_reply(line: bytes) -> Decoded:
    """Decode a line from the RRC.

    >>> _decode_reply(b"EV:PowerOn").text, _decode_reply(b"OK:beep").text
    ('event PowerOn', 'OK beep')
    """
    try:
        reply = parse_reply(line)
    except WireError as error:
        return Decoded(_KIND, None, str(error))
    match reply:
        case StatusA():
            signals = _signals(reply)
            return Decoded(_KIND, None, "status " + " ".join(map(str, signals)), signals)
        case Ok(name=text):
            return Decoded(_KIND, None, f"OK {text}", (Signal("ok", text),))
        case Refusal(reason=text):
            return Decoded(_KIND, None, f"refused {text}", (Signal("refused", text),))
        case Event(name=text):
            return Decoded(_KIND, None, f"event {text}", (Signal("event", text),))
        case Text(text=text):
            return Decoded(_KIND, None, text)


def _command(command: Command) -> Decoded:
    signals = _signals(command)
    text = " ".join([command.name.decode(), *map(str, signals)])
    return Decoded(_KIND, None, text, (Signal("command", command.name.decode()), *signals))


def _signals(message: Command | StatusA) -> tuple[Signal, ...]:
    """Return the fields of a message. A row of numbers is one text."""
    values = ((field.name, getattr(message, field.name)) for field in fields(message))
    return tuple(
        Signal(name, value if isinstance(value, int) else " ".join(map(str, value)))
        for name, value in values
    )


_Decoding = tuple[Callable[[str], RrcLines | RtcLiteLine], int]
"""Decoder of a line by its name, and its usual bit rate."""

_DECODINGS: Final[dict[str, _Decoding]] = {
    "rrc": (RrcLines, 115_200),
    "rtc-lite": (RtcLiteLine, 57_600),
    "rtc-lite-xor8": (partial(RtcLiteLine, checksum=Checksum.XOR8), 57_600),
}


class LineReader:
    """Reader that listens on one serial port and decodes the messages. It sends nothing.

    Args:
        word: parsed SOURCE word with the port, the protocol and the direction.

    Attributes:
        name: name of the port.
        lost: number of lost bytes, which is always 0 because a serial port does not report lost
            bytes.
        tally: counts of items that are not messages, always empty because invalid bytes are
            returned as messages.
        stepped: whether virtual time passes only while the port is read, which is always False.

    Raises:
        LinkClosed: the port cannot be opened.
    """

    def __init__(self, word: LineSpec) -> None:
        decoder, usual_baud = _DECODINGS[word.protocol]
        self.name, self._from_host = PurePath(word.port).name or word.port, word.from_host
        self.lost, self.tally, self.stepped = 0, LogTally(), False
        self._decoder = decoder(self.name)
        self._link = SerialLink(word.port, word.baud or usual_baud)

    def read(self, timeout_us: int, /) -> list[LineRecord]:
        """Wait at most `timeout_us` for a first byte. Return the messages that are now complete.

        Raises:
            LinkClosed: the port is gone.
        """
        data = self._link.receive(timeout_us)
        at_us = time.time_ns() // 1_000
        return self._decoder.take(at_us, data, to_device=self._from_host) if data else []

    def close(self) -> None:
        """Close the port."""
        self._link.close()
