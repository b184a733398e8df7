"""Blocks and options of a pcapng file (draft-ietf-opsawg-pcapng).

>>> option(COMMENT, b"hi").hex(), list(options("<", option(COMMENT, b"hi") + END))
('0100020068690000', [(1, b'hi')])
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Final

SECTION: Final = 0x0A0D_0D0A
ORDER_MAGIC: Final = 0x1A2B_3C4D
INTERFACE: Final = 1
OBSOLETE_PACKET: Final = 2
SIMPLE_PACKET: Final = 3
STATISTICS: Final = 5
PACKET: Final = 6
"""Types of blocks."""

COMMENT: Final = 1
APPLICATION: Final = 4
"""Options of any block, and of a section: what wrote it."""

IF_NAME: Final = 2
TIME_RESOLUTION: Final = 9
TIME_OFFSET: Final = 14
"""Options of an interface."""

PACKET_FLAGS: Final = 2
DROP_COUNT: Final = 4
"""Options of a packet."""

DIRECTION: Final = 3
OUTBOUND: Final = 2
"""Of the flags of a packet: the mask of its direction, and which it is."""

BLOCK_BYTES: Final = 12
"""Of a block without content."""

END: Final = bytes(4)
"""Ends options."""


def block(kind: int, content: bytes) -> bytes:
    """Return a block in little-endian order; its content is a multiple of 4 bytes."""
    size = len(content) + BLOCK_BYTES
    return struct.pack("<II", kind, size) + content + struct.pack("<I", size)


def option(code: int, value: bytes) -> bytes:
    """Return an option in little-endian order."""
    return struct.pack("<HH", code, len(value)) + value + bytes(-len(value) % 4)


def options(order: str, data: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield codes and values, as far as they are whole; `order` is `<` or `>`."""
    head, at = struct.Struct(f"{order}HH"), 0
    while at + head.size <= len(data):
        code, size = head.unpack_from(data, at)
        at += head.size
        if not code or at + size > len(data):
            return
        yield code, data[at : at + size]
        at += size + -size % 4
