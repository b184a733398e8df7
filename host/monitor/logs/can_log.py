"""Log files that python-can reads: ASC, BLF, TRC and, with asammdf, MF4.

Its readers of text end at the first line that they do not understand, and pass
over others in silence. Here the lines are watched: such a line is counted, and
reading goes on behind it.
"""

from __future__ import annotations

import io
import logging
import re
import struct
import zlib
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO, Final, TextIO

import can
from can.io.blf import BLFParseError

from tickrig.host.monitor.frames.record import Record
from tickrig.host.monitor.logs.blf_damage import BlfReader, has_end, missing_end
from tickrig.host.monitor.logs.can_record import to_record
from tickrig.host.monitor.logs.fd_lines import told_by_flags
from tickrig.host.monitor.logs.log_file import NO_MF4, LogError, LogFormat, open_log
from tickrig.host.monitor.logs.log_reader import Item
from tickrig.host.monitor.logs.mark import Mark, read_mark
from tickrig.host.monitor.logs.notation import LONGEST_NAME, UNNAMED
from tickrig.host.monitor.logs.tally import OTHER_LINES, OTHER_OBJECTS, Tally

MOST_MARKS: Final = 1_000
"""Between two frames: more are a damaged log."""

_SILENT: Final = {
    LogFormat.ASC: re.compile(
        r"\s*(?:$|//|date\b|base\b|(?:no\s+)?internal\s+events|(?:begin|end)\s+triggerblock"
        r"|[0-9]+\.[0-9]+\s+(?:Start of measurement|//))",
        re.IGNORECASE,
    ),
    LogFormat.TRC: re.compile(r"\s*(?:$|;)"),
}
"""Headers, comments and empty lines."""

_EVENTS: Final = {
    LogFormat.ASC: re.compile(
        r"\s*[0-9]+\.[0-9]+\s+(?!CANFD\b|[0-9]+\s+(?:[0-9A-F]+x?|ErrorFrame)\b)\S", re.IGNORECASE
    ),
    LogFormat.TRC: re.compile(
        r"\s*[0-9]+\)?\s+[0-9.]+\s+(?:[0-9]+\s+)?(?:Warng|Error|ST|ER|EC|EV|F{8})\b"
    ),
}
"""Lines with what is no data or remote frame. What is neither of these was meant as a frame."""


class WatchedLines(Iterator[str]):
    """A file for a reader that takes line after line.

    A reader that raises may be started again: it finds an empty line first, for
    readers take a first line as header, and then what follows the bad one.

    Attributes:
        ended: the file has no more lines.
        marks: comments that are marks, for who takes them out; without their time.
    """

    def __init__(self, file: TextIO, kind: LogFormat, tally: Tally) -> None:
        self._file, self._silent, self._event = file, _SILENT[kind], _EVENTS[kind]
        self._tally = tally
        self.marks: deque[Mark] = deque(maxlen=MOST_MARKS)
        self._line, self._number, self._again, self.ended = "", 0, False, False

    def __next__(self) -> str:
        """Return the next line; the one before it came to nothing if it was not taken."""
        if self._again:
            self._again = False
            return "\n"
        self._pass_over()
        try:
            self._line = next(self._file)
        except StopIteration:
            self.ended = True
            raise
        self._number += 1
        return self._line

    def _pass_over(self) -> None:
        """Count the latest line, if it was not taken."""
        line, self._line = self._line, ""
        if self._silent.match(line):
            if line and (mark := read_mark(0, line.strip().lstrip("/;"))):
                self._tally.lost += mark.frames
                self.marks.append(mark)
            return
        if self._event.match(line):
            self._tally.passed_over[OTHER_LINES] += 1
        else:
            self._tally.bad_lines.add(self._number, line.rstrip("\r\n"))

    @property
    def line(self) -> str:
        """The latest line; empty once it was taken."""
        return self._line

    def taken(self) -> None:
        """Note that the latest line came to a frame."""
        self._line = ""

    def refused(self, error: Exception) -> None:
        """Note that the latest line is none of the log; raise what is wrong with the file.

        A reader that refuses the empty line it was started with lacks something before it.
        """
        if self.ended or not self._line or isinstance(error, (EOFError, zlib.error)):
            raise error
        self._tally.bad_lines.add(self._number, self._line.rstrip("\r\n"))
        self._line, self._again = "", True

    def close(self) -> None:
        """Leave the file to whom it belongs."""


