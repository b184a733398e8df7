"""Where things are in the 8 bytes of an SDO frame."""

from __future__ import annotations

from tickrig.wire.canopen.sdo.sdo_command import FRAME_BYTES
from tickrig.wire.errors import FieldError, FramingError


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
