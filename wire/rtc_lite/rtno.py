r"""Packets of RTno, for the bridge mode: header 0x0A 0x0A, letter, length, data, sum.

RTno (Yuki Suga, 2010 to 2014) is the nearest living relative of RTC-Lite. Its
packets carry one letter and a length; replies carry the status alone, or the
state alone. What RTno has no letter for cannot be sent in bridge mode.

>>> RtnoDecoder().push(bytes.fromhex("0a 0a 58 00 58"))
[Frame(command=<Command.STATE: b'CX'>, data=b'')]
>>> encode_packet(Frame(Command.STATE, b"@I")).hex(" ")
'0a 0a 58 01 49 a2'
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final, NamedTuple

from tickrig.wire.rtc_lite.codes import FAULT_COMMANDS, Command, LinkFault
from tickrig.wire.rtc_lite.frame import Frame
from tickrig.wire.rtc_lite.layout import MAX_DATA_BYTES, REQUESTS

HEADER: Final = b"\n\n"
EMPTY_PACKET_BYTES: Final = 5

LETTERS: Final[Mapping[Command, bytes]] = MappingProxyType(
    {
        **{Command.ACTIVATE: b"A", Command.DEACTIVATE: b"D", Command.EXECUTE: b"E"},
        **{Command.ERROR: b"C", Command.RESET: b"R", Command.STATE: b"X"},
        **{Command.PROFILE: b"Z", Command.CONTEXT: b"B", Command.WRITE: b"S"},
        **{Command.DATA: b"V", Command.IN_PROFILE: b"P", Command.OUT_PROFILE: b"Q"},
        **dict.fromkeys(FAULT_COMMANDS.values(), b"F"),
    }
)
"""RTno's letter of each command that it has."""

_REQUESTS: Final = {LETTERS[command]: command for command in REQUESTS if command in LETTERS}
_WITHOUT_STATUS: Final = (Command.STATE, Command.CONTEXT)
_PROFILES: Final = (Command.IN_PROFILE, Command.OUT_PROFILE)


def encode_packet(frame: Frame) -> bytes:
    """Write a frame of the device as RTno would; KeyError if RTno has no letter for it."""
    return pack(LETTERS[frame.command], _packet_data(frame))


def pack(letter: bytes, data: bytes) -> bytes:
    """Write a packet of either direction."""
    body = letter + bytes([len(data)]) + data
    return HEADER + body + bytes([sum(body) & 0xFF])


def _packet_data(frame: Frame) -> bytes:
    """Return what RTno sends of the data."""
    if frame.command in _WITHOUT_STATUS or frame.command in _PROFILES:
        return frame.data[1:]
    if frame.command in FAULT_COMMANDS.values():
        return bytes([-frame.data[0] & 0xFF])
    return frame.data if frame.command is Command.DATA else frame.data[:1]


class Packet(NamedTuple):
    """A packet of either direction."""

    letter: bytes
    data: bytes


@dataclass(slots=True)
class PacketDecoder:
    """Reads packets of either direction out of a byte stream.

    Attributes:
        lost: more data than fit were announced: all is thrown away until `clear`.
    """

    lost: bool = field(default=False, init=False)
    _packet: bytearray = field(default_factory=bytearray, init=False)

    @property
    def begun(self) -> bool:
        """Whether a packet has begun that is not whole."""
        return bool(self._packet)

    def clear(self) -> None:
        """Forget a packet that has only begun, and look for a header again."""
        self.lost = False
        self._packet.clear()

    def push(self, data: bytes) -> list[Packet | LinkFault]:
        """Take bytes in; give whole packets out, and what was wrong with others."""
        out = []
        for code in data:
            if self.lost:
                break
            self._packet.append(code)
            if not HEADER.startswith(self._packet[:2]):
                self._packet.clear()
            elif (found := self._look()) is not None:
                out.append(found)
                self._packet.clear()
                self.lost = found is LinkFault.UNKNOWN
        return out

    def _look(self) -> Packet | LinkFault | None:
        """Return what the latest byte completed."""
        packet = self._packet
        if len(packet) < EMPTY_PACKET_BYTES:
            return None
        size = packet[3]
        if size > MAX_DATA_BYTES:
            return LinkFault.UNKNOWN
        if len(packet) < EMPTY_PACKET_BYTES + size:
            return None
        if packet[-1] != sum(packet[2:-1]) & 0xFF:
            return LinkFault.CHECKSUM
        return Packet(bytes(packet[2:3]), bytes(packet[4:-1]))


@dataclass(slots=True)
class RtnoDecoder:
    """Reads the packets of a proxy as frames; used as `Decoder` is.

    Attributes:
        lost: an unknown letter or more data than fit came: all is thrown away
            until `clear`.
    """

    lost: bool = field(default=False, init=False)
    _packets: PacketDecoder = field(default_factory=PacketDecoder, init=False)

    @property
    def begun(self) -> bool:
        """Whether a packet has begun that is not whole."""
        return self._packets.begun

    def clear(self) -> None:
        """Forget a packet that has only begun, and look for a header again."""
        self.lost = False
        self._packets.clear()

    def push(self, data: bytes) -> list[Frame | LinkFault]:
        """Take bytes in; give whole packets out as frames, and what was wrong with others."""
        out = []
        for found in () if self.lost else self._packets.push(data):
            out.append(found if isinstance(found, LinkFault) else _frame_of(found))
            if out[-1] is LinkFault.UNKNOWN:
                self._packets.clear()
                self.lost = True
                break
        return out


def _frame_of(packet: Packet) -> Frame | LinkFault:
    command = _REQUESTS.get(packet.letter)
    if command is None or REQUESTS[command](packet.data) != len(packet.data):
        return LinkFault.UNKNOWN
    return Frame(command, packet.data)
