"""Frames as python-can has them.

>>> to_frame(to_message(CanFrame.parse("00000605#40"))) == CanFrame.parse("00000605#40")
True
"""

from __future__ import annotations

import can

from tickrig.wire.can import CanFrame
from tickrig.wire.can_error import ERROR_CLASS_MASK, ErrorFrame
from tickrig.wire.can_fd import BRS, ESI, FdFrame


def to_message(frame: CanFrame | FdFrame, at_us: int = 0) -> can.Message:
    """Return a message; its timestamp is in seconds, as python-can wants it."""
    if isinstance(frame, FdFrame):
        return _fd_message(frame, at_us)
    return can.Message(
        timestamp=at_us / 1e6,
        arbitration_id=frame.can_id,
        is_extended_id=frame.extended,
        is_remote_frame=frame.remote,
        dlc=frame.dlc,
        data=None if frame.remote else frame.data,
    )


def _fd_message(frame: FdFrame, at_us: int) -> can.Message:
    return can.Message(
        timestamp=at_us / 1e6,
        arbitration_id=frame.can_id,
        is_extended_id=frame.extended,
        is_fd=True,
        bitrate_switch=frame.brs,
        error_state_indicator=frame.esi,
        dlc=len(frame.data),
        data=frame.data,
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


def to_fd_frame(message: can.Message) -> FdFrame | None:
    """Return a CAN FD frame, not checked; None for any other message.

    python-can takes one without data in an ASC log for a remote frame, which CAN FD has not.
    """
    if not message.is_fd or message.is_error_frame:
        return None
    flags = BRS * message.bitrate_switch | ESI * message.error_state_indicator
    return FdFrame(message.arbitration_id, bytes(message.data), message.is_extended_id, flags)


def to_error_frame(message: can.Message) -> ErrorFrame | None:
    """Return what an error frame says; None for any other message."""
    if not message.is_error_frame:
        return None
    data = bytes(message.data)[:8].ljust(8, b"\0")
    return ErrorFrame(message.arbitration_id & ERROR_CLASS_MASK, data)
