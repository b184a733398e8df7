"""Log files that python-can reads, which are BLF and, with asammdf, MF4.

A BLF log is a header followed by objects. Most objects are containers. The contents of all
containers, joined, are the objects of interest. An object may extend over two containers.

python-can reads a truncated log up to its end and does not report the truncation. It skips two of
the three kinds of error frames.
"""

from __future__ import annotations

import io
import logging
import os
import struct
import time
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from datetime import datetime
from pathlib import Path
from typing import Any, BinaryIO, Final, NamedTuple, TextIO, cast

import can
from can.io.blf import FILE_HEADER_SIZE, BLFParseError
from can.util import channel2int, len2dlc

from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs import log_file
from tickrig.host.canmon.model.logs.log_file import (
    BAD_FRAMES,
    COUNTERS_TOLD,
    ERRORS_COUNTED,
    NO_TIME,
    OTHER_OBJECTS,
    LogTally,
    Mark,
)
from tickrig.host.canmon.model.logs.log_writer import BusNumbers, TextBlock
from tickrig.host.canmon.model.logs.notation import LONGEST_NAME, UNNAMED
from tickrig.host.links.can_link import to_error_frame, to_fd_frame, to_frame, to_message
from tickrig.wire.can import STANDARD_MAX, ErrorClass, ErrorFrame
from tickrig.wire.errors import WireError

# Frames as python-can returns them.


def to_record(message: can.Message, channel: str, tally: LogTally) -> Record | None:
    """Convert a message of python-can to a record.

    An impossible frame or time is counted in `tally`, and the result is then None.
    """
    try:
        at_us = log_file.to_us(message.timestamp)
    except ValueError:
        tally.pass_over(NO_TIME)
        return None
    if (error := to_error_frame(message)) is not None:
        return Record(at_us, channel, error, not message.is_rx)
    frame = to_frame(message) or to_fd_frame(message)
    assert frame is not None, "it is no error frame"
    try:
        return Record(at_us, channel, frame.checked(), not message.is_rx)
    except WireError:
        tally.pass_over(BAD_FRAMES)
    return None


def to_can(record: Record, channel: str | int) -> can.Message:
    """Return a message for python-can's writers."""
    at_us, _, frame, sent = record
    if isinstance(frame, ErrorFrame):
        message = can.Message(
            at_us / 1e6, frame.error_class, is_error_frame=True, data=frame.data, dlc=8
        )
    else:
        message = to_message(frame, at_us)
    message.channel, message.is_rx = channel, not sent
    return message


_BROKEN: Final = (
    *(ValueError, LookupError, TypeError, ArithmeticError, EOFError, NotImplementedError),
    *(struct.error, zlib.error, BLFParseError, can.CanError),
)
"""Errors that python-can's readers raise for files that they cannot read."""

_UNSAID: Final = logging.NullHandler()
"""Handler that drops python-can's log messages. Skipped objects are counted here."""


_NO_MF4: Final = "MF4 needs asammdf: pip install 'python-can[mf4]'"
"""Message if asammdf is not installed."""


