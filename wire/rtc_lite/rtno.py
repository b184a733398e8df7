r"""Packets of RTno, for the bridge mode: header 0x0A 0x0A, letter, length, data, sum.

RTno (Yuki Suga, 2010 to 2014) is the closest relative of RTC-Lite. Its packets have one letter and
a length. A reply contains only the status, or only the state. Commands for which RTno has no letter
cannot be sent in bridge mode.

>>> RtnoDecoder().push(bytes.fromhex("0a 0a 58 00 58"))
[LiteFrame(command=<LiteCommand.STATE: b'CX'>, data=b'')]
>>> encode_packet(LiteFrame(LiteCommand.STATE, b"@I")).hex(" ")
'0a 0a 58 01 49 a2'
>>> encode_request(LiteFrame(LiteCommand.STATE)).hex(" ")
'0a 0a 58 00 58'
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final, NamedTuple

from tickrig.wire.rtc_lite.codes import FAULT_COMMANDS, LiteCommand, LiteLinkFault, LiteStatus
from tickrig.wire.rtc_lite.frame import (
    MAX_DATA_BYTES,
    REPLIES,
    REQUESTS,
    WITH_FIELDS,
    LiteFrame,
    fault_frame,
)

HEADER: Final = b"\n\n"
_EMPTY_PACKET_BYTES: Final = 5

LETTERS: Final[Mapping[LiteCommand, bytes]] = MappingProxyType(
    {
        **{LiteCommand.ACTIVATE: b"A", LiteCommand.DEACTIVATE: b"D", LiteCommand.EXECUTE: b"E"},
        **{LiteCommand.ERROR: b"C", LiteCommand.RESET: b"R", LiteCommand.STATE: b"X"},
        **{LiteCommand.PROFILE: b"Z", LiteCommand.CONTEXT: b"B", LiteCommand.WRITE: b"S"},
        **{LiteCommand.DATA: b"V", LiteCommand.IN_PROFILE: b"P", LiteCommand.OUT_PROFILE: b"Q"},
        **dict.fromkeys(FAULT_COMMANDS.values(), b"F"),
    }
)
"""RTno's letters by command."""

_REQUESTS: Final = {LETTERS[command]: command for command in REQUESTS if command in LETTERS}
_WITHOUT_STATUS: Final = (LiteCommand.STATE, LiteCommand.CONTEXT)
_PROFILES: Final = (LiteCommand.IN_PROFILE, LiteCommand.OUT_PROFILE)


_TYPE_NAME: Final = b"RTno"
"""Placeholder for the type of a component, which RTno devices do not send."""

_FAULT: Final = LETTERS[LiteCommand.CHECKSUM_FAULT]
_COMMANDS: Final = {
    letter: command for command, letter in LETTERS.items() if command not in FAULT_COMMANDS.values()
}
_STATES: Final = {
    LiteCommand.ACTIVATE: b"A",
    LiteCommand.DEACTIVATE: b"I",
    LiteCommand.EXECUTE: b"A",
    LiteCommand.ERROR: b"E",
    LiteCommand.RESET: b"I",
}
"""States after an executed command, by command."""


def encode_request(frame: LiteFrame) -> bytes:
    """Return an RTC-Lite request as a packet of RTno, a similar protocol for small controllers.

    Raises:
        KeyError: RTno has no code letter for the request.
    """
    return pack(LETTERS[frame.command], frame.data)


def encode_packet(frame: LiteFrame) -> bytes:
    """Return an RTC-Lite frame of a device as a packet of RTno, a similar protocol.

    Raises:
        KeyError: RTno has no code letter for the command of the frame.
    """
    return pack(LETTERS[frame.command], _packet_data(frame))


def pack(letter: bytes, data: bytes) -> bytes:
    """Return the bytes of a packet in either direction."""
    body = letter + bytes([len(data)]) + data
    return HEADER + body + bytes([sum(body) & 0xFF])


def _packet_data(frame: LiteFrame) -> bytes:
    """Return the part of the data that RTno sends."""
    if frame.command in _WITHOUT_STATUS or frame.command in _PROFILES:
        return frame.data[1:]
    if frame.command in FAULT_COMMANDS.values():
        # RTno tells faults as negative numbers: FF, FD and BF for 1, 3 and 65.
        return bytes([-frame.data[0] & 0xFF])
    return frame.data if frame.command is LiteCommand.DATA else frame.data[:1]


class RtnoPacket(NamedTuple):
    """A packet in either direction."""

    letter: bytes
    data: bytes


