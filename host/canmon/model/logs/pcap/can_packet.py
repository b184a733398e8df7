"""Frames as packets of a capture, as LINKTYPE_CAN_SOCKETCAN has them (tcpdump.org).

A packet is a struct can_frame or canfd_frame of Linux with the identifier in network byte order.

>>> packet(CanFrame.parse("705#7F")).hex()
'00000705010000007f00000000000000'
>>> str(parse_packet(packet(FdFrame.parse("00000123##1AABB"))))
'00000123##1AABB'
"""

from __future__ import annotations

import struct
from typing import Final

from tickrig.host.canmon.model.frames.record import AnyFrame
from tickrig.host.canmon.model.logs.tally import CAN_XL
from tickrig.wire.can import EXTENDED_MAX, MAX_DATA_BYTES, STANDARD_MAX, CanFrame
from tickrig.wire.can_error import ERROR_CLASS_MASK, ERROR_FLAG, ErrorFrame
from tickrig.wire.can_fd import BRS, ESI, MAX_FD_BYTES, FdFrame

LINK_TYPE: Final = 227
"""LINKTYPE_CAN_SOCKETCAN."""

EXTENDED: Final = 0x8000_0000
REMOTE: Final = 0x4000_0000
FDF: Final = 0x4
"""Flag of a packet: it is of CAN FD, however short it was cut."""
_XL: Final = 0x80

CLASSIC_BYTES: Final = 16
FD_BYTES: Final = 72
_CLASSIC: Final = struct.Struct(">IB3x8s")
_FD: Final = struct.Struct(">IBB2x64s")
_HEAD: Final = struct.Struct(">IBB")
_LENGTH_AT: Final = 4
_DATA_AT: Final = 8


def packet(frame: AnyFrame) -> bytes:
    """Return the packet of a frame: 16 bytes, of CAN FD 72."""
    if isinstance(frame, FdFrame):
        flagged = frame.can_id | EXTENDED * frame.extended
        return _FD.pack(flagged, len(frame.data), FDF | frame.flags, frame.data)
    if isinstance(frame, ErrorFrame):
        return _CLASSIC.pack(ERROR_FLAG | frame.error_class, len(frame.data), frame.data)
    flagged = frame.can_id | EXTENDED * frame.extended | REMOTE * frame.remote
    return _CLASSIC.pack(flagged, frame.dlc, frame.data)


def parse_packet(data: bytes) -> AnyFrame | str | None:
    """Return the frame of a packet, `CAN_XL`, or None for what is no frame or was cut."""
    if len(data) < _DATA_AT or data[_LENGTH_AT] & _XL:
        return None if len(data) < _DATA_AT else CAN_XL
    flagged, length, flags = _HEAD.unpack_from(data)
    content = data[_DATA_AT : _DATA_AT + length]
    if flagged & ERROR_FLAG:
        return ErrorFrame(flagged & ERROR_CLASS_MASK, content[:8].ljust(8, b"\0"))
    extended = bool(flagged & EXTENDED)
    can_id = flagged & (EXTENDED_MAX if extended else STANDARD_MAX)
    if flagged & REMOTE:
        return CanFrame(can_id, b"", True, extended, min(length, MAX_DATA_BYTES))
    is_fd = flags & FDF or len(data) == FD_BYTES
    if len(content) < length or length > (MAX_FD_BYTES if is_fd else MAX_DATA_BYTES):
        return None
    if is_fd:
        return FdFrame(can_id, content, extended, flags & (BRS | ESI)).checked()
    return CanFrame(can_id, content, False, extended)