class CanLogReader:
    """Reader of a log in a format that python-can supports."""

    def __init__(self, path: Path, kind: log_file.LogFormat) -> None:
        self._path, self._kind, self.tally = path, kind, LogTally()

    def __iter__(self) -> Iterator[Record]:
        """Read the file."""
        return cast("Iterator[Record]", self.blocks(None))

    def blocks(self, apart: _TakeApart | None) -> Iterator[Record | BlfBlock]:
        """Read the file. `apart` parses the containers of a BLF log, and returns blocks."""
        self.tally = LogTally()
        names: dict[object, str] = {}
        for message in self._messages(apart):
            if not isinstance(message, can.Message):
                yield message
                continue
            if message.channel not in names:
                names[message.channel] = channel_name(message.channel)
            message.is_extended_id |= message.arbitration_id > STANDARD_MAX  # as ASC without its x
            record = to_record(message, names[message.channel], self.tally)
            if record is not None:
                yield record

    def items(self) -> Iterator[Record]:
        """Read the file. The marks of the file are only counted."""
        return iter(self)

    def _messages(self, apart: _TakeApart | None) -> Iterator[can.Message | BlfBlock]:
        logging.getLogger("can.io.blf").addHandler(_UNSAID)
        with log_file.open_log(self._path) as file:
            try:
                if self._kind is log_file.LogFormat.BLF:
                    yield from self._blf(_BlfReader(file), apart)
                else:
                    yield from self._mf4(file)
            except log_file.LogError:
                raise
            except _BROKEN as error:
                reason = self._why(error)
                raise log_file.LogError(f"{self._path} is no {self._kind} log: {reason}") from error

    def _why(self, error: Exception) -> str:
        if not self._path.stat().st_size:
            return "it is empty"
        return " ".join(str(error).split()) or type(error).__name__

    def _mf4(self, file: BinaryIO) -> can.MF4Reader:
        try:
            return can.MF4Reader(file)
        except NotImplementedError as error:
            raise log_file.LogError(f"{self._path}: {_NO_MF4}") from error

    def _blf(
        self, reader: _BlfReader, apart: _TakeApart | None
    ) -> Iterator[can.Message | BlfBlock]:
        count, reader.tally, reader.apart = 0, self.tally, apart
        for message in cast("Iterator[can.Message | BlfBlock]", reader):
            count += 1 if isinstance(message, can.Message) else message.frames
            yield message
        with log_file.open_log(self._path) as file:
            ended = _has_end(file)
            if reader.object_count != count and (reason := _missing_end(file)):
                raise log_file.LogError(f"{self._path}: {reason}")
        if count and not ended:
            raise log_file.LogError(
                f"{self._path}: its recorder did not end it: it has {count} frames"
            )
        if reader.object_count > count:
            self.tally.passed_over[OTHER_OBJECTS] += reader.object_count - count


def channel_name(channel: object) -> str:
    """Return the bus name for a channel, shortened to a length that logs can hold.

    If the channel is only a number, the bus name is `can` and this number, such as `can0`.
    """
    name = "_".join(str(channel).split())
    if channel is None or not name:
        return UNNAMED
    return (f"can{name}" if name.isdecimal() else name)[:LONGEST_NAME]


class BlfBlock(NamedTuple):
    """The content of one container, the compressed unit of a BLF log.

    Attributes:
        rows: frames of the container, in the form that the parser of the container returns.
        frames: number of frames.
        notes: offset, size and type of each BLF object that contains no frame but reports an error,
            such as a driver error.
        end: offset after the last complete object.
    """

    rows: Any
    frames: int
    notes: list[tuple[int, int, int]]
    end: int


_TakeApart = Callable[[bytes, float], BlfBlock | None]
"""Function that parses the content of a container.

Its arguments are the content, and the start of the log in s.
"""

_FILE: Final = struct.Struct("<4sL8xQ8xL")  # signature, sizes of header and file, objects
_OBJECT: Final = struct.Struct("<4sHHLL")  # signature, header, version, size, type
_CONTAINER: Final = struct.Struct("<H6xL4x")  # compression, size of what is in it
OBJECT_BYTES: Final = _OBJECT.size
_SIGNATURE: Final = b"LOBJ"
_SEARCHED: Final = 8
"""Number of bytes in which an object begins, because padding may be before it."""

_CONTAINER_TYPE: Final = 10
_DEFLATED: Final = 2

ERROR, STATISTIC, DRIVER_ERROR, FD_ERROR = 2, 4, 31, 104
"""Types of objects that report errors and that python-can skips."""
BLF_FRAMES: Final = (ERROR, 73, 100, 101, FD_ERROR)
"""Types of frames that are not data or remote frames of classic CAN."""
BLF_NOTES: Final = (STATISTIC, DRIVER_ERROR)
_STAMP: Final = struct.Struct("<L4xQ")  # flags, time
_IN_10_US: Final = 1
"""Flag of a time that is not in nanoseconds."""
_BODY: Final = {1: 32, 2: 40}
"""Offset of an object's body by the version of its header."""
_ERROR_COUNT: Final = struct.Struct("<20xL")
_COUNTERS: Final = struct.Struct("<2xBB")


