"""What a monitor takes in from a serial line."""

from __future__ import annotations

from typing import NamedTuple

from tickrig.host.monitor.decode.decoded import Decoded
from tickrig.host.monitor.frames.heard import Heard


class HeardLine(NamedTuple):
    """A message of a serial line, beside `Heard` in one trace; filters take both.

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


Listened = Heard | HeardLine
"""What a trace of buses and serial lines is made of."""
