r"""How long the data of a frame is.

There is no length byte: data delimits itself (DECISION L6). A layout says how
many bytes the data has as far as the bytes read so far can tell; the data is
whole when it has that many.

>>> REQUESTS[Command.WRITE](b""), REQUESTS[Command.WRITE](b"\x02\x04in")
(2, 8)
>>> REPLIES[Command.WRITE](b"@"), REPLIES[Command.ACTIVATE](b"@")
(1, 2)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Final

from tickrig.wire.rtc_lite.codes import Command, Status

MAX_DATA_BYTES: Final = 60
"""The largest data; with header, commands and checksum it fills a buffer of 64 bytes."""

Layout = Callable[[bytes | bytearray], int]
"""Tells from the data so far how long it is, at least."""

WITH_FIELDS: Final = (Status.OK, Status.ERROR, Status.WRONG_STATE)
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
    if data and data[0] == Status.OK:
        return 2 + data[1] if len(data) >= 2 else 2
    return 1


WITH_STATE: Final = (
    *(Command.INITIALIZE, Command.STATE, Command.FINALIZE),
    *(Command.ACTIVATE, Command.DEACTIVATE, Command.EXECUTE, Command.ABORT),
    *(Command.ERROR, Command.RESET, Command.STARTUP, Command.SHUTDOWN),
)
"""Commands of the life cycle: no arguments, and the state in the reply."""

FAULTS: Final = (Command.CHECKSUM_FAULT, Command.TIMEOUT_FAULT, Command.UNKNOWN_FAULT)
"""What a device says of bytes that are no frame for it."""

REQUESTS: Final[Mapping[Command, Layout]] = {
    **dict.fromkeys((*WITH_STATE, Command.PROFILE, Command.CONTEXT), partial(_fixed, 0)),
    Command.PING: partial(_fixed, 1),
    Command.RATE: partial(_fixed, 2),
    Command.WRITE: _port_data,
    Command.POLL: _counted,
}
"""What a proxy sends."""

REPLIES: Final[Mapping[Command, Layout]] = {
    **dict.fromkeys((*WITH_STATE, Command.PING, Command.CONTEXT), partial(_reply, 1)),
    **dict.fromkeys((Command.RATE, Command.WRITE), partial(_fixed, 1)),
    **dict.fromkeys((Command.IN_PROFILE, Command.OUT_PROFILE), _counted),
    **dict.fromkeys(
        (Command.CHECKSUM_FAULT, Command.TIMEOUT_FAULT, Command.UNKNOWN_FAULT), partial(_fixed, 1)
    ),
    Command.PROFILE: _component,
    Command.DATA: _port_data,
    Command.POLL: _polled,
}
"""What a device sends."""