class _BlfReader(can.BLFReader):
    """python-can's reader with all error frames. It stops at objects without a size.

    Attributes:
        tally: counts of objects that report errors and are not frames.
        apart: parser of containers that hold only usual frames.
    """

    tally: LogTally
    apart: _TakeApart | None = None

    def _parse_data(self, data: bytes) -> Iterator[Any]:
        if self.apart is not None and (block := self.apart(data, self.start_timestamp)):
            for at, size, kind in block.notes:
                self._note(data[at : at + size], kind)
            self._pos = block.end
            yield block
            return
        begin = at = 0
        for at, size, kind in _objects(data):
            if kind in (ERROR, FD_ERROR):
                yield from self._part(data, begin, at)
                yield self._error_frame(data[at : at + size], kind)
                begin = at + size
            elif kind in BLF_NOTES:
                self._note(data[at : at + size], kind)
        yield from self._part(data, begin, len(data))

    def _part(self, data: bytes, begin: int, end: int) -> Iterator[can.Message]:
        """Let python-can read some objects."""
        try:
            yield from super()._parse_data(data[begin:end] if begin or end < len(data) else data)
        finally:
            # python-can notes how far it came in the part that it was given; add what lies
            # before it.
            self._pos += begin

    def _error_frame(self, item: bytes, kind: int) -> can.Message:
        flags, stamp = _STAMP.unpack_from(item.ljust(_OBJECT.size + _STAMP.size), _OBJECT.size)
        body = _body(item)
        # CAN_ERROR has its channel in two bytes, CAN_FD_ERROR_64 in one; both count from 1.
        channel = body[0] if kind == FD_ERROR else int.from_bytes(body[:2], "little")
        return can.Message(
            timestamp=stamp * (1e-5 if flags == _IN_10_US else 1e-9) + self.start_timestamp,
            arbitration_id=ErrorClass.BUS_ERROR,
            is_error_frame=True,
            channel=channel - 1,
        )

    def _note(self, item: bytes, kind: int) -> None:
        """Record a bus error in an object that no frame shows."""
        layout = _ERROR_COUNT if kind == STATISTIC else _COUNTERS
        text = ERRORS_COUNTED if kind == STATISTIC else COUNTERS_TOLD
        if any(layout.unpack_from(_body(item))):
            self.tally.errors_told[text] += 1


def _body(item: bytes) -> bytes:
    _, _, version, _, _ = _OBJECT.unpack_from(item)
    return item[_BODY.get(version, len(item)) :].ljust(_ERROR_COUNT.size, b"\0")


