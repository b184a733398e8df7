"""Frames of RTC-Lite on a serial line, decoded into the trace of the buses."""

from __future__ import annotations

from typing import Final

from tickrig.host.canmon.model.decode.decoded import Decoded, Signal
from tickrig.host.canmon.model.decode.object_text import write_bytes
from tickrig.host.canmon.model.frames import LineRecord
from tickrig.wire.errors import WireError
from tickrig.wire.rtc_lite.codes import LiteCommand, LiteLinkFault, LiteState, LiteStatus
from tickrig.wire.rtc_lite.frame import (
    REPLIES,
    REQUESTS,
    WITH_STATE,
    Checksum,
    LiteDecoder,
    LiteFrame,
)
from tickrig.wire.rtc_lite.messages import (
    parse_component_profile,
    parse_port_data,
    parse_port_profile,
    parse_reply,
)

_KIND: Final = "rtc-lite"
_FRAME_GAP_US: Final = 100_000
"""After so long a silence a frame that has begun is forgotten (DECISION L7)."""
_LOST_GAP_US: Final = 20_000
"""After so long a silence a header is looked for again."""
_UNASKED: Final = (LiteCommand.DATA, LiteCommand.IN_PROFILE, LiteCommand.OUT_PROFILE)


class RtcLiteLine:
    """Decodes both directions of a line to an RTC-Lite device; chunking makes no difference.

    Args:
        channel: name of the line.
        checksum: how frames are summed up.
    """

    def __init__(self, channel: str, checksum: Checksum = Checksum.SUM8) -> None:
        self._channel = channel
        self._decoders = {
            True: LiteDecoder(REQUESTS, checksum),
            False: LiteDecoder(REPLIES, checksum),
        }
        self._received_us = {True: 0, False: 0}

    def take(self, at_us: int, data: bytes, *, to_device: bool) -> list[LineRecord]:
        """Take bytes of one direction; return the frames that are whole now."""
        decoder, gap_us = self._decoders[to_device], at_us - self._received_us[to_device]
        if gap_us >= (_LOST_GAP_US if decoder.lost else _FRAME_GAP_US):
            decoder.clear()
        self._received_us[to_device] = at_us
        return [self._line(at_us, to_device, found) for found in decoder.push(data)]

    def _line(self, at_us: int, to_device: bool, found: LiteFrame | LiteLinkFault) -> LineRecord:
        if isinstance(found, LiteLinkFault):
            decoded = Decoded(_KIND, None, f"no frame: {found.name.lower()}")
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
    return Decoded(_KIND, None, text, (Signal("command", name),))


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
            profile = parse_port_profile(frame.data)
            port = f"{profile.name.decode('latin-1')}: {profile.code}"
            return Decoded(_KIND, None, f"{name} {port}")
        if frame.command not in REPLIES or frame.command.value.startswith(b"F"):
            return Decoded(_KIND, None, name)
        return _reply(name, frame)
    except WireError as error:
        return Decoded(_KIND, None, f"{name}: {error}")


def _reply(name: str, frame: LiteFrame) -> Decoded:
    reply = parse_reply(frame)
    known = reply.status in LiteStatus.__members__.values()
    status = LiteStatus(reply.status).name.lower().replace("_", " ") if known else f"{reply.status}"
    signals = [Signal("command", name), Signal("status", status)]
    words = [f"{name}: {status}"]
    if frame.command in WITH_STATE and reply.fields:
        state = _state(reply.fields[0])
        signals.append(Signal("state", state))
        words.append(state)
    elif frame.command is LiteCommand.PROFILE and reply.ok:
        words.append(parse_component_profile(reply.fields).type_name.decode("latin-1"))
    elif reply.fields:
        words.append(write_bytes(reply.fields))
    return Decoded(_KIND, None, ", ".join(words), tuple(signals))


def _port(name: str, data: bytes) -> Decoded:
    port = parse_port_data(data)
    label = port.name.decode("latin-1")
    text = f"{name} {label}: {port.data.hex(' ').upper()}"
    return Decoded(_KIND, None, text, (Signal("command", name), Signal(label, port.data)))


def _state(code: int) -> str:
    known = code in LiteState.__members__.values()
    return LiteState(code).name.lower() if known else f"{code:02X}h"


def _name(command: LiteCommand) -> str:
    return command.name.lower().replace("_", " ")
