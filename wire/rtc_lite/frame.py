"""Frames of RTC-Lite: header, Cmnd0, Cmnd1, data, checksum (paper, Fig. 2).

>>> LiteFrame(LiteCommand.STATE).encode().hex(" ")
'0a 43 58 9b'
>>> LiteFrame(LiteCommand.STATE, b"@C").encode(Checksum.XOR8).hex(" ")
'0a 43 58 40 43 18'
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import reduce
from operator import xor
from typing import Final

from tickrig.wire.errors import FieldError
from tickrig.wire.rtc_lite.codes import FAULT_COMMANDS, LiteCommand, LiteLinkFault
from tickrig.wire.rtc_lite.layout import MAX_DATA_BYTES


class Framing(StrEnum):
    """Frames, or the packets of a relative."""

    LITE = "lite"  # the frames of RTC-Lite
    RTNO = "rtno"  # bridge mode: packets of RTno


HEADER: Final = b"\n"
"""0x0A (DECISION L4). It may occur in data: only the parser's position tells."""


class Checksum(StrEnum):
    """How Cmnd0, Cmnd1 and data are summed up (DECISION L5)."""

    SUM8 = "sum8"  # the figure's word: Checksum
    XOR8 = "xor8"  # the legend's word: Parity

    def of(self, body: bytes | bytearray) -> int:
        """Return the last byte of a frame from all between it and the header."""
        return sum(body) & 0xFF if self is Checksum.SUM8 else reduce(xor, body, 0)


@dataclass(frozen=True, slots=True)
class LiteFrame:
    """A frame, of either direction.

    Attributes:
        command: Cmnd0 and Cmnd1.
        data: the marshalled arguments, at most 60 bytes.
    """

    command: LiteCommand
    data: bytes = b""

    def __post_init__(self) -> None:
        """Refuse what no device could hold."""
        if len(self.data) > MAX_DATA_BYTES:
            raise FieldError(f"{len(self.data)} data bytes, at most {MAX_DATA_BYTES} fit")

    @property
    def body(self) -> bytes:
        """What the checksum is made of."""
        return self.command.value + self.data

    def encode(self, checksum: Checksum = Checksum.SUM8) -> bytes:
        """Write the frame with header and checksum."""
        return HEADER + self.body + bytes([checksum.of(self.body)])


def fault_frame(fault: LiteLinkFault) -> LiteFrame:
    """Return the frame that tells of bytes that were no request."""
    return LiteFrame(FAULT_COMMANDS[fault], bytes([fault]))
