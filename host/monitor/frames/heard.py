"""What a monitor takes in: frames with when and where."""

from __future__ import annotations

from typing import NamedTuple

from tickrig.wire.can import CanFrame
from tickrig.wire.can_error import ErrorFrame


class Heard(NamedTuple):
    """One frame or error frame, as it was on the bus.

    Attributes:
        at_us: when it had ended, microseconds; since the epoch in logs and on real buses.
        channel: name of the bus, without blanks.
        frame: the frame.
        sent: this program sent it.
    """

    at_us: int
    channel: str
    frame: CanFrame | ErrorFrame
    sent: bool = False
