"""Frames as python-can has them.

>>> to_frame(to_message(CanFrame.parse("00000605#40"))) == CanFrame.parse("00000605#40")
True
"""

from __future__ import annotations

import can

from tickrig.wire.can import CanFrame


def to_message(frame: CanFrame, at_us: int = 0) -> can.Message:
    """Return a message; its timestamp is in seconds, as python-can wants it."""
    return can.Message(
        timestamp=at_us / 1e6,
        arbitration_id=frame.can_id,
        is_extended_id=frame.extended,
        is_remote_frame=frame.remote,
        dlc=frame.dlc,
        data=None if frame.remote else frame.data,
    )


def to_frame(message: can.Message) -> CanFrame | None:
    """Return a frame; None for an error frame and for CAN FD."""
    if message.is_error_frame or message.is_fd:
        return None
    remote = message.is_remote_frame
    return CanFrame(
        message.arbitration_id,
        b"" if remote else bytes(message.data),
        remote,
        message.is_extended_id,
        message.dlc if remote else 0,
    )