def _objects(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Yield place, size and type of each whole object. Raise ValueError if one has no size."""
    at, last = 0, len(data) - _OBJECT.size
    while 0 <= (begin := data.find(_SIGNATURE, at, at + _SEARCHED)) <= last:
        _, _, _, size, kind = _OBJECT.unpack_from(data, begin)
        if size < _OBJECT.size:
            raise ValueError(f"it has an object of {size} bytes")
        if begin + size > len(data):
            return
        yield begin, size, kind
        at = begin + size


def _missing_end(file: BinaryIO) -> str:
    """Return what is missing at the end of a log, empty if the log is complete.

    Args:
        file: log that python-can has read without an error. The file is read again from its start.
    """
    file.seek(0)
    _, header_bytes, _, declared = _FILE.unpack(file.read(_FILE.size))
    file.seek(header_bytes)
    found, held = 0, b""
    for content in _contents(file):
        if content is None:
            return f"it is cut after {found} objects"
        objects, held = _count(held + content)
        found += objects + 1
    if len(held) >= _OBJECT.size:
        return f"it is cut after {found} objects"
    return f"it ends after {found} of {declared} objects" if found < declared else ""


def _has_end(file: BinaryIO) -> bool:
    """Return whether the writer closed a log, because only then its header has the file size."""
    _, header_bytes, file_bytes, _ = _FILE.unpack(file.read(_FILE.size))
    return bool(file_bytes != header_bytes)


def _contents(file: BinaryIO) -> Iterator[bytes | None]:
    """Yield the content of each container, empty for other objects, and None if it is cut off."""
    while head := file.read(_OBJECT.size):
        if len(head) < _OBJECT.size:
            yield None
            return
        _, _, _, size, kind = _OBJECT.unpack(head)
        body = file.read(max(0, size - _OBJECT.size))
        # The padding has as many bytes as the size is beyond a multiple of four: so
        # python-can writes it.
        file.read(size % 4)
        if len(body) < size - _OBJECT.size:
            yield None
            return
        yield _content(body) if kind == _CONTAINER_TYPE else b""


def _content(body: bytes) -> bytes | None:
    method, size = _CONTAINER.unpack_from(body)
    if method != _DEFLATED:
        return body[_CONTAINER.size :]
    content = zlib.decompressobj().decompress(body[_CONTAINER.size :])
    return content if len(content) >= size else None


def _count(data: bytes) -> tuple[int, bytes]:
    """Return the number of whole objects, and the number of bytes after them."""
    count = at = 0
    for count, (begin, size, _) in enumerate(_objects(data), 1):  # noqa: B007 - counted
        at = begin + size
    return count, data[at:]


# Log files that python-can writes: ASC, BLF, TRC and, with asammdf, MF4.

_FD_FLAGS: Final = 0x1000
"""Flag of a CAN FD frame in ASC. The bits above it are BRS and ESI."""

_TRC_TYPES: Final = {
    (False, False): "FD",
    (True, False): "FB",
    (False, True): "BI",
    (True, True): "FE",
}
"""Types of CAN FD frames in TRC by BRS and ESI."""

_DATE: Final = "%a %b %d %H:%M:%S.{:03d} %Y"
_END: Final = "End TriggerBlock\n"


_EXACT_US: Final = 1 << 51
"""Limit below which a time in seconds is exact to the microsecond as a floating-point number."""


class _AscWriter:
    """Writer that begins at a millisecond of local time. An earlier frame begins a new block.

    python-can's own writer dates the file with the time of writing, and writes 5 ms of a date as
    `.5`. python-can writes a frame from before the start with its absolute time.

    Args:
        file: text file, which is closed with the log.
    """

    def __init__(self, file: TextIO) -> None:
        self._file = file
        self._begin_us: int | None = None

    def on_message_received(self, message: can.Message) -> None:
        """Write a frame."""
        at_us = round(message.timestamp * 1e6)
        if self._begin_us is None or at_us < self._begin_us:
            self._begin(at_us)
        assert self._begin_us is not None, "it has started"
        seconds, micros = divmod(at_us - self._begin_us, 1_000_000)
        self._file.write(f"{seconds:4d}.{micros:06d} {_event(message)}\n")

    def write_block(self, block: TextBlock, number: Callable[[str], int]) -> bool:
        """Write many frames at once, which takes 0.4 us for each frame. A single frame takes 6 us.

        The result is False if nothing was written. The caller must then write the frames of the
        block one by one. There are three reasons:

        - The block contains error frames.
        - A frame of the block is earlier than the first frame of the log. If the log is empty: a
          frame of the block is earlier than the first frame of the block.
        - The time of a frame is so large that a floating-point number of seconds is not exact to
          the microsecond.
        """
        first_us, earliest_us = block.first_us, block.earliest_us
        begin_us = self._begin_us
        if earliest_us < (first_us if begin_us is None else begin_us):
            return False
        if block.errors or block.latest_us >= _EXACT_US:
            return False
        if begin_us is None:
            self._begin(first_us)
        assert self._begin_us is not None, "it has started"
        self._file.write(block.asc_lines(self._begin_us, number))
        return True

    def mark(self, mark: Mark) -> None:
        """Write a comment."""
        if self._begin_us is None:
            self._begin(mark.at_us)
        self._file.write(f"// {mark.text}\n")

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
    if message.is_fd:
        return _fd_event(message, channel, ident, direction)
    kind = "r" if message.is_remote_frame else "d"
    data = f" {message.data.hex(' ').upper()}" if message.data else ""
    return f"{channel}  {ident:<15} {direction:<4} {kind} {message.dlc:x}{data}"


def _fd_event(message: can.Message, channel: int, ident: str, direction: str) -> str:
    """Write the fields after the time.

    Durations, bit timings and CRC are unknown, so they are 0.
    """
    brs, esi = int(message.bitrate_switch), int(message.error_state_indicator)
    # 1000h FDF, 2000h BRS, 4000h ESI.
    flags = _FD_FLAGS * (1 + 2 * brs + 4 * esi)
    data = f" {message.data.hex(' ').upper()}" if message.data else ""
    return (
        f"CANFD {channel:>3} {direction:<4} {ident:>8}  {'':>32} {brs} {esi}"
        f" {len2dlc(message.dlc):x} {message.dlc:>2}{data} {0:>8} {0:>4} {flags:8X} 0 0 0 0 0"
    )


_FIRST_BLF_S: Final = 631_152_000
"""Start of 1990. python-can takes a time before it for one that counts from zero."""

_TRC_STEP_US: Final = 10_546_875
"""Step of 2**-13 days. A multiple is exact as the fraction of a day at the start of a TRC file."""


class _TrcWriter(can.TRCWriter):
    """Writer that begins at a multiple of `_TRC_STEP_US`.

    The text can hold such a date to the microsecond.
    """

    def on_message_received(self, msg: can.Message) -> None:
        """Write a frame."""
        self._begin(int(msg.timestamp * 1e6))
        if not msg.is_fd:
            super().on_message_received(msg)
            return
        self.msgnr += 1
        self.file.write(_fd_trc_line(msg, self.msgnr, self.first_timestamp or 0.0))

    def mark(self, mark: Mark) -> None:
        """Write a comment."""
        self._begin(mark.at_us)
        self.file.write(f";   {mark.text}\n")

    def _begin(self, at_us: int) -> None:
        if self.first_timestamp is None:
            self.first_timestamp = at_us // _TRC_STEP_US * _TRC_STEP_US / 1e6
            self.write_header(self.first_timestamp)


def _fd_trc_line(message: can.Message, number: int, begin_s: float) -> str:
    """Write the line of a frame. python-can reads such a line but does not write it."""
    kind = _TRC_TYPES[message.bitrate_switch, message.error_state_indicator]
    offset_ms = (message.timestamp - begin_s) * 1000
    ident = f"{message.arbitration_id:0{7 if message.is_extended_id else 4}X}"
    direction, channel = "Rx" if message.is_rx else "Tx", (channel2int(message.channel) or 0) + 1
    return (
        f"{number:>7} {offset_ms:13.3f} {kind} {channel:>2} {ident:>8} {direction} -  "
        f"{len2dlc(message.dlc):<4} {message.data.hex(' ').upper()}\n"
    )


class _BlfWriter(can.BLFWriter):
    """Writer that begins at a full second. BLF cannot hold earlier frames.

    Attributes:
        early: number of earlier frames. Such frames get the time of the beginning.
    """

    early = 0
    _dated = False

    def on_message_received(self, msg: can.Message) -> None:
        """Write a frame."""
        start = self.start_timestamp
        self.early += msg.timestamp < (self._begin(msg.timestamp) if start is None else start)
        super().on_message_received(msg)

    def mark(self, mark: Mark) -> None:
        """Write a marker."""
        at_s = mark.at_us / 1e6
        self.log_event(mark.text, max(at_s, self._begin(at_s)))

    def flush(self) -> None:
        """Complete a container, so that it can be read even if the end of the log is missing.

        The start time of the log is also written, because the writer of python-can writes it only
        at the end of the log.
        """
        self._flush()
        if not self._dated and self.start_timestamp is not None:
            self._dated = True
            self.file.seek(0)
            self._write_header(FILE_HEADER_SIZE)  # the size of a log without an end
            self.file.seek(0, os.SEEK_END)

    def _begin(self, at_s: float) -> float:
        if self.start_timestamp is None:
            begin_s = int(at_s)
            self.start_timestamp = float(begin_s if begin_s >= _FIRST_BLF_S else 0)
        return self.start_timestamp


_WRITERS: Final[dict[log_file.LogFormat, Any]] = {
    log_file.LogFormat.ASC: _AscWriter,
    log_file.LogFormat.TRC: _TrcWriter,
    log_file.LogFormat.BLF: _BlfWriter,
    log_file.LogFormat.MF4: can.MF4Writer,
}

_END_US: Final = 16_725_225_600_000_000
"""Limit of times in the year 2500. ASC and TRC end in 9999, nanoseconds of BLF in 2554."""

_MARKS: Final = "marks of gaps and triggers"


class CanLogWriter:
    """Writer of a log in one of the formats that python-can writes, such as ASC or BLF.

    These formats have numbers in place of bus names. A name such as `can3` contains a number. The
    bus `can3` gets the number 3. A bus with another name gets a free number, and `messages` reports
    this number.

    Raises:
        LogError: python-can cannot write the format on this machine.
        OSError: the file cannot be written.
    """

    def __init__(self, path: Path, kind: log_file.LogFormat) -> None:
        log_file.check_written(path, kind)
        self._path, self._kind, self._closed = path, kind, False
        self._numbers = BusNumbers()
        self._passed_over: Counter[str] = Counter()
        self._file: Any = log_file.open_log(path, "wb")
        if kind in (log_file.LogFormat.ASC, log_file.LogFormat.TRC):
            self._file = io.TextIOWrapper(self._file, "utf-8", newline="")
        try:
            self._writer: Any = _WRITERS[kind](self._file)
        except NotImplementedError as error:
            self._file.close()
            path.unlink()
            raise log_file.LogError(f"{path}: {_NO_MF4}") from error

    def write(self, record: Record, /) -> None:
        """Add a frame."""
        if what := _not_held(record, self._kind):
            self._passed_over[what] += 1
            if self._kind is log_file.LogFormat.TRC or record.at_us >= _END_US:
                return
        self._writer.on_message_received(to_can(record, self._numbers.number(record.channel)))

    def write_block(self, block: TextBlock, /) -> bool:
        """Write many frames at once.

        The result is False if the format cannot do this, so that the caller must write the frames
        one by one.
        """
        writer = self._writer
        return isinstance(writer, _AscWriter) and writer.write_block(block, self._numbers.number)

    def mark(self, mark: Mark, /) -> None:
        """Add a comment or marker, or count it."""
        if self._kind is log_file.LogFormat.MF4 or mark.at_us >= _END_US:
            self._passed_over[_MARKS] += 1
        else:
            self._writer.mark(mark)

    def flush(self) -> None:
        """Pass all written items to the operating system.

        Some formats lack their final part until `close`.
        """
        if isinstance(self._writer, _BlfWriter):  # MF4 is written as a whole at its end
            self._writer.flush()
        self._file.flush()

    def close(self) -> None:
        """End the log."""
        if not self._closed:
            self._closed = True
            with self._file:
                self._writer.stop()

    def messages(self) -> list[str]:
        """Report the items that the format could not hold."""
        named = self._path.name
        said = [f"{named}: {count} {what} left out" for what, count in self._passed_over.items()]
        said += self._numbers.messages(named)
        if isinstance(self._writer, _BlfWriter) and self._writer.early:
            said.append(f"{named}: {self._writer.early} frames from before its start moved there")
        return said


def _not_held(record: Record, kind: log_file.LogFormat) -> str:
    """Return the properties that a format cannot hold, empty if it can hold all."""
    if record.at_us >= _END_US:
        return "frames of the year 2500 and later"
    if isinstance(record.frame, ErrorFrame):
        return {
            log_file.LogFormat.TRC: "error frames",
            log_file.LogFormat.ASC: "classes of error frames",
        }.get(kind, "")
    return "remote frames" if kind is log_file.LogFormat.TRC and record.frame.remote else ""
