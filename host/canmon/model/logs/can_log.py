"""Log files that python-can reads: BLF and, with asammdf, MF4.

A BLF log is a header and objects. Most are containers, whose contents, put together,
are the objects of interest; one may lie across two containers. python-can reads a log that was
cut as far as it goes, in silence, and passes over two of the three kinds of error frames.
"""

from __future__ import annotations

import logging
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, Final

import can
from can.io.blf import BLFParseError

from tickrig.host.canmon.model.frames.record import Record
from tickrig.host.canmon.model.logs.can_record import to_record
from tickrig.host.canmon.model.logs.log_file import NO_MF4, LogError, LogFormat, open_log
from tickrig.host.canmon.model.logs.notation import LONGEST_NAME, UNNAMED
from tickrig.host.canmon.model.logs.tally import (
    COUNTERS_TOLD,
    ERRORS_COUNTED,
    OTHER_OBJECTS,
    Tally,
)
from tickrig.wire.can import STANDARD_MAX
from tickrig.wire.can_error import ErrorClass

BROKEN: Final = (
    *(ValueError, LookupError, TypeError, ArithmeticError, EOFError, NotImplementedError),
    *(struct.error, zlib.error, BLFParseError, can.CanError),
)
"""What python-can's readers raise in files that they do not understand."""

UNSAID: Final = logging.NullHandler()
"""For what python-can logs of objects: what is not read of them is counted here."""


class CanLogReader:
    """A reader of a log that python-can understands."""

    def __init__(self, path: Path, kind: LogFormat) -> None:
        self._path, self._kind, self.tally = path, kind, Tally()

    def __iter__(self) -> Iterator[Record]:
        """Read the file."""
        self.tally = Tally()
        names: dict[object, str] = {}
        for message in self._messages():
            if message.channel not in names:
                names[message.channel] = channel_name(message.channel)
            message.is_extended_id |= message.arbitration_id > STANDARD_MAX  # as ASC without its x
            record = to_record(message, names[message.channel], self.tally)
            if record is not None:
                yield record

    def items(self) -> Iterator[Record]:
        """Read the file; its marks are counted alone."""
        return iter(self)

    def _messages(self) -> Iterator[can.Message]:
        logging.getLogger("can.io.blf").addHandler(UNSAID)
        with open_log(self._path) as file:
            try:
                if self._kind is LogFormat.BLF:
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

    def _mf4(self, file: BinaryIO) -> can.MF4Reader:
        try:
            return can.MF4Reader(file)
        except NotImplementedError as error:
            raise LogError(f"{self._path}: {NO_MF4}") from error

    def _blf(self, reader: BlfReader) -> Iterator[can.Message]:
        count, reader.tally = 0, self.tally
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


_FILE: Final = struct.Struct("<4sL8xQ8xL")  # signature, sizes of header and file, objects
_OBJECT: Final = struct.Struct("<4sHHLL")  # signature, header, version, size, type
_CONTAINER: Final = struct.Struct("<H6xL4x")  # compression, size of what is in it
_SIGNATURE: Final = b"LOBJ"
_SEARCHED: Final = 8
"""Bytes in which an object begins: behind the padding of the one before."""

_CONTAINER_TYPE: Final = 10
_DEFLATED: Final = 2

ERROR, STATISTIC, DRIVER_ERROR, FD_ERROR = 2, 4, 31, 104
"""Types of objects that tell of errors and that python-can passes over."""
_STAMP: Final = struct.Struct("<L4xQ")  # flags, time
_IN_10_US: Final = 1
"""The flag of a time that is not in nanoseconds."""
_BODY: Final = {1: 32, 2: 40}
"""Where the body of an object begins, by the version of its header."""
_ERROR_COUNT: Final = struct.Struct("<20xL")
_COUNTERS: Final = struct.Struct("<2xBB")


class BlfReader(can.BLFReader):
    """python-can's reader, with all error frames, and an end at objects without a size.

    Attributes:
        tally: takes what objects say of errors that are no frames.
    """

    tally: Tally

    def _parse_data(self, data: bytes) -> Iterator[can.Message]:
        begin = at = 0
        for at, size, kind in _objects(data):
            if kind in (ERROR, FD_ERROR):
                yield from self._part(data, begin, at)
                yield self._error_frame(data[at : at + size], kind)
                begin = at + size
            elif kind in (STATISTIC, DRIVER_ERROR):
                self._note(data[at : at + size], kind)
        yield from self._part(data, begin, len(data))

    def _part(self, data: bytes, begin: int, end: int) -> Iterator[can.Message]:
        """Have python-can read some objects."""
        try:
            yield from super()._parse_data(data[begin:end] if begin or end < len(data) else data)
        finally:
            self._pos += begin

    def _error_frame(self, item: bytes, kind: int) -> can.Message:
        flags, stamp = _STAMP.unpack_from(item.ljust(_OBJECT.size + _STAMP.size), _OBJECT.size)
        body = _body(item)
        channel = body[0] if kind == FD_ERROR else int.from_bytes(body[:2], "little")
        return can.Message(
            timestamp=stamp * (1e-5 if flags == _IN_10_US else 1e-9) + self.start_timestamp,
            arbitration_id=ErrorClass.BUS_ERROR,
            is_error_frame=True,
            channel=channel - 1,
        )

    def _note(self, item: bytes, kind: int) -> None:
        """Note what an object says of errors that no frame shows."""
        layout = _ERROR_COUNT if kind == STATISTIC else _COUNTERS
        text = ERRORS_COUNTED if kind == STATISTIC else COUNTERS_TOLD
        if any(layout.unpack_from(_body(item))):
            self.tally.errors_told[text] += 1


def _body(item: bytes) -> bytes:
    _, _, version, _, _ = _OBJECT.unpack_from(item)
    return item[_BODY.get(version, len(item)) :].ljust(_ERROR_COUNT.size, b"\0")


def _objects(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Give place, size and type of each whole object; ValueError if one has no size."""
    at, last = 0, len(data) - _OBJECT.size
    while 0 <= (begin := data.find(_SIGNATURE, at, at + _SEARCHED)) <= last:
        _, _, _, size, kind = _OBJECT.unpack_from(data, begin)
        if size < _OBJECT.size:
            raise ValueError(f"it has an object of {size} bytes")
        if begin + size > len(data):
            return
        yield begin, size, kind
        at = begin + size


def missing_end(file: BinaryIO) -> str:
    """Say what is missing at the end of a log; empty where nothing is.

    Args:
        file: a log that python-can has read without an error; it is read from its beginning.
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


def has_end(file: BinaryIO) -> bool:
    """Say whether whoever wrote a log ended it: only then its header tells the size of the file."""
    _, header_bytes, file_bytes, _ = _FILE.unpack(file.read(_FILE.size))
    return bool(file_bytes != header_bytes)


def _contents(file: BinaryIO) -> Iterator[bytes | None]:
    """Yield what is in each object of the file: of others than containers nothing, None if cut."""
    while head := file.read(_OBJECT.size):
        if len(head) < _OBJECT.size:
            yield None
            return
        _, _, _, size, kind = _OBJECT.unpack(head)
        body = file.read(max(0, size - _OBJECT.size))
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
    """Return how many objects are whole, and the bytes behind them."""
    count = at = 0
    for count, (begin, size, _) in enumerate(_objects(data), 1):  # noqa: B007 - counted
        at = begin + size
    return count, data[at:]
