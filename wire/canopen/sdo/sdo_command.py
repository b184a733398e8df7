"""Command bytes of SDO frames and what they are made of (CiA 301, SDO protocols)."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

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
