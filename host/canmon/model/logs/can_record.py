"""What python-can heard."""

from __future__ import annotations

import can

from tickrig.host.canmon.model.frames.record import Record
from tickrig.host.canmon.model.logs.log_file import to_us
from tickrig.host.canmon.model.logs.tally import BAD_FRAMES, NO_TIME, Tally
from tickrig.host.links.can_message import (
    to_error_frame,
    to_fd_frame,
    to_frame,
    to_message,
)
from tickrig.wire.can_error import ErrorFrame
from tickrig.wire.errors import WireError


def to_record(message: can.Message, channel: str, tally: Tally) -> Record | None:
    """Return what was heard; None for impossible frames and times, which are counted."""
    try:
        at_us = to_us(message.timestamp)
    except ValueError:
        tally.passed_over[NO_TIME] += 1
        return None
    if (error := to_error_frame(message)) is not None:
        return Record(at_us, channel, error, not message.is_rx)
    frame = to_frame(message) or to_fd_frame(message)
    assert frame is not None, "it is no error frame"
    try:
        return Record(at_us, channel, frame.checked(), not message.is_rx)
    except WireError:
        tally.passed_over[BAD_FRAMES] += 1
    return None


def to_can(record: Record, channel: str | int) -> can.Message:
    """Return the message that python-can's writers take."""
    at_us, _, frame, sent = record
    if isinstance(frame, ErrorFrame):
        message = can.Message(
            at_us / 1e6, frame.error_class, is_error_frame=True, data=frame.data, dlc=8
        )
    else:
        message = to_message(frame, at_us)
    message.channel, message.is_rx = channel, not sent
    return message
