"""Log files that python-can reads: ASC, BLF, TRC and, with asammdf, MF4.

Its readers of text end at the first line that they do not understand, and pass
over others in silence. Here the lines are watched: such a line is counted, and
reading goes on behind it.
"""

from __future__ import annotations

import io
import logging
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO, Final

import can
from can.io.blf import BLFParseError

from tickrig.host.monitor.frames.heard import Heard
from tickrig.host.monitor.logs.log_format import LogFormat
from tickrig.host.monitor.logs.reading.blf_damage import BlfReader, missing_end
from tickrig.host.monitor.logs.reading.can_heard import to_heard
from tickrig.host.monitor.logs.reading.csv_line import UNNAMED
from tickrig.host.monitor.logs.reading.log_reader import LogError, open_log
from tickrig.host.monitor.logs.reading.watched_lines import WatchedLines
from tickrig.host.monitor.logs.tally import OTHER_OBJECTS, BadLines, Tally

BUS_ERROR: Final = 0x80
"""The class of what ASC calls ErrorFrame (linux/can/error.h, CAN_ERR_BUSERROR)."""

BROKEN: Final = (
    *(ValueError, LookupError, TypeError, ArithmeticError, EOFError, NotImplementedError),
    *(struct.error, zlib.error, BLFParseError, can.CanError),
)
"""What python-can's readers raise in files that they do not understand."""

UNSAID: Final = logging.NullHandler()
"""For what python-can logs of each bad line of TRC: it is counted here."""

_TEXT: Final[dict[LogFormat, Any]] = {
    LogFormat.ASC: lambda lines: can.ASCReader(lines, relative_timestamp=False),
    LogFormat.TRC: can.TRCReader,
}


class CanLogReader:
    """A reader of a log that python-can understands."""

    def __init__(self, path: Path, kind: LogFormat) -> None:
        self._path, self._kind, self.tally = path, kind, Tally()

    @property
    def bad_lines(self) -> BadLines:
        """Lines that are none of the log, so far."""
        return self.tally.bad_lines

    def __iter__(self) -> Iterator[Heard]:
        """Read the file."""
        self.tally = Tally()
        names: dict[Any, str] = {}
        for message in self._messages():
            if message.channel not in names:
                names[message.channel] = self._name(message.channel)
            if message.is_error_frame and self._kind is LogFormat.ASC:
                message.arbitration_id = BUS_ERROR
            heard = to_heard(message, names[message.channel], self.tally)
            if heard is not None:
                yield heard

    def _name(self, channel: object) -> str:
        """Return the name of a bus; of TRC alone python-can leaves the count from one."""
        if self._kind is LogFormat.TRC and isinstance(channel, int) and channel > 0:
            return channel_name(channel - 1)
        return channel_name(channel)

    def _messages(self) -> Iterator[can.Message]:
        with open_log(self._path) as file:
            try:
                if self._kind in _TEXT:
                    yield from self._text(file)
                elif self._kind is LogFormat.BLF:
                    yield from self._blf(BlfReader(file))
                else:
                    yield from can.MF4Reader(file)
            except LogError:
                raise
            except BROKEN as error:
                reason = self._why(error)
                raise LogError(f"{self._path} is no {self._kind} log: {reason}") from error

    def _why(self, error: Exception) -> str:
        if not self._path.stat().st_size:
            return "it is empty"
        return " ".join(str(error).split()) or type(error).__name__

    def _text(self, file: BinaryIO) -> Iterator[can.Message]:
        logging.getLogger("can.io.trc").addHandler(UNSAID)
        with io.TextIOWrapper(file, "utf-8", errors="replace") as text:
            lines = WatchedLines(text, self._kind, self.tally)
            reader = _TEXT[self._kind](lines)
            while not lines.ended:
                try:
                    for message in reader:
                        lines.taken()
                        yield message
                except BROKEN as error:
                    lines.refused(error)

    def _blf(self, reader: BlfReader) -> Iterator[can.Message]:
        count = 0
        for count, message in enumerate(reader, 1):  # noqa: B007 - counted
            yield message
        if reader.object_count == count:
            return
        with open_log(self._path) as file:
            if reason := missing_end(file):
                raise LogError(f"{self._path}: {reason}")
        if reader.object_count > count:
            self.tally.passed_over[OTHER_OBJECTS] += reader.object_count - count


def channel_name(channel: object) -> str:
    """Return the name of a bus; some formats have numbers alone."""
    name = "_".join(str(channel).split())
    if channel is None or not name:
        return UNNAMED
    return f"can{name}" if name.isdecimal() else name
