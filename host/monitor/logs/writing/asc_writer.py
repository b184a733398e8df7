"""A writer of ASC logs that keeps each microsecond.

python-can's dates the file with the time of writing, writes 5 ms of a date as `.5`,
and a frame from before the start with its absolute time.
"""

from __future__ import annotations

import time
from datetime import datetime
from typing import Final, TextIO

import can

_DATE: Final = "%a %b %d %H:%M:%S.{:03d} %Y"
_END: Final = "End TriggerBlock\n"


class AscWriter:
    """Begins at a millisecond of local time; a frame from before begins another block.

    Args:
        file: a text file, which is closed with the log.
    """

    def __init__(self, file: TextIO) -> None:
        self._file = file
        self._begin_us: int | None = None

    def on_message_received(self, message: can.Message) -> None:
        """Write a frame."""
        at_us = round(message.timestamp * 1e6)
        if self._begin_us is None or at_us < self._begin_us:
            self._begin(at_us)
        assert self._begin_us is not None, "it has begun"
        seconds, micros = divmod(at_us - self._begin_us, 1_000_000)
        self._file.write(f"{seconds:4d}.{micros:06d} {_event(message)}\n")

    def stop(self) -> None:
        """End the log."""
        if self._begin_us is None:
            self._begin(time.time_ns() // 1_000)
        self._file.write(_END)
        self._file.close()

    def _begin(self, at_us: int) -> None:
        start = datetime.fromtimestamp(at_us // 1_000 / 1e3)
        date = start.strftime(_DATE).format(start.microsecond // 1_000)
        if self._begin_us is None:
            self._file.write(f"date {date}\nbase hex  timestamps absolute\n")
            self._file.write("internal events logged\n")
        else:
            self._file.write(_END)
        self._file.write(f"Begin Triggerblock {date}\n   0.000000 Start of measurement\n")
        # of an hour that the clock of the wall shows twice the text says the first
        self._begin_us = round(start.replace(fold=0).timestamp() * 1e6)


def _event(message: can.Message) -> str:
    assert isinstance(message.channel, int), "who writes numbers the buses"
    channel = message.channel + 1
    if message.is_error_frame:
        return f"{channel}  ErrorFrame"
    ident = f"{message.arbitration_id:X}{'x' * message.is_extended_id}"
    direction = "Rx" if message.is_rx else "Tx"
    kind = "r" if message.is_remote_frame else "d"
    data = f" {message.data.hex(' ').upper()}" if message.data else ""
    return f"{channel}  {ident:<15} {direction:<4} {kind} {message.dlc:x}{data}"
