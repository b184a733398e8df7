r"""Frames of RTC-Lite: header, Cmnd0, Cmnd1, data, checksum (paper, Fig. 2).

>>> LiteFrame(LiteCommand.STATE).encode().hex(" ")
'0a 43 58 9b'
>>> LiteFrame(LiteCommand.STATE, b"@C").encode(Checksum.XOR8).hex(" ")
'0a 43 58 40 43 18'

The length of the data of a frame.

A frame has no length byte: the data itself determines its length (DECISION L6). A layout computes
the minimum length of the data from the bytes read so far. The data is complete when it has that
length.

>>> REQUESTS[LiteCommand.WRITE](b""), REQUESTS[LiteCommand.WRITE](b"\x02\x04in")
(2, 8)
>>> REPLIES[LiteCommand.WRITE](b"@"), REPLIES[LiteCommand.ACTIVATE](b"@")
(1, 2)

Decode frames from a byte stream that may be split anywhere.

>>> from tickrig.wire.rtc_lite.frame import REQUESTS
>>> decoder = LiteDecoder(REQUESTS)
>>> decoder.push(b"noise\n\x43"), decoder.begun
([], True)
>>> decoder.push(b"\x58\x9b")
[LiteFrame(command=<LiteCommand.STATE: b'CX'>, data=b'')]
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import partial, reduce
from operator import xor
from typing import Final

from tickrig.wire.errors import FieldError
from tickrig.wire.rtc_lite.codes import FAULT_COMMANDS, LiteCommand, LiteLinkFault, LiteStatus

MAX_DATA_BYTES: Final = 60
"""Largest size of the data: with header, commands and checksum it fills a buffer of 64 bytes."""

Layout = Callable[[bytes | bytearray], int]
"""Function that returns the minimum length of the data from the bytes read up to now."""

WITH_FIELDS: Final = (LiteStatus.OK, LiteStatus.ERROR, LiteStatus.WRONG_STATE)
"""Statuses that are followed by fields; the reply ends after any other status."""


def _fixed(size: int, data: bytes | bytearray) -> int:
    return size


def _counted(data: bytes | bytearray) -> int:
    return 1 + data[0] if data else 1


def _port_data(data: bytes | bytearray) -> int:
    # 02 04 69 6E 2A 00 00 00: length of the name, length of the data, name, data.
    return 2 + data[0] + data[1] if len(data) >= 2 else 2


def _reply(size: int, data: bytes | bytearray) -> int:
    """Return the length of a status and its fields, which have a fixed size."""
    return 1 + size if data and data[0] in WITH_FIELDS else 1


def _component(data: bytes | bytearray) -> int:
    if data and data[0] in WITH_FIELDS:
        # 40 01 01 05 45 63 68 6F 30: '@', one in-port, one out-port, 5 characters "Echo0".
        return 4 + data[3] if len(data) >= 4 else 4
    return 1


def _polled(data: bytes | bytearray) -> int:
    if data and data[0] == LiteStatus.OK:
        return 2 + data[1] if len(data) >= 2 else 2
    return 1


WITH_STATE: Final = (
    *(LiteCommand.INITIALIZE, LiteCommand.STATE, LiteCommand.FINALIZE),
    *(LiteCommand.ACTIVATE, LiteCommand.DEACTIVATE, LiteCommand.EXECUTE, LiteCommand.ABORT),
    *(LiteCommand.ERROR, LiteCommand.RESET, LiteCommand.STARTUP, LiteCommand.SHUTDOWN),
)
"""Commands of the life cycle, which have no arguments, and the state in the reply."""

_FAULTS: Final = (LiteCommand.CHECKSUM_FAULT, LiteCommand.TIMEOUT_FAULT, LiteCommand.UNKNOWN_FAULT)
"""Fault reports of a device for bytes that are not a valid frame."""

REQUESTS: Final[Mapping[LiteCommand, Layout]] = {
    **dict.fromkeys((*WITH_STATE, LiteCommand.PROFILE, LiteCommand.CONTEXT), partial(_fixed, 0)),
    LiteCommand.PING: partial(_fixed, 1),
    LiteCommand.RATE: partial(_fixed, 2),
    LiteCommand.WRITE: _port_data,
    LiteCommand.POLL: _counted,
}
"""Layouts of the frames of a proxy, by command."""

REPLIES: Final[Mapping[LiteCommand, Layout]] = {
    **dict.fromkeys((*WITH_STATE, LiteCommand.PING, LiteCommand.CONTEXT), partial(_reply, 1)),
    **dict.fromkeys((LiteCommand.RATE, LiteCommand.WRITE), partial(_fixed, 1)),
    **dict.fromkeys((LiteCommand.IN_PROFILE, LiteCommand.OUT_PROFILE), _counted),
    **dict.fromkeys(
        (LiteCommand.CHECKSUM_FAULT, LiteCommand.TIMEOUT_FAULT, LiteCommand.UNKNOWN_FAULT),
        partial(_fixed, 1),
    ),
    LiteCommand.PROFILE: _component,
    LiteCommand.DATA: _port_data,
    LiteCommand.POLL: _polled,
}
"""Layouts of the frames of a device, by command."""


class Framing(StrEnum):
    """Framing of the line: frames of RTC-Lite, or packets of RTno."""

    LITE = "lite"  # the frames of RTC-Lite
    RTNO = "rtno"  # bridge mode: packets of RTno


HEADER: Final = b"\n"
"""Header byte 0x0A (DECISION L4). The byte may occur in data; only the position distinguishes
it."""


class Checksum(StrEnum):
    """Checksum algorithm over Cmnd0, Cmnd1 and data (DECISION L5)."""

    SUM8 = "sum8"  # the figure's word: Checksum
    XOR8 = "xor8"  # the legend's word: Parity

    def of(self, body: bytes | bytearray) -> int:
        """Return the last byte of a frame, computed from the bytes after the header."""
        return sum(body) & 0xFF if self is Checksum.SUM8 else reduce(xor, body, 0)


@dataclass(frozen=True, slots=True)
class LiteFrame:
    """A frame of RTC-Lite between a small controller and its proxy on a PC: a command and its data.

    Attributes:
        command: command bytes Cmnd0 and Cmnd1.
        data: marshalled arguments, at most 60 bytes.
    """

    command: LiteCommand
    data: bytes = b""

    def __post_init__(self) -> None:
        """Raise FieldError if the data are too long for a device."""
        if len(self.data) > MAX_DATA_BYTES:
            raise FieldError(f"{len(self.data)} data bytes, at most {MAX_DATA_BYTES} fit")

    @property
    def body(self) -> bytes:
        """The bytes covered by the checksum."""
        return self.command.value + self.data

    def encode(self, checksum: Checksum = Checksum.SUM8) -> bytes:
        """Write the frame with header and checksum."""
        return HEADER + self.body + bytes([checksum.of(self.body)])


def fault_frame(fault: LiteLinkFault) -> LiteFrame:
    """Return the frame that reports bytes that are not a request."""
    return LiteFrame(FAULT_COMMANDS[fault], bytes([fault]))


_COMMANDS: Final = {command.value: command for command in LiteCommand}


@dataclass(slots=True)
class LiteDecoder:
    """Finds the RTC-Lite frames of one direction in a stream of received bytes (DECISION L6, L7).

    The decoder has no clock, so its owner must watch the line for silences. If a frame has `begun`,
    the owner calls `clear` after 100 ms without a byte. If the decoder is `lost`, the owner calls
    `clear` after 20 ms without a byte.

    Args:
        layouts: layouts of the frames: `REQUESTS` at the device, `REPLIES` at its proxy on the PC.
        checksum: algorithm of the checksum.

    Attributes:
        lost: whether an unknown command or too much data arrived. The start of the next frame is
            then unknown, and all bytes are discarded until `clear`.
    """

    layouts: Mapping[LiteCommand, Layout]
    checksum: Checksum = Checksum.SUM8
    lost: bool = field(default=False, init=False)
    _frame: bytearray = field(default_factory=bytearray, init=False)  # header and what follows

    @property
    def begun(self) -> bool:
        """Whether an incomplete frame has started."""
        return bool(self._frame)

    def clear(self) -> None:
        """Discard an incomplete frame, and search for a header again."""
        self.lost = False
        self._frame.clear()

    def push(self, data: bytes) -> list[LiteFrame | LiteLinkFault]:
        """Add received bytes; return completed frames, and the faults of invalid frames."""
        out = []
        for code in data:
            if not self.lost and (self._frame or code == HEADER[0]):
                self._frame.append(code)
                if (found := self._parse()) is not None:
                    out.append(found)
                    self._frame.clear()
                    self.lost = found is LiteLinkFault.UNKNOWN
        return out

    def _parse(self) -> LiteFrame | LiteLinkFault | None:
        """Return the frame or fault completed by the latest byte."""
        frame = self._frame
        if len(frame) < 3:
            return None
        # 0A, Cmnd0, Cmnd1: three bytes are enough to know the layout.
        command = _COMMANDS.get(bytes(frame[1:3]))
        layout = None if command is None else self.layouts.get(command)
        # The shortest frame has four bytes, so the checksum of an empty frame is read as well.
        if command is None or layout is None:  # taken as having no data (DECISION L7)
            return LiteLinkFault.UNKNOWN if len(frame) == 4 else None
        # If the checksum has arrived, it is in this slice too. It is never taken for a count,
        # because a count comes before the bytes that it counts.
        size = layout(frame[3:])
        # The counts of a damaged frame may announce up to 512 bytes. A decoder that waited for
        # these bytes would swallow the frames that follow.
        if size > MAX_DATA_BYTES:
            return LiteLinkFault.UNKNOWN
        if len(frame) < 4 + size:
            return None
        if frame[-1] != self.checksum.of(frame[1:-1]):
            return LiteLinkFault.CHECKSUM
        return LiteFrame(command, bytes(frame[3:-1]))
