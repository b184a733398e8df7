"""python-can's writers of TRC and BLF, so that they keep each microsecond.

Each of these formats begins at a date, and counts from there. Here that date is
one that its text holds to the microsecond.
"""

from __future__ import annotations

from typing import Final

import can

FIRST_BLF_S: Final = 631_152_000
"""1990-01-01; python-can takes a time before it for one that counts from zero."""

TRC_STEP_US: Final = 10_546_875
"""2**-13 days: a multiple of it is exact as the fraction of a day that TRC begins with."""


class TrcWriter(can.TRCWriter):
    """Begins at a multiple of `TRC_STEP_US`."""

    def on_message_received(self, msg: can.Message) -> None:
        """Write a frame."""
        if self.first_timestamp is None:
            self.first_timestamp = int(msg.timestamp * 1e6) // TRC_STEP_US * TRC_STEP_US / 1e6
            self.write_header(self.first_timestamp)
        super().on_message_received(msg)


class BlfWriter(can.BLFWriter):
    """Begins at a second; BLF holds nothing from before.

    Attributes:
        early: frames from before, which have got the time of the beginning.
    """

    early = 0

    def on_message_received(self, msg: can.Message) -> None:
        """Write a frame."""
        if self.start_timestamp is None:
            begin_s = int(msg.timestamp)
            self.start_timestamp = float(begin_s if begin_s >= FIRST_BLF_S else 0)
        self.early += msg.timestamp < self.start_timestamp
        super().on_message_received(msg)
