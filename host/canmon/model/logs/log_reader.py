r"""Readers of frames in log files, and in logs that arrive in pieces.

>>> lines = WholeLines()
>>> lines.push(b"one\ntw"), lines.push(b"o"), lines.push(b"\n"), lines.finish()
(b'one\n', b'', b'two\n', b'')

>>> tally = LogTally()
>>> record = parse_log_line("(0.01) vcan0 705#7F T", 1, tally)
>>> record.at_us, record.channel, str(record.frame), record.sent
(10000, 'vcan0', '705#7F', True)
>>> parse_log_line("(0000000000.020000) vcan0 00040#81:00:12345678#AABB", 2, tally)
>>> tally.passed_over
Counter({'CAN XL frames': 1})

>>> tally, clock = LogTally(), ScreenClock()
>>> shown = "(000.000250)  can0  TX - -  705   [1]  7F   '.'"
>>> record = _parse_screen_line(shown, tally, clock)
>>> record.at_us, record.channel, str(record.frame), record.sent
(250, 'can0', '705#7F', True)
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Final, Protocol

from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs import log_file
from tickrig.host.canmon.model.logs.log_file import (
    CAN_XL,
    DROP_COUNT,
    SERIAL_LINES,
    LogTally,
    Mark,
    read_mark,
)
from tickrig.host.canmon.model.logs.notation import (
    LONGEST_NAME,
    UNNAMED,
    parse_csv_line,
    parse_frame,
    parse_json_line,
)
from tickrig.wire.can import BRS, ERROR_FLAG, ESI, MAX_DATA_BYTES, CanFrame
from tickrig.wire.errors import WireError

# Lines that candump, `canmon dump` and python-can show on a screen, with or without time.


HEAD: Final = 1 << 13
"""Number of bytes of a text from which the kind of its time stamps is determined."""

_LATE_US: Final = 10_000
"""Time below which frames of several buses are shown out of order."""

_STAMP: Final = (
    r"\((?:(-?)([0-9]{1,12})|([0-9]{4}-[0-9]{2}-[0-9]{2} [0-9]{2}:[0-9]{2}:[0-9]{2}))"
    r"\.([0-9]{1,9})\)\s+"
)
_FRAME: Final = re.compile(
    rf"(?:{_STAMP})?(\S{{1,32}})\s+(?:([RT])X ([-B]) ([-E])\s+)?"
    r"([0-9A-Fa-f]{8}|[0-9A-Fa-f]{3})\s+(\[[0-9]{1,4}\]|\{[0-9A-F]\})(?:\s+(.*))?",
    re.ASCII,
)
_PRINTED: Final = re.compile(
    r"Timestamp:\s+(-?)([0-9]{1,12})\.([0-9]{6})\s+ID:\s+([0-9a-f]{3,8})\s+"
    r"([SX])(?: ([RT])x)? ([E ]) ([R ]) ([F ]) (BS|  ) (EI|  )\s+DLC?:\s+([0-9]{1,2})(?!\S)"
    r"((?: {1,4}[0-9a-f]{2}(?!\S))*)(?:\s+'\w+')?(?:\s+Channel: (\S{1,32}))?",
    re.ASCII,
)
"""Lines that python-can prints, and that its logger writes to a file with any other ending."""
_SERIAL: Final = re.compile(rf"(?:{_STAMP})?\S+  [<>]  .*", re.ASCII)
_WORDS: Final = re.compile(r"\t+[a-z]+-[a-z-]+(?:\{.*\})?\s*", re.ASCII)
_COLOUR: Final = re.compile(r"\x1b\[[0-9;]*m")
_SPANS: Final = re.compile(
    r"^[ \t]*+\((-?)([0-9]{3,9})\.([0-9]{6})\)[ \t]++\S++\s.*\[[0-9]", re.ASCII | re.MULTILINE
)
_DIGITS: Final = re.compile(r"[0-9A-Fa-f]{2}")
_BITS: Final = re.compile(r"[01]{8}")
_SWAPPED: Final = "`"
"""Sign between bytes that candump shows from the last to the first."""
_ABSOLUTE: Final = 10
"""Number of digits of seconds since the epoch. With fewer digits, it is a span of time."""


_WRAP_US: Final = 1 << 32
"""Range of a 32-bit counter of microseconds."""


class ScreenClock:
    """Clock that converts the time stamps of candump's screen output to times in microseconds.

    Args:
        deltas: whether each time stamp counts from the previous frame (`candump -t d`). Otherwise,
            it counts from the first frame (`-t z`).

    Attributes:
        shift_us: offset in microseconds for the method `counted_us`. This method converts the time
            stamps of GVRET logs, which are counters of a CAN adapter. With the offset, no time is
            below 0, and the times increase when the counter overflows.
    """

    def __init__(self, deltas: bool = False) -> None:
        self.deltas, self._now_us = deltas, 0
        self.shift_us = 0
        self._count: int | None = None

    @classmethod
    def of(cls, text: str) -> ScreenClock:
        """Make a clock for the time stamps in a text of candump lines.

        Relative stamps of candump count from the first frame or from the previous frame. If such
        stamps in the text often decrease, or decrease by much, the clock assumes that they count
        from the previous frame. Otherwise, it assumes that they count from the first frame.
        """
        head = text if len(text) <= HEAD else text[: text.rfind("\n", 0, HEAD) + 1]
        spans = [int(f"{sign}{high}{low}") for sign, high, low in _SPANS.findall(head)]
        falls = [before - after for before, after in pairwise(spans) if after < before]
        return cls(len(falls) * 4 > len(spans) or max(falls, default=0) > _LATE_US)

    def at_us(self, sign: str, seconds: str | None, date: str | None, fraction: str | None) -> int:
        """Return the time in microseconds that the stamp of a line gives.

        A line without a stamp has the time of the previous frame.

        Raises:
            ValueError: the date does not exist.
        """
        micros = int(f"{fraction or '':0<6.6}")
        if date is not None:
            from datetime import datetime  # noqa: PLC0415 - seldom wanted

            self._now_us = int(datetime.fromisoformat(date).timestamp()) * 1_000_000 + micros
        elif seconds is not None:
            span_us = int(f"{sign}1") * (int(seconds) * 1_000_000 + micros)
            before_us = self._now_us if self.deltas and len(seconds) < _ABSOLUTE else 0
            self._now_us = max(0, before_us + span_us)
        return self._now_us

    def counted_us(self, count: int) -> int:
        """Return the time in microseconds for a time stamp that is a counter of a CAN adapter.

        If the counter begins below 0, the times begin at 0. When a 32-bit counter overflows, signed
        or unsigned, the times continue to increase.
        """
        before = self._count
        if before is None:
            self.shift_us = max(0, -count)
        elif before - count > _WRAP_US // 2 and before < _WRAP_US:
            self.shift_us += _WRAP_US
        self._count = count
        return max(0, count + self.shift_us)


def _parse_screen_line(line: str, tally: LogTally, clock: ScreenClock) -> Record | str | None:
    """Return a frame, a counted or harmless item, or None for a bad line."""
    text = _COLOUR.sub("", line).strip() if "\x1b" in line else line.strip()
    match = _FRAME.fullmatch(text)
    if match is None:
        return _beside(line, text, tally, clock)
    sign, seconds, date, fraction, channel, direction, brs, esi, *data = match.groups()
    ident, size, shown = data
    digits = size[1:-1]
    if len(digits) > len("08"):
        return tally.pass_over(CAN_XL)
    length = int(digits) if size.startswith("[") else min(int(digits, 16), MAX_DATA_BYTES)
    flags = f"#{BRS * (brs == 'B') | ESI * (esi == 'E')}" * (len(digits) == len("08"))
    try:
        frame = parse_frame(f"{ident}#{flags}{_notation(length, shown or '')}")
        at_us = clock.at_us(sign, seconds, date, fraction)
    except (WireError, ValueError, OverflowError, OSError):
        return None
    tally.untimed += fraction is None
    return Record(at_us, channel, frame, direction == "T")


def _lost_frames(comment: str) -> int:
    """Return the number of lost frames in a comment of a log, or 0 for any other comment.

    >>> _lost_frames("# 12 frames were lost"), _lost_frames("# a note")
    (12, 0)
    >>> _lost_frames("DROPCOUNT: dropped 1 CAN frame on 'can0' socket (total drops 1)")
    1
    """
    mark = read_mark(0, comment.removeprefix("#"))
    return mark.frames if mark else 0


def _beside(line: str, text: str, tally: LogTally, clock: ScreenClock) -> Record | str | None:
    """Return the content of other lines of a screen.

    Such lines are lines of serial ports, error frames in words, candump's reports of dropped
    frames, and frames that python-can prints.
    """
    if _SERIAL.fullmatch(text):
        return tally.pass_over(SERIAL_LINES)
    if text.startswith(DROP_COUNT) and (lost := _lost_frames(text)):
        tally.lost += lost
        return text
    if match := _PRINTED.fullmatch(text):
        return _printed(match, clock)
    return text if _WORDS.fullmatch(line) else None


def _printed(match: re.Match[str], clock: ScreenClock) -> Record | None:
    """Return the frame of a line that python-can printed."""
    sign, seconds, fraction, ident, kind, direction, *flags, length, data, channel = match.groups()
    error, remote, fd, brs, esi = (not flag.isspace() for flag in flags)
    digits = "".join(data.split())
    if error:
        notation = f"{ERROR_FLAG | int(ident, 16):08X}#{digits}"
    else:
        shown = f"R{length}" if remote else f"#{BRS * brs | ESI * esi}{digits}" if fd else digits
        notation = f"{int(ident, 16):0{8 if kind == 'X' else 3}X}#{shown}"
    try:
        frame = parse_frame(notation)
    except WireError:
        return None
    if not (error or remote) and len(frame.data) != int(length):
        return None
    at_us = clock.at_us(sign, seconds, None, fraction)
    return Record(at_us, channel or UNNAMED, frame, direction == "T")


def _notation(length: int, shown: str) -> str:
    """Read data in the notation of a log. Ignore the text after the data."""
    if shown.startswith("remote request"):
        return f"R{length}"
    words = shown.split()
    if words and _SWAPPED in words[0]:
        words = words[0].split(_SWAPPED)[::-1]
    digits = [f"{int(word, 2):02X}" if _BITS.fullmatch(word) else word for word in words[:length]]
    if len(digits) < length or not all(map(_DIGITS.fullmatch, digits)):
        raise ValueError(f"{shown!r} is not {length} bytes")
    return "".join(digits)


Item = Record | Mark
"""An item of a log, in its order."""

LONGEST: Final = 1 << 20
"""Number of bytes that are kept of a longer line. No line of a log is that long."""


class WholeLines:
    """Buffer that joins received pieces of bytes to whole lines.

    The cost for each byte does not grow with the number of pieces in a line.
    """

    def __init__(self) -> None:
        self._pieces: list[bytes] = []
        self._held = 0

    def push(self, data: bytes, /) -> bytes:
        """Return the lines that end in these bytes, each with its LF."""
        lines, end, rest = data.rpartition(b"\n")
        if not end:
            self._hold(rest)
            return b""
        whole = b"".join((*self._pieces, lines, end))
        self._pieces, self._held = [], 0
        self._hold(rest)
        return whole

    def finish(self) -> bytes:
        """Return a last line that has no LF."""
        rest = b"".join(self._pieces)
        self._pieces, self._held = [], 0
        return rest

    def _hold(self, rest: bytes) -> None:
        # What is beyond is thrown away while it comes; the line is bad in any case.
        if self._held < LONGEST:
            self._pieces.append(rest)
            self._held += len(rest)


_COMMENTS: Final = ("#", ";", "//")

_LINE: Final = re.compile(
    r"\(([0-9]{1,12})\.([0-9]{1,9})\)\s+(\S{1,32})\s+(\S+)(?:\s+([RT]))?", re.ASCII
)
"""Pattern of a line as `candump -L` writes it, with any frame."""
_XL: Final = re.compile(r"[0-9A-Fa-f]{5}#[0-9A-Fa-f:]{14}#(?:[0-9A-Fa-f]{2})+")


def parse_log_line(
    line: str, number: int, tally: LogTally, clock: ScreenClock | None = None
) -> Record | None:
    """Parse a line. Return None if it holds no frame, and count the reason in the tally.

    In addition to the present output of `candump -L`, the function reads variants that other
    programs write: stamps in nanoseconds or with fewer digits, a direction after the frame, the raw
    length code after eight bytes, and error frames with fewer than eight bytes.

    Empty lines and comments (`#`, `;`, `//`) hold no frame, and are not errors. If a comment
    written by canmon reports lost frames, these frames are counted.

    Args:
        line: line without its LF.
        number: number of the line, from 1.
        tally: counts of items that were not returned as frames, such as unreadable frames.
        clock: clock for the lines of a screen.
    """
    text = line.strip()
    if not text or text.startswith(_COMMENTS):
        tally.lost += _lost_frames(text)
        return None
    record = _parsed(line, text, tally, clock or ScreenClock())
    if record is None:
        tally.bad_lines.add(number, line.rstrip("\r"))
    return record if isinstance(record, Record) else None


def _parsed(line: str, text: str, tally: LogTally, clock: ScreenClock) -> Record | str | None:
    """Return a frame, a counted item, or None for a bad line."""
    if text.startswith("{"):
        return parse_json_line(text, tally)
    if match := _LINE.fullmatch(text):
        return _logged(match, tally)
    return _parse_screen_line(line, tally, clock) or parse_csv_line(text, tally, clock)


def _logged(match: re.Match[str], tally: LogTally) -> Record | str | None:
    """Return the frame of a line of `candump -L`."""
    seconds, fraction, channel, notation, direction = match.groups()
    if _XL.fullmatch(notation):
        return tally.pass_over(CAN_XL)
    at_us = int(seconds) * 1_000_000 + int(f"{fraction:0<6.6}")
    try:
        return Record(at_us, channel, parse_frame(notation), direction == "T")
    except WireError:
        return None


_USUAL: Final = re.compile(
    r"^\(([0-9]{1,12})\.([0-9]{6})\) ([!-~]{1,32}) ([0-7][0-9A-Fa-f]{2}|[01][0-9A-Fa-f]{7})"
    r"#((?:[0-9A-Fa-f]{2}){0,8})(?: ([RT]))?\r?$",
    re.ASCII | re.MULTILINE,
)
"""Pattern of a line with a data frame as candump writes it, which nearly all lines match."""


def is_usual(line: str) -> bool:
    """Return whether a line holds a data frame as candump writes it."""
    return _USUAL.match(line) is not None


def holds_frame(line: str) -> bool:
    """Return whether a line is a classic CAN frame as `candump -L` writes it.

    The result is False for a CAN FD frame or a mark.
    """
    return "##" not in line and _LINE.fullmatch(line.strip()) is not None


class LogLines:
    """Parser of a text log that arrives in pieces, such as a candump, JSONL or CSV log.

    The caller calls `push` with received bytes, and `finish` at the end. A line with bytes outside
    ASCII is invalid and never raises an exception.

    Attributes:
        tally: counts of lines that are not frames.
        marks: marks, such as lost frames, that the last call found among its frames. Each mark is
            paired with the number of frames of this call that precede the mark.
        number: number of lines read so far.
    """

    def __init__(self) -> None:
        self.tally, self.marks = LogTally(), list[tuple[int, Mark]]()
        self._whole, self.number, self._latest_us = WholeLines(), 0, 0
        self._clock: ScreenClock | None = None

    @property
    def deltas(self) -> bool:
        """Whether each time stamp counts from the previous frame.

        A time then depends on all earlier lines.
        """
        return self._clock is not None and self._clock.deltas

    def push(self, data: bytes, /) -> list[Record]:
        """Return the frames of the lines that end in these bytes."""
        lines, self.marks = self._whole.push(data), []
        return self._frames(lines[:-1].decode("latin-1")) if lines else []

    def skip(self, lines: int, latest_us: int | None, unusual: bool) -> None:
        """Count lines that a faster parser has read, so that this parser can continue after them.

        Args:
            lines: number of lines. `holds_frame` must be True for each line.
            latest_us: time of the last frame in the lines, or None if no line is valid.
            unusual: whether `is_usual` is False for at least one of the lines.
        """
        self.number += lines
        if unusual:
            self._clock = self._clock or ScreenClock()
        self._latest_us = self._latest_us if latest_us is None else latest_us

    def finish(self) -> list[Record]:
        """Return the frame of a last line that has no LF."""
        rest, self.marks = self._whole.finish(), []
        return self._frames(rest.decode("latin-1")) if rest else []

    def _frames(self, text: str) -> list[Record]:
        count, begin = text.count("\n") + 1, self.number
        self.number += count
        usual = _USUAL.findall(text)
        # All lines or none: if one is unusual the block is read line by line, so that the
        # order, the numbers of bad lines and the marks are right.
        records = _usual_frames(usual) if len(usual) == count else self._any_frames(text, begin)
        self._latest_us = records[-1].at_us if records else self._latest_us
        return records

    def _any_frames(self, text: str, begin: int) -> list[Record]:
        clock = self._clock = self._clock or ScreenClock.of(text)
        records: list[Record] = []
        for number, line in enumerate(text.split("\n"), begin + 1):
            if record := parse_log_line(line, number, self.tally, clock):
                records.append(record)
            elif mark := _mark(line.strip()):
                self.marks.append((len(records), mark))
        self.marks = [(at, self._timed(mark, at, records)) for at, mark in self.marks]
        return records

    def _timed(self, mark: Mark, at: int, records: list[Record]) -> Mark:
        """Give a mark without a time the time of the previous frame, or the next at the start."""
        if mark.at_us:
            return mark
        first_us = records[0].at_us if records else 0
        return mark._replace(at_us=records[at - 1].at_us if at else self._latest_us or first_us)


def _parse_json_mark(text: str) -> log_file.Mark | None:
    """Return the mark for an event, or None for other events.

    The time of the mark is 0 if the event has none.
    """
    import json  # noqa: PLC0415 - candump's lines are the usual ones

    try:
        said = json.loads(text)
        at_us = log_file.to_us(said.get("t", 0))
        if said["ev"] == log_file.DROP:
            return log_file.dropped(at_us, int(said["n"])) if int(said["n"]) > 0 else None
        mark = log_file.read_mark(at_us, str(said["text"]))
        return mark if mark and mark.event == said["ev"] else None
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError):
        return None


def _mark(text: str) -> Mark | None:
    """Return the mark for a comment or an event, without a time if it has none."""
    if text.startswith(("#", DROP_COUNT)):
        return read_mark(0, text.removeprefix("#"))
    return _parse_json_mark(text) if text.startswith("{") else None


def among(records: Sequence[Record], marks: Sequence[tuple[int, Mark]]) -> Sequence[Item]:
    """Insert marks among frames. Each mark comes with the number of frames before it."""
    if not marks:
        return records
    items, begin = list[Item](), 0
    for end, mark in marks:
        items += [*records[begin:end], mark]
        begin = end
    return [*items, *records[begin:]]


def _usual_frames(lines: list[tuple[str, str, str, str, str, str]]) -> list[Record]:
    """Return the frames that `_USUAL` found. Their constructors are not called, for speed."""
    records: list[Record] = []
    add, new, unhex = records.append, tuple.__new__, bytes.fromhex
    second, second_us, idents = "", 0, dict[str, tuple[int, bool]]()
    for seconds, micros, channel, ident, data, direction in lines:
        if seconds != second:
            second, second_us = seconds, int(seconds) * 1_000_000
        if ident not in idents:
            idents[ident] = int(ident, 16), len(ident) == 8
        can_id, extended = idents[ident]
        frame = new(CanFrame, (can_id, unhex(data), False, extended, 0))
        add(new(Record, (second_us + int(micros), channel, frame, direction == "T")))
    return records


BLOCK_BYTES: Final = 1 << 13
"""Size of a block. With so few frames at once, the garbage collector seldom examines them."""


class LogReader(Protocol):
    """The frames of a log file as an iterable. Each iteration reads the file from the beginning.

    Attributes:
        tally: counts of items that were not returned as frames, such as unreadable frames.

    Raises:
        OSError: the file cannot be read. The iteration raises it.
        LogError: the content does not match the name of the file. The iteration raises it.
    """

    tally: LogTally

    def __iter__(self) -> Iterator[Record]: ...

    def items(self) -> Iterator[Item]:
        """Read the file, with the marks among its frames."""


def read_log(path: Path) -> LogReader:
    """Return a reader for the format of a log file.

    The reader opens the file only when it is iterated.

    Raises:
        LogFormatError: the name of the file indicates no format.
    """
    kind = log_file.log_format(path)
    reader: LogReader = log_file.reader_of(kind)(path, kind)
    return reader


class TextLogReader:
    """Reader of a text log."""

    def __init__(self, path: Path, kind: log_file.LogFormat) -> None:
        self._path, self.tally = path, LogTally()

    def __iter__(self) -> Iterator[Record]:
        """Read the file."""
        for records, _ in self._pieces():
            yield from records

    def items(self) -> Iterator[Item]:
        """Read the file, with the marks among its frames."""
        for records, lines in self._pieces():
            yield from among(records, lines.marks)

    def _pieces(self) -> Iterator[tuple[list[Record], LogLines]]:
        lines = LogLines()
        self.tally = lines.tally
        with log_file.open_log(self._path) as file:
            for data in log_file.read_blocks(file, self._path, BLOCK_BYTES):
                yield lines.push(data), lines
        yield lines.finish(), lines


_MOST_MARKS: Final = 1_000
"""Number of marks between two frames above which a log is damaged."""


class _LineParser(Protocol):
    """Reader of the lines of one log, in their order."""

    def read(self, line: str, tally: LogTally, /) -> Record | str | None:
        """Parse one line of a log.

        The result is a frame, a text for a valid line that holds no frame, or None for an invalid
        line.

        Raises:
            LogError: the file is not a log of this format.
            WireError: the line has a frame that cannot occur on a CAN bus.
            ValueError, LookupError: the line is invalid.
        """


class LineLogReader:
    """Base class of readers for text logs whose header defines how their lines are parsed.

    Attributes:
        comments: prefixes of comment lines that may hold marks.
        make_lines: function that makes a new parser of lines for each reading.
    """

    comments: tuple[str, ...] = ()
    make_lines: Callable[[], _LineParser]

    def __init__(self, path: Path, kind: log_file.LogFormat) -> None:
        self._path, self._kind, self.tally = path, kind, LogTally()

    def __iter__(self) -> Iterator[Record]:
        """Read the file."""
        return (item for item in self.items() if isinstance(item, Record))

    def items(self) -> Iterator[Item]:
        """Read the file, and yield its frames and marks in order.

        A mark gets the time of the next frame.
        """
        tally = self.tally = LogTally()
        lines, marks, at_us = type(self).make_lines(), deque[Mark](maxlen=_MOST_MARKS), 0
        for number, line in enumerate(self._lines(), 1):
            try:
                found = lines.read(line, tally)
            except WireError:
                found = tally.pass_over(log_file.BAD_FRAMES)
            except log_file.LogError as error:
                raise log_file.LogError(f"{self._path} is no {self._kind} log: {error}") from error
            except (ValueError, LookupError):
                found = None
            if isinstance(found, Record):
                at_us = found.at_us
                if marks:
                    yield from (mark._replace(at_us=at_us) for mark in marks)
                    marks.clear()
                yield found
            elif found is None:
                tally.bad_lines.add(number, line.rstrip("\r"))
            elif found.startswith(self.comments) and (mark := read_mark(0, found.lstrip("/;"))):
                tally.lost += mark.frames
                marks.append(mark)
        yield from (mark._replace(at_us=at_us) for mark in marks)

    def _lines(self) -> Iterator[str]:
        """Return the lines, which are in UTF-8, or else in Latin-1."""
        whole = WholeLines()
        with log_file.open_log(self._path) as file:
            first = True
            for data in log_file.read_blocks(file, self._path, BLOCK_BYTES):
                if lines := whole.push(data):
                    text = _text(lines[:-1])
                    yield from (text.removeprefix(_BOM) if first else text).split("\n")
                    first = False
        if rest := whole.finish():
            yield _text(rest)


_NUMBERLESS: Final = "canX"


def bus_name(number: str) -> str:
    """Return the name of a bus for its number in a log, such as `can0` for the number 1.

    Bus numbers in logs begin at 1. The number 0 stands for no bus, and its name is `canX`. If the
    text is not a number, ValueError is raised.

    >>> bus_name("1"), bus_name("0")
    ('can0', 'canX')
    """
    count = int(number[:LONGEST_NAME])
    return f"can{count - 1}"[:LONGEST_NAME] if count > 0 else _NUMBERLESS


_BOM: Final = "\ufeff"


def _text(data: bytes) -> str:
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("latin-1")
