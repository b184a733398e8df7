r"""Frames of Modbus RTU: an address, a message, and a CRC with its low byte first.

>>> encode_frame(1, b"\x03\x02\x00\x00\x01").hex(" ")
'01 03 02 00 00 01 85 b2'
>>> parse_frame(bytes.fromhex("01 03 02 00 00 01 85 b2"))
(1, b'\x03\x02\x00\x00\x01')
>>> f"{crc16(b'123456789'):04X}"
'4B37'
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import crcmod

from tickrig.wire.errors import ChecksumError, FramingError

crc16: Final[Callable[[bytes], int]] = crcmod.mkCrcFun(0x1_8005, 0xFFFF, rev=True, xorOut=0)
"""The CRC over address, function code and data: polynomial 8005h, reflected, initial value FFFFh
(Modbus over Serial Line 1.02, CRC Checking)."""

MAX_FRAME_BYTES: Final = 256
MIN_FRAME_BYTES: Final = 4
BROADCAST: Final = 0
"""Address of all slaves; none of them answers."""
ADDRESSES: Final = range(1, 248)
"""Addresses of single slaves."""

SHORTEST_SILENCE_US: Final = 1_750
"""Silence between frames above 19200 bit/s (Modbus over Serial Line 1.02, RTU framing)."""


def silence_us(baud: int, frame_bits: int = 10) -> int:
    """Return the silence between two frames: 3.5 characters, or 1.75 ms above 19200 bit/s.

    >>> silence_us(9_600), silence_us(115_200)
    (3646, 1750)
    """
    if baud > 19_200:
        return SHORTEST_SILENCE_US
    return -(-7 * frame_bits * 1_000_000 // (2 * baud))


def encode_frame(address: int, message: bytes) -> bytes:
    """Write a frame."""
    body = bytes([address]) + message
    return body + crc16(body).to_bytes(2, "little")


def parse_frame(frame: bytes) -> tuple[int, bytes]:
    """Read a frame; return its address and its message.

    Raises:
        FramingError: a length that no frame has.
        ChecksumError: a wrong CRC.
    """
    if not MIN_FRAME_BYTES <= len(frame) <= MAX_FRAME_BYTES:
        raise FramingError(f"{len(frame)} bytes, a frame has {MIN_FRAME_BYTES}..{MAX_FRAME_BYTES}")
    if crc16(frame[:-2]) != int.from_bytes(frame[-2:], "little"):
        raise ChecksumError(f"wrong CRC in {frame.hex(' ')}")
    return frame[0], frame[1:-2]
