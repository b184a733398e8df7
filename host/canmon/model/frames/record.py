"""What a monitor takes in: frames and lines of serial ports, with when and where."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from tickrig.wire.can import CanFrame
from tickrig.wire.can_error import ErrorFrame
from tickrig.wire.can_fd import FdFrame

if TYPE_CHECKING:
    from tickrig.host.canmon.model.decode.decoded import Decoded

ARROWS: Final = {True: ">", False: "<"}
"""How a line is shown that is sent to the device, and one from it."""


AnyFrame = CanFrame | ErrorFrame | FdFrame


class Record(NamedTuple):
    """One frame, CAN FD frame or error frame, as it was on the bus.

    Attributes:
        at_us: when it had ended, microseconds; since the epoch in logs and on real buses.
        channel: name of the bus, without blanks.
        frame: the frame.
        sent: this program sent it.
    """

    at_us: int
    channel: str
    frame: AnyFrame
    sent: bool = False


class LineRecord(NamedTuple):
    """A message of a serial line, beside `Record` in one trace; filters take both.

    Attributes:
        at_us: when its last byte was heard.
        channel: name of the line.
        sent: the host sent it, to the device.
        data: its bytes, without line end or header.
        decoded: what it says.
    """

    at_us: int
    channel: str
    sent: bool
    data: bytes
    decoded: Decoded

    @property
    def frame(self) -> None:
        """No frame of a CAN bus."""
        return None


AnyRecord = Record | LineRecord
"""What a trace of buses and serial lines is made of."""