BUS_ERROR: Final = 0x80
"""The class of what ASC calls ErrorFrame (linux/can/error.h, CAN_ERR_BUSERROR)."""

BROKEN: Final = (
    *(ValueError, LookupError, TypeError, ArithmeticError, EOFError, NotImplementedError),
    *(struct.error, zlib.error, BLFParseError, can.CanError),
)
"""What python-can's readers raise in files that they do not understand."""

UNSAID: Final = logging.NullHandler()
"""For what python-can logs of lines and objects: what is not read of them is counted here."""

_TEXT: Final[dict[LogFormat, Any]] = {
    LogFormat.ASC: lambda lines: can.ASCReader(lines, relative_timestamp=False),
    LogFormat.TRC: can.TRCReader,
}


class CanLogReader:
    """A reader of a log that python-can understands."""

    def __init__(self, path: Path, kind: LogFormat) -> None:
        self._path, self._kind, self.tally = path, kind, Tally()
        self._marks: deque[Mark] = deque()

    def __iter__(self) -> Iterator[Record]:
        """Read the file."""
        self.tally = Tally()
        names: dict[Any, str] = {}
        for message in self._messages():
            if message.channel not in names:
                names[message.channel] = self._name(message.channel)
            if message.is_error_frame and self._kind is LogFormat.ASC:
                message.arbitration_id = BUS_ERROR
            record = to_record(message, names[message.channel], self.tally)
            if record is not None:
                yield record

    def items(self) -> Iterator[Item]:
        """Read the file, with the marks among its frames: what says them in BLF is counted."""
        at_us = 0
        for record in self:
            at_us = record.at_us
            yield from self._passed_marks(at_us)
            yield record
        yield from self._passed_marks(at_us)

    def _passed_marks(self, at_us: int) -> Iterator[Mark]:
        while self._marks:
            yield self._marks.popleft()._replace(at_us=at_us)

    def _name(self, channel: object) -> str:
        """Return the name of a bus; of TRC alone python-can leaves the count from one."""
        if self._kind is LogFormat.TRC and isinstance(channel, int) and channel > 0:
            return channel_name(channel - 1)
        return channel_name(channel)

    def _messages(self) -> Iterator[can.Message]:
        for name in ("can.io.trc", "can.io.asc", "can.io.blf"):
            logging.getLogger(name).addHandler(UNSAID)
        with open_log(self._path) as file:
            try:
                if self._kind in _TEXT:
                    yield from self._text(file)
                elif self._kind is LogFormat.BLF:
                    yield from self._blf(BlfReader(file))
                else:
                    yield from self._mf4(file)
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
        with io.TextIOWrapper(file, "utf-8", errors="replace") as text:
            lines = WatchedLines(text, self._kind, self.tally)
            self._marks = lines.marks
            reader = _TEXT[self._kind](lines)
            while not lines.ended:
                try:
                    for message in reader:
                        if message.is_fd and self._kind is LogFormat.ASC:
                            told_by_flags(message, lines.line)
                        lines.taken()
                        yield message
                except BROKEN as error:
                    lines.refused(error)

    def _mf4(self, file: BinaryIO) -> can.MF4Reader:
        try:
            return can.MF4Reader(file)
        except NotImplementedError as error:
            raise LogError(f"{self._path}: {NO_MF4}") from error

    def _blf(self, reader: BlfReader) -> Iterator[can.Message]:
        count = 0
        for count, message in enumerate(reader, 1):  # noqa: B007 - counted
            yield message
        with open_log(self._path) as file:
            ended = has_end(file)
            if reader.object_count != count and (reason := missing_end(file)):
                raise LogError(f"{self._path}: {reason}")
        if count and not ended:
            raise LogError(f"{self._path}: its recorder did not end it: it has {count} frames")
        if reader.object_count > count:
            self.tally.passed_over[OTHER_OBJECTS] += reader.object_count - count


def channel_name(channel: object) -> str:
    """Return the name of a bus, no longer than logs hold; some formats have numbers alone."""
    name = "_".join(str(channel).split())
    if channel is None or not name:
        return UNNAMED
    return (f"can{name}" if name.isdecimal() else name)[:LONGEST_NAME]
