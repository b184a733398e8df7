"""Command bytes of SDO frames, and where things are in their 8 bytes (CiA 301, SDO protocols)."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

from tickrig.wire.errors import FieldError, FramingError

REQUEST_COB_ID: Final = 0x600
RESPONSE_COB_ID: Final = 0x580
"""The default SDO server of node n listens and answers on these plus n."""

FRAME_BYTES: Final = 8
EXPEDITED_BYTES: Final = 4
SEGMENT_BYTES: Final = 7
MAX_BLOCK_SIZE: Final = 127

TOGGLE: Final = 0x10
LAST: Final = 0x01
"""Bit c of a segment: no more segments."""
SIZE_INDICATED: Final = 0x01
EXPEDITED: Final = 0x02

BLOCK_LAST: Final = 0x80
BLOCK_SEQNO: Final = 0x7F
BLOCK_CRC: Final = 0x04
BLOCK_SIZE_INDICATED: Final = 0x02


class ClientCommand(IntEnum):
    """Client command specifier: bits 7 to 5 of a request."""

    DOWNLOAD_SEGMENT = 0x00
    DOWNLOAD = 0x20
    UPLOAD = 0x40
    UPLOAD_SEGMENT = 0x60
    ABORT = 0x80
    BLOCK_UPLOAD = 0xA0
    BLOCK_DOWNLOAD = 0xC0


class ServerCommand(IntEnum):
    """Server command specifier: bits 7 to 5 of a response."""

    UPLOAD_SEGMENT = 0x00
    DOWNLOAD_SEGMENT = 0x20
    UPLOAD = 0x40
    DOWNLOAD = 0x60
    ABORT = 0x80
    BLOCK_DOWNLOAD = 0xA0
    BLOCK_UPLOAD = 0xC0


SPECIFIER: Final = 0xE0

BLOCK_ENDED: Final = 0xA1
BLOCK_ACKNOWLEDGE: Final = 0xA2
BLOCK_START: Final = 0xA3
BLOCK_END: Final = 0xC1
"""Block transfer: these four are the same whoever sends them; an end has n in bits 4 to 2."""
BLOCK_SUBCOMMAND: Final = 0x03
"""Bits of the subcommand where block upload is meant, and of an acknowledgement."""


def frame_at(command: int, index: int, sub: int, rest: bytes = b"") -> bytes:
    """Return a frame of command byte, multiplexer and up to 4 bytes."""
    if not 0 <= index <= 0xFFFF or not 0 <= sub <= 0xFF:
        raise FieldError(f"{index:X}h:{sub:X} is not in 0000h:00 to FFFFh:FF")
    return bytes([command, index & 0xFF, index >> 8, sub]) + rest.ljust(4, b"\0")


def index_sub(frame: bytes) -> tuple[int, int]:
    """Return index and sub-index of a frame that has a multiplexer."""
    return int.from_bytes(frame[1:3], "little"), frame[3]


def number_field(number: int) -> bytes:
    """Return the 4 bytes of a size or an abort code."""
    if not 0 <= number < 1 << 32:
        raise FieldError(f"{number} does not fit into 32 bits")
    return number.to_bytes(4, "little")


def check_frame(frame: bytes) -> None:
    """Raise FramingError unless a frame has the length of all SDO frames."""
    if len(frame) != FRAME_BYTES:
        raise FramingError(f"an SDO frame of {len(frame)} bytes, it has {FRAME_BYTES}")
