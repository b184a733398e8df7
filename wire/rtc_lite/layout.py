r"""How long the data of a frame is.

There is no length byte: data delimits itself (DECISION L6). A layout says how
many bytes the data has as far as the bytes read so far can tell; the data is
whole when it has that many.

>>> REQUESTS[LiteCommand.WRITE](b""), REQUESTS[LiteCommand.WRITE](b"\x02\x04in")
(2, 8)
>>> REPLIES[LiteCommand.WRITE](b"@"), REPLIES[LiteCommand.ACTIVATE](b"@")
(1, 2)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Final

from tickrig.wire.rtc_lite.codes import LiteCommand, LiteStatus

MAX_DATA_BYTES: Final = 60
"""The largest data; with header, commands and checksum it fills a buffer of 64 bytes."""

Layout = Callable[[bytes | bytearray], int]
"""Tells from the data so far how long it is, at least."""

WITH_FIELDS: Final = (LiteStatus.OK, LiteStatus.ERROR, LiteStatus.WRONG_STATE)
"""After any other status the reply ends."""


def _fixed(size: int, data: bytes | bytearray) -> int:
    return size


def _counted(data: bytes | bytearray) -> int:
    return 1 + data[0] if data else 1


def _port_data(data: bytes | bytearray) -> int:
    return 2 + data[0] + data[1] if len(data) >= 2 else 2


def _reply(size: int, data: bytes | bytearray) -> int:
    """A status, and fields of a fixed size where the status lets them follow."""
    return 1 + size if data and data[0] in WITH_FIELDS else 1


def _component(data: bytes | bytearray) -> int:
    if data and data[0] in WITH_FIELDS:
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
"""Commands of the life cycle: no arguments, and the state in the reply."""

FAULTS: Final = (LiteCommand.CHECKSUM_FAULT, LiteCommand.TIMEOUT_FAULT, LiteCommand.UNKNOWN_FAULT)
"""What a device says of bytes that are no frame for it."""

REQUESTS: Final[Mapping[LiteCommand, Layout]] = {
    **dict.fromkeys((*WITH_STATE, LiteCommand.PROFILE, LiteCommand.CONTEXT), partial(_fixed, 0)),
    LiteCommand.PING: partial(_fixed, 1),
    LiteCommand.RATE: partial(_fixed, 2),
    LiteCommand.WRITE: _port_data,
    LiteCommand.POLL: _counted,
}
"""What a proxy sends."""

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
"""What a device sends."""
