r"""What a device says in packets of RTno, as frames.

RTno leaves out what a frame has: the status of a state, the state after a
command, the numbers and the type of a profile. They are put in where they
follow from the rest; the state after a refusal is `?`, which is none.

>>> replies = RtnoReplies()
>>> replies.push(bytes.fromhex("0a 0a 58 01 49 a2"))
[Frame(command=<Command.STATE: b'CX'>, data=b'@I')]
>>> encode_request(Frame(Command.STATE)).hex(" ")
'0a 0a 58 00 58'
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from tickrig.wire.rtc_lite.codes import FAULT_COMMANDS, Command, LinkFault, Status
from tickrig.wire.rtc_lite.frame import Frame, fault_frame
from tickrig.wire.rtc_lite.layout import MAX_DATA_BYTES, REPLIES, WITH_FIELDS
from tickrig.wire.rtc_lite.rtno import LETTERS, Packet, PacketDecoder, pack

TYPE_NAME: Final = b"RTno"
"""Stands for the type of a component, which a device of RTno does not tell."""

_FAULT: Final = LETTERS[Command.CHECKSUM_FAULT]
_COMMANDS: Final = {
    letter: command for command, letter in LETTERS.items() if command not in FAULT_COMMANDS.values()
}
_PROFILES: Final = (Command.IN_PROFILE, Command.OUT_PROFILE)
_STATES: Final = {
    Command.ACTIVATE: b"A",
    Command.DEACTIVATE: b"I",
    Command.EXECUTE: b"A",
    Command.ERROR: b"E",
    Command.RESET: b"I",
}
"""The state after a command that was obeyed."""


def encode_request(frame: Frame) -> bytes:
    """Write a request as a packet; KeyError if RTno has no letter for it."""
    return pack(LETTERS[frame.command], frame.data)


@dataclass(slots=True)
class RtnoReplies:
    """Reads the packets of a device as frames; used as `Decoder(REPLIES)` is."""

    _packets: PacketDecoder = field(default_factory=PacketDecoder, init=False)
    _ports: dict[Command, int] = field(default_factory=dict, init=False)  # since the last profile

    @property
    def lost(self) -> bool:
        """Whether all is thrown away until `clear`."""
        return self._packets.lost

    @property
    def begun(self) -> bool:
        """Whether a packet has begun that is not whole."""
        return self._packets.begun

    def clear(self) -> None:
        """Forget a packet that has only begun, and look for a header again."""
        self._packets.clear()

    def push(self, data: bytes) -> list[Frame | LinkFault]:
        """Take bytes in; give whole packets out as frames, and what was wrong with others."""
        return [
            found if isinstance(found, LinkFault) else self._frame_of(found)
            for found in self._packets.push(data)
        ]

    def _frame_of(self, packet: Packet) -> Frame | LinkFault:
        if packet.letter == _FAULT:
            return _fault_of(packet.data)
        command = _COMMANDS.get(packet.letter)
        if command is None:
            return LinkFault.UNKNOWN
        data = self._complete(command, packet.data)
        if len(data) > MAX_DATA_BYTES or REPLIES[command](data) != len(data):
            return LinkFault.UNKNOWN
        return Frame(command, data)

    def _complete(self, command: Command, data: bytes) -> bytes:
        """Put in what RTno leaves out."""
        if command in {Command.STATE, Command.CONTEXT}:
            return bytes([Status.OK]) + data
        if command in _PROFILES:
            self._ports[command] = self._ports.get(command, 0) + 1
            return bytes([len(data)]) + data
        if not data or data[0] not in WITH_FIELDS:
            return data
        if command is Command.PROFILE:
            counts = bytes(self._ports.pop(profile, 0) & 0xFF for profile in _PROFILES)
            return data + counts + bytes([len(TYPE_NAME)]) + TYPE_NAME
        if command in _STATES:
            return data + (_STATES[command] if data[0] == Status.OK else _state_after(data[0]))
        return data


def _state_after(status: int) -> bytes:
    """Return the state after a command that failed or was refused."""
    return b"E" if status == Status.ERROR else b"?"


def _fault_of(data: bytes) -> Frame | LinkFault:
    """Read a fault, which RTno tells with its code negated."""
    try:
        return fault_frame(LinkFault(-data[0] & 0xFF))
    except (IndexError, ValueError):
        return LinkFault.UNKNOWN