@dataclass(slots=True)
class RtnoPacketDecoder:
    """Finds RTno packets in a stream of received bytes. It is the base class of both directions.

    Attributes:
        lost: whether a packet announced too much data. In this case all bytes are discarded until
            `clear` is called.
    """

    lost: bool = field(default=False, init=False)
    _packet: bytearray = field(default_factory=bytearray, init=False)

    @property
    def begun(self) -> bool:
        """Whether an incomplete packet has started."""
        return bool(self._packet)

    def clear(self) -> None:
        """Discard an incomplete packet, and search for a header again."""
        self.lost = False
        self._packet.clear()

    def packets(self, data: bytes) -> list[RtnoPacket | LiteLinkFault]:
        """Add received bytes; return completed packets, and the faults of invalid packets."""
        out = []
        for code in data:
            if self.lost:
                break
            self._packet.append(code)
            # A header is two bytes 0A. A single 0A before any other byte is noise. A byte that is
            # not part of a header is dropped with the bytes before it, so `0A 41 0A 0A` still finds
            # the packet.
            if not HEADER.startswith(self._packet[:2]):
                self._packet.clear()
            elif (found := self._parse()) is not None:
                out.append(found)
                self._packet.clear()
                self.lost = found is LiteLinkFault.UNKNOWN
        return out

    def _parse(self) -> RtnoPacket | LiteLinkFault | None:
        """Return the packet or fault completed by the latest byte."""
        packet = self._packet
        if len(packet) < _EMPTY_PACKET_BYTES:
            return None
        size = packet[3]
        if size > MAX_DATA_BYTES:
            return LiteLinkFault.UNKNOWN
        if len(packet) < _EMPTY_PACKET_BYTES + size:
            return None
        if packet[-1] != sum(packet[2:-1]) & 0xFF:
            return LiteLinkFault.CHECKSUM
        return RtnoPacket(bytes(packet[2:3]), bytes(packet[4:-1]))


@dataclass(slots=True)
class RtnoDecoder(RtnoPacketDecoder):
    """Converts RTno packets of a proxy to RTC-Lite frames, for use at a device.

    The decoder is used like `LiteDecoder`. If a packet has an unknown letter, all bytes are
    discarded until `clear` is called.
    """

    def push(self, data: bytes) -> list[LiteFrame | LiteLinkFault]:
        """Add received bytes; return completed packets as frames, and faults of invalid packets."""
        out = []
        for found in self.packets(data):
            out.append(found if isinstance(found, LiteLinkFault) else _frame_of(found))
            if out[-1] is LiteLinkFault.UNKNOWN:
                self.clear()
                self.lost = True
                break
        return out


def _frame_of(packet: RtnoPacket) -> LiteFrame | LiteLinkFault:
    command = _REQUESTS.get(packet.letter)
    if command is None or REQUESTS[command](packet.data) != len(packet.data):
        return LiteLinkFault.UNKNOWN
    return LiteFrame(command, packet.data)


@dataclass(slots=True)
class RtnoReplies(RtnoPacketDecoder):
    r"""Converts RTno packets of a device to RTC-Lite frames, for use at a proxy on a PC.

    It is used like `LiteDecoder(REPLIES)`. RTno packets lack some parts of the RTC-Lite frames: the
    status in a reply with a state, the state in a reply to a command, and the numbers of ports and
    the type in the profile of a component. This decoder adds the missing parts if it can compute
    them from the other parts. The component's state after a refused command is unknown, so it is
    written as `?`.

    >>> RtnoReplies().push(bytes.fromhex("0a 0a 58 01 49 a2"))
    [LiteFrame(command=<LiteCommand.STATE: b'CX'>, data=b'@I')]
    """

    _ports: dict[LiteCommand, int] = field(
        default_factory=dict, init=False
    )  # since the last profile

    def push(self, data: bytes) -> list[LiteFrame | LiteLinkFault]:
        """Add received bytes; return completed packets as frames, and faults of invalid packets."""
        return [
            found if isinstance(found, LiteLinkFault) else self._frame_of(found)
            for found in self.packets(data)
        ]

    def _frame_of(self, packet: RtnoPacket) -> LiteFrame | LiteLinkFault:
        if packet.letter == _FAULT:
            return _fault_of(packet.data)
        command = _COMMANDS.get(packet.letter)
        if command is None:
            return LiteLinkFault.UNKNOWN
        data = self._complete(command, packet.data)
        if len(data) > MAX_DATA_BYTES or REPLIES[command](data) != len(data):
            return LiteLinkFault.UNKNOWN
        return LiteFrame(command, data)

    def _complete(self, command: LiteCommand, data: bytes) -> bytes:
        """Add the parts that RTno omits."""
        if command in {LiteCommand.STATE, LiteCommand.CONTEXT}:
            return bytes([LiteStatus.OK]) + data
        if command in _PROFILES:
            # RTno sends no counts with the profile. The decoder counts the P and Q packets before
            # it instead.
            self._ports[command] = self._ports.get(command, 0) + 1
            return bytes([len(data)]) + data
        if not data or data[0] not in WITH_FIELDS:
            return data
        if command is LiteCommand.PROFILE:
            counts = bytes(self._ports.pop(profile, 0) & 0xFF for profile in _PROFILES)
            return data + counts + bytes([len(_TYPE_NAME)]) + _TYPE_NAME
        if command in _STATES:
            return data + (_STATES[command] if data[0] == LiteStatus.OK else _state_after(data[0]))
        return data


def _state_after(status: int) -> bytes:
    """Return the state after a failed or refused command."""
    return b"E" if status == LiteStatus.ERROR else b"?"


def _fault_of(data: bytes) -> LiteFrame | LiteLinkFault:
    """Read a fault, whose code RTno negates."""
    try:
        return fault_frame(LiteLinkFault(-data[0] & 0xFF))
    except (IndexError, ValueError):
        return LiteLinkFault.UNKNOWN
