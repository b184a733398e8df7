"""python-can's writers of ASC, TRC and BLF, so that they keep each microsecond.

Each of these formats begins at a date, and counts from there. Here that date is
one that its text holds to the microsecond.
"""

from __future__ import annotations

from datetime import datetime
from typing import Final

import can

FIRST_BLF_S: Final = 631_152_000
"""1990-01-01; python-can takes a time before it for one that counts from zero."""

TRC_STEP_US: Final = 10_546_875
"""2**-13 days: a multiple of it is exact as the fraction of a day that TRC begins with."""


class AscWriter(can.ASCWriter):
    """Begins at a millisecond of local time.

    A frame from before begins another block; python-can would write its absolute time.
    """

    FORMAT_DATE = "%a %b %d %H:%M:%S.{:03d} %Y"  # python-can writes 5 ms as .5

    def on_message_received(self, msg: can.Message) -> None:
        """Write a frame."""
        if not self.header_written or msg.timestamp < self.started:
            self._begin(msg.timestamp)
        super().on_message_received(msg)

    def _begin(self, at_s: float) -> None:
        if self.header_written:
            self.file.write("End TriggerBlock\n")
        self.header_written = False
        date = datetime.fromtimestamp(int(at_s * 1e3) / 1e3)
        # of an hour that the clock of the wall shows twice the text says the first
        self.log_event("// begins", date.replace(fold=0).timestamp())


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
