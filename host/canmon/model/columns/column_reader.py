"""Reader of log files as columns, many lines at a time.

A candump log is read in blocks. The usual lines of a block are parsed all at once (`CandumpBlock`).
The parser of single lines parses every other line, so that the result is the same, frame for frame.
The containers of a BLF log are read in the same way (`BlfBlocks`). Other formats are read frame by
frame.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice, pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from tickrig.host.canmon.model.columns.columns import ChannelNames, Columns, Rows
from tickrig.host.canmon.model.frames import EXTENDED, REMOTE, Record
from tickrig.host.canmon.model.logs import can_log, log_file, log_reader
from tickrig.host.canmon.model.logs.log_file import END_S, LogTally
from tickrig.host.canmon.model.logs.log_reader import BLOCK_BYTES as PIECE
from tickrig.host.canmon.model.logs.log_reader import HEAD, ScreenClock
from tickrig.wire.can import EXTENDED_MAX, MAX_DATA_BYTES, STANDARD_MAX

# Objects of a BLF log, a container at a time; needs numpy.


# An object is a header of 16 bytes, a second header of 16 or 24, by its version, and a body:
#
#     0 "LOBJ"   4 size of both headers   6 version   8 size   12 type
#     16 flags   24 time stamp
#     32 or 40   channel (2), flags, length code, CAN-ID (4), data (8): a frame
#
# All signatures are found at once. Each is followed to the first that is behind its object: if
# that is always the next one, no signature stands among data. A field is then read of all objects
# together, as words at any address. What python-can would read in another way (a frame of CAN FD,
# an error frame, a size that does not fit) makes the container one for the reader of frames.

_FRAMES: Final = (1, 86)
"""Types of objects with frames, CAN_MESSAGE and CAN_MESSAGE2."""

_SIGNATURE: Final = int.from_bytes(b"LOBJ", "little")
_PADDED: Final = 4
"""Largest distance from the end of an object to the start of the next object."""
_SEARCHED: Final = 8

_HEADERS: Final = (32, 40)
"""Number of bytes of both headers, by header version from 1."""
_BODY: Final = 16
_IN_10_US: Final = 1
_SENT, _REMOTE_FRAME = 0x01, 0x80
_EXACT: Final = 1 << 53
"""Number below which a time stamp is exact as a floating-point number."""

_PLAIN, _FRAME, _NOTE, _ODD = range(4)
_KINDS: Final = np.full(256, _PLAIN, np.uint8)
"""Kind of an object by its type. The last entry is for all larger types."""
_KINDS[list(_FRAMES)] = _FRAME
_KINDS[list(can_log.BLF_NOTES)] = _NOTE
_KINDS[list(can_log.BLF_FRAMES)] = _ODD


class _Objects:
    """The objects in a log. Each field can be read from all objects at once.

    Args:
        data: bytes that contain the objects.
        places: offset of each object in the bytes.
        stride: distance between two objects, if it is the same for all. A field is then a view,
            which takes a fifth of the time of gathering its values.
    """

    def __init__(self, data: bytes, places: _Places, stride: int = 0) -> None:
        self.data, self.places, self._stride = data, places, stride

    def field(self, code: str, offset: int) -> npt.NDArray[Any]:
        """Return the numbers at an offset from the beginning of each object."""
        if self._stride:
            begin = int(self.places[0]) + offset
            shape, strides = (len(self.places),), (self._stride,)
            return np.ndarray(shape, code, self.data, begin, strides)
        size = np.dtype(code).itemsize
        return np.ndarray((len(self.data) - size + 1,), code, self.data, 0, (1,))[
            self.places + offset
        ]

    def select(self, rows: _Places) -> _Objects:
        """Return the objects at these positions."""
        whole = len(rows) == len(self.places)
        return self if whole else _Objects(self.data, self.places[rows])


class BlfBlocks:
    """Parser for the containers of a BLF log, which reads all frames of a container at once.

    The parser is called with the content of a container and the start time of the log in seconds.

    Args:
        channels: table of bus names, to which the parser adds the buses of a container. In the
            returned rows, a bus is the index of its name in this table. All containers of the log
            use one table.
    """

    def __init__(self, channels: ChannelNames) -> None:
        self._channels = channels

    def __call__(self, data: bytes, start_s: float) -> can_log.BlfBlock | None:
        """Return the frames of a container, or None if they must be read one by one.

        Args:
            data: uncompressed content of the container.
            start_s: start time of the log in seconds since the epoch.
        """
        found = _alike(data) or _aligned(data) or _anywhere(data)
        if found is None:
            return None
        sizes, versions = found.field("<u4", 8), found.field("<u2", 6)
        kinds = _KINDS[np.minimum(found.field("<u4", 12), len(_KINDS) - 1)]
        if (
            ((versions - np.uint16(1)) > 1).any()
            or sizes.min() < _HEADERS[1]
            or kinds.max() == _ODD
        ):
            return None
        notes = np.flatnonzero(kinds == _NOTE)
        told = zip(*(part[notes].tolist() for part in (found.places, sizes)), strict=True)
        types = found.field("<u4", 12)[notes].tolist()
        end = int(found.places[-1]) + int(sizes[-1])
        rows = self._rows(found.select(np.flatnonzero(kinds == _FRAME)), start_s)
        if rows is None:
            return None
        noted = [(*one, kind) for one, kind in zip(told, types, strict=True)]
        return can_log.BlfBlock(rows, len(rows.known), noted, end)

    def _rows(self, frames: _Objects, start_s: float) -> Rows | None:
        """Return a row for each frame, or None if an object is unusual."""
        rows = Rows(len(frames.places))
        if not len(frames.places):
            return rows
        versions, stamps = frames.field("<u2", 6), frames.field("<u8", 24)
        body = _HEADERS[int(versions[0]) - 1]
        if versions.min() != versions.max() or frames.field("<u4", 8).min() < body + _BODY:
            return None
        # as python-can computes it: its decimal product is exact, so the quotient is rounded alike
        in_10_us = frames.field("<u4", 16) == _IN_10_US
        seconds = stamps / (np.where(in_10_us, 1e5, 1e9) if in_10_us.any() else 1e9) + start_s
        flags, dlc = frames.field("u1", body + 2), frames.field("u1", body + 3)
        if stamps.max() >= _EXACT or seconds.min() < 0 or seconds.max() >= END_S:
            return None
        if dlc.max() > MAX_DATA_BYTES:
            return None
        rows.at_us[:] = np.rint(seconds * 1e6)
        told = frames.field("<u4", body + 4)
        ident, remote = told & np.uint32(EXTENDED_MAX), flags & _REMOTE_FRAME != 0
        rows.ident[:] = ident
        rows.ident[(told & np.uint32(EXTENDED) != 0) | (ident > STANDARD_MAX)] |= EXTENDED
        rows.ident[remote] |= REMOTE
        rows.dlc[:], rows.sent[:], rows.known[:] = dlc, flags & _SENT != 0, True
        rows.payload[:] = frames.field("<u8", body + 8) & _MASKS[dlc]
        rows.payload[remote] = 0
        numbers = frames.field("<u2", body)
        for number in np.flatnonzero(np.bincount(numbers)).tolist():
            rows.channel[numbers == number] = self._channels.place(can_log.channel_name(number - 1))
        return rows


def _alike(data: bytes) -> _Objects | None:
    """Return the objects if all have the size of the first one, as in files of python-can."""
    if len(data) < 2 * can_log.OBJECT_BYTES:
        return None
    size = int.from_bytes(data[8:12], "little")
    if size < can_log.OBJECT_BYTES or len(data) < size:
        return None
    count, rest = divmod(len(data), size)
    found = _Objects(data, np.arange(count) * size, size)
    if (found.field("<u4", 0) != _SIGNATURE).any() or (found.field("<u4", 8) != size).any():
        return None
    if rest < _SEARCHED:
        return found
    head = data[count * size : count * size + can_log.OBJECT_BYTES]
    cut = head[:4] == b"LOBJ" and int.from_bytes(head[8:12], "little") > rest
    return found if cut and len(head) == can_log.OBJECT_BYTES else None


def _aligned(data: bytes) -> _Objects | None:
    """Return the objects if each begins at the end of the previous one, at a multiple of four.

    Logs are written in this way. Compared with a check of each byte, this saves two thirds of the
    time.
    """
    words = np.frombuffer(data, "<u4", len(data) >> 2)
    places = np.flatnonzero(words == _SIGNATURE) * 4
    return None if not len(places) or places[0] else _whole(data, places, 0)


def _anywhere(data: bytes) -> _Objects | None:
    """Return the objects with the padding that python-can skips."""
    if len(data) < can_log.OBJECT_BYTES:
        return None
    words = np.ndarray((len(data) - 3,), "<u4", data, 0, (1,))
    places = np.flatnonzero(words == _SIGNATURE)
    return _whole(data, places, _PADDED) if len(places) and places[0] <= _PADDED else None


def _whole(data: bytes, places: _Places, padded: int) -> _Objects | None:
    """Return the complete objects, or None if the data after an object are unclear.

    Args:
        data: the bytes that contain the objects.
        places: offset of each signature. The first signature belongs to an object.
        padded: number of bytes that may be between two objects.
    """
    places = places[places <= len(data) - can_log.OBJECT_BYTES]
    ends = places + _Objects(data, places).field("<u4", 8)
    rows = _chain(places, ends, len(data), padded)
    return None if rows is None else _Objects(data, places[rows])


def _chain(places: _Places, ends: _Places, length: int, padded: int) -> _Places | None:
    """Return which signatures begin complete, consecutive objects, or None if that is unclear.

    Args:
        places: offset of each signature.
        ends: end that the object of each signature would have.
        length: length of the data.
        padded: number of bytes that may be between two objects.
    """
    if not len(places) or (ends - places < can_log.OBJECT_BYTES).any():
        return None
    behind = np.searchsorted(places, ends)
    count = len(places)
    if (behind[:-1] == np.arange(1, count)).all():
        rows = np.arange(count)
    else:
        following, chain, at = behind.tolist(), list[int](), 0
        while at < count:
            chain.append(at)
            at = following[at]
        rows = np.array(chain)
    gaps = places[rows][1:] - ends[rows][:-1]
    if (gaps > padded).any():
        return None
    if ends[rows[-1]] > length:
        rows = rows[:-1]
    elif ends[rows[-1]] + _SEARCHED <= length:
        return None
    return rows if len(rows) else None


# Whole lines of a candump log, taken apart all at once; needs numpy.

_Words = npt.NDArray[np.uint64]
_Places = npt.NDArray[np.int64]
_Flags = npt.NDArray[np.bool_]

_DOT: Final = 11
_CHANNEL: Final = 20
_LONGEST_NAME: Final = 16
_PADDING: Final = b"\n" * 48
"""Padding after a short last line, because words are read beyond its end."""

_NO_DIGIT: Final = 0x80
_VALUES: Final = bytes(
    int(chr(byte), 16) if chr(byte) in "0123456789abcdefABCDEF" else _NO_DIGIT
    for byte in range(256)
)
_MASKS: Final = np.array([(1 << 8 * count) - 1 for count in range(9)], np.uint64)
"""Masks for the first bytes of a word."""


def _word(text: bytes) -> np.uint64:
    return np.uint64(int.from_bytes(text, "little"))


_NOT_HEX: Final = _word(b"\x80" * 8)
_NOT_DECIMAL: Final = _word(b"\xf0" * 8)
_SIXES: Final = _word(b"\x06" * 8)
_BYTES: Final = _word(b"\xff\0" * 4)
_PAIRS: Final = _word(b"\xff\xff\0\0" * 2)
_FOURS: Final = _word(b"\xff\xff\xff\xff")
_FIRST_TWO: Final = _word(b"\xff\xff")
_LAST_SIX: Final = _word(b"\0\0" + b"\xff" * 6)
_LAST_THREE: Final = _word(b"\0" * 5 + b"\xff" * 3)
_BRACKETS: Final = _word(b"\xff" + b"\0" * 6 + b"\xff")
_DOT_BRACKET: Final = _word(b"." + b"\0" * 6 + b")")
_4, _8, _16, _32 = np.uint64(4), np.uint64(8), np.uint64(16), np.uint64(32)


class CandumpBlock:
    """Complete lines of a candump log, which are parsed all at once.

    A line that candump writes has its fields at fixed positions:

        (1436509052.249713) can0 044#2A366C2BBA
        0          11     18 20  the '#' behind 3 or 8 digits, data up to the line's end

    Each field is read from all lines at once, as words of eight bytes at any address. Before that,
    a table converts hex digits to their values, and all other characters to 0x80. One AND then
    checks eight digits. Shifts within the words combine the values of two, four and eight digits.
    If a line fails a check, the parser of single lines reads that line.

    Args:
        text: lines of the log, each with its LF.

    Attributes:
        starts: offset of each line.
        ends: end of the data in each line, before LF, CR and a direction character.
    """

    def __init__(self, text: bytes) -> None:
        padded = text + _PADDING
        values = padded.translate(_VALUES)
        self._text, self._raw = text, np.frombuffer(padded, np.uint8)
        self._raw_words, self._value_words = _words(padded), _words(values)
        ends = np.flatnonzero(self._raw[: len(text)] == ord("\n"))
        self.starts: _Places = np.concatenate(([0], ends[:-1] + 1))
        if b"\r" in text:
            ends = ends - (self._raw[ends - 1] == ord("\r"))
        last = self._raw[ends - 1]
        directed = (self._raw[ends - 2] == ord(" ")) & ((last == ord("R")) | (last == ord("T")))
        self.ends: _Places = ends - 2 * directed
        self._sent = directed & (last == ord("T"))
        self._lines_end = ends

    def line(self, row: int) -> str:
        """Return the text of a line."""
        return self._text[self.starts[row] : self._lines_end[row]].decode("latin-1")

    def take(self, rows: Rows, channels: ChannelNames) -> None:
        """Fill the rows of lines that have exactly the form that candump writes."""
        marks, known = self._marks()
        rows.at_us[:], fits = self._stamps()
        known &= fits
        standard = self._raw[marks - 4] == ord(" ")
        known &= standard | (self._raw[marks - 9] == ord(" "))
        rows.ident[:], fits = self._idents(marks, standard)
        known &= fits
        rows.payload[:], rows.dlc[:], fits = self._data(marks)
        known &= fits
        self._name(marks - np.where(standard, 4, 9), known, rows, channels)
        rows.sent[:], rows.known[:] = self._sent, known

    def _marks(self) -> tuple[_Places, _Flags]:
        """Return the position of the first # of each line, and whether the line has a #."""
        marks = np.flatnonzero(self._raw[: len(self._text)] == ord("#"))
        if len(marks) != len(self.starts) or (marks < self.starts).any():
            marks = np.append(marks, len(self._text))
            marks = marks[np.searchsorted(marks[:-1], self.starts)]
        known = (marks < self.ends) & (marks > self.starts + _CHANNEL)
        return np.where(known, marks, _CHANNEL), known

    def _stamps(self) -> tuple[_Places, _Flags]:
        """Return times from eight digits, two digits before the dot, and six digits after it."""
        starts = self.starts
        high = self._value_words[starts + 1]
        low = self._value_words[starts + 9] & _FIRST_TWO
        low |= self._value_words[starts + 10] & _LAST_SIX
        known = ((high + _SIXES) | (low + _SIXES)) & _NOT_DECIMAL == 0
        known &= self._raw[starts] == ord("(")
        known &= self._raw_words[starts + _DOT] & _BRACKETS == _DOT_BRACKET
        known &= self._raw[starts + _CHANNEL - 1] == ord(" ")
        at_us = _decimal(high) * np.uint64(100_000_000) + _decimal(low)
        return at_us.view(np.int64), known

    def _idents(self, marks: _Places, standard: _Flags) -> tuple[_Words, _Flags]:
        """Return identifiers with the flag of extended identifiers."""
        digits = self._value_words[marks - 8]
        digits = np.where(standard, digits & _LAST_THREE, digits)
        known = digits & _NOT_HEX == 0
        pairs = (digits << _4 | digits >> _8) & _BYTES
        fours = (pairs << _8 | pairs >> _16) & _PAIRS
        can_ids = (fours << _16 | fours >> _32) & _FOURS
        known &= can_ids <= np.where(standard, STANDARD_MAX, EXTENDED_MAX)
        return can_ids | np.where(standard, np.uint64(0), np.uint64(EXTENDED)), known

    def _data(self, marks: _Places) -> tuple[_Words, _Places, _Flags]:
        """Return data as numbers, and the lengths of the data."""
        digits = self.ends - marks - 1
        known = (digits & 1 == 0) & (digits <= 16) & (digits >= 0)
        low = self._value_words[marks + 1] & _MASKS[np.clip(digits, 0, 8)]
        high = self._value_words[marks + 9] & _MASKS[np.clip(digits - 8, 0, 8)]
        known &= (low | high) & _NOT_HEX == 0
        return _bytes(low) | _bytes(high) << _32, digits >> 1, known

    def _name(self, ends: _Places, known: _Flags, rows: Rows, channels: ChannelNames) -> None:
        """Write the numbers of the buses. Lines with unusual names of buses are left out."""
        starts = self.starts + _CHANNEL
        lengths = ends - starts
        known &= (lengths > 0) & (lengths <= _LONGEST_NAME)
        low = self._raw_words[starts] & _MASKS[np.clip(lengths, 0, 8)]
        high = self._raw_words[starts + 8] & _MASKS[np.clip(lengths - 8, 0, 8)]
        left = known.copy()
        while left.any():
            row = int(left.argmax())
            same = left & (low == low[row]) & (high == high[row]) & (lengths == lengths[row])
            name = self._text[starts[row] : ends[row]].decode("latin-1")
            if name.isascii() and name.isprintable() and " " not in name:
                rows.channel[same] = channels.place(name)
            else:
                known &= ~same
            left &= ~same


def _words(text: bytes) -> _Words:
    """Return the words that begin at each byte."""
    return np.ndarray((len(text) - 7,), "<u8", text, strides=(1,))


def _decimal(digits: _Words) -> _Words:
    """Return the numbers of eight decimal digits."""
    pairs = (digits * np.uint64(10) + (digits >> _8)) & _BYTES
    fours = (pairs * np.uint64(100) + (pairs >> _16)) & _PAIRS
    return (fours * np.uint64(10_000) + (fours >> _32)) & _FOURS


def _bytes(digits: _Words) -> _Words:
    """Return four bytes from eight hex digits each. The first byte is the lowest."""
    values = (digits << _4 | digits >> _8) & _BYTES
    values = (values | values >> _8) & _PAIRS
    return (values | values >> _16) & _FOURS


BLOCK_BYTES: Final = 1 << 20
"""Size of a block of some 23 000 lines, whose results fit into the cache of the processor."""

_BATCH: Final = 1 << 14
"""Frames of a block of other formats. With half as many frames, statistics take a third longer."""

_ITEMS: Final = 1 << 10
"""Frames of a piece that is not in columns."""


def read_columns(path: Path) -> ColumnReader:
    """Return a reader that yields a log file in blocks of frames as numpy arrays.

    The file is opened when the iteration over the reader starts.

    Args:
        path: path of the log file, whose suffix determines the format.

    Raises:
        LogFormatError: the name of the file has no suffix of a known format.
    """
    return ColumnReader(path, log_file.log_format(path))


class ColumnReader:
    """Reader of a log file that yields blocks of frames as numpy arrays.

    The file is opened when the iteration starts. A reader can be iterated only once. It holds one
    block in memory, regardless of the size of the file.

    Attributes:
        tally: counts of items in the log that are not returned as frames, such as invalid lines.

    Raises:
        OSError: the file cannot be read. This is raised during the iteration.
        LogError: the content does not match the suffix of the file, or the log has more than 256
            buses. This is raised during the iteration.
        NoColumnsError: the log contains a CAN FD frame. This is raised during the iteration.
    """

    def __init__(self, path: Path, kind: log_file.LogFormat) -> None:
        self._path, self._kind, self.tally = path, kind, LogTally()
        self._channels = ChannelNames()

    def __iter__(self) -> Iterator[Columns]:
        """Read the file."""
        candump = self._kind is log_file.LogFormat.CANDUMP
        for rows in self._of_lines() if candump else self._of_frames():
            yield rows.columns(self._channels)

    def pieces(self) -> Iterator[Columns | Sequence[log_reader.Item]]:
        """Yield the log in pieces: blocks of columns, or lists of single items.

        If the format of the log cannot be read as columns, all pieces are lists. In any other
        format, a piece with a CAN FD frame or a mark is a list, because columns cannot contain
        these. A mark is an event in the log, such as lost frames.
        """
        if self._kind is log_file.LogFormat.CANDUMP:
            yield from self._pieces_of_lines()
        elif self._kind is log_file.LogFormat.BLF:
            yield from self._pieces_of_blocks()
        else:
            reader = log_reader.read_log(self._path)
            items = reader.items()
            while batch := list(islice(items, _ITEMS)):
                self.tally = reader.tally
                yield batch
            self.tally = reader.tally

    def _pieces_of_lines(self) -> Iterator[Columns | Sequence[log_reader.Item]]:
        lines = log_reader.LogLines()
        lines.tally = self.tally
        for text, held in self._whole_lines():
            yield from self._piece(text, lines, held)

    def _piece(
        self, text: bytes, lines: log_reader.LogLines, held: int
    ) -> Iterator[Columns | Sequence[log_reader.Item]]:
        """Return the frames of some lines, as columns if the lines hold only frames.

        Args:
            text: lines of the log, each with its LF.
            lines: reader that reads or counts the lines.
            held: number of bytes at the start of the text that were read before.
        """
        block = CandumpBlock(text)
        rows = Rows(len(block.starts))
        block.take(rows, self._channels)
        strange = (~rows.known).nonzero()[0].tolist()
        if len(strange) > len(rows.known) // 8 or not all(
            map(log_reader.holds_frame, map(block.line, strange))
        ):
            for begin, end in pairwise((0, *range(held + PIECE, len(text), PIECE), len(text))):
                records = lines.push(text[begin:end])
                yield log_reader.among(records, lines.marks)
            return
        for row in strange:
            record = log_reader.parse_log_line(block.line(row), lines.number + row + 1, self.tally)
            if record is not None:
                rows.put(row, record, self._channels.place(record.channel))
        columns = rows.columns(self._channels)
        unusual = any(not log_reader.is_usual(block.line(row)) for row in strange)
        lines.skip(len(rows.known), int(columns.at_us[-1]) if len(columns) else None, unusual)
        yield columns

    def _pieces_of_blocks(self) -> Iterator[Columns | Sequence[log_reader.Item]]:
        reader, failed = log_reader.read_log(self._path), None
        singles = list[log_reader.Item]()
        try:
            for found in self._frames(reader):
                self.tally = reader.tally
                if isinstance(found, Record):
                    singles.append(found)
                    if len(singles) < _ITEMS:
                        continue
                if singles:
                    yield singles
                    singles = []
                if not isinstance(found, Record):
                    yield found.columns(self._channels)
        except (log_file.LogError, OSError) as error:  # all that was read before it counts
            failed = error
        self.tally = reader.tally
        if singles:
            yield singles
        if failed is not None:
            raise failed

    def _of_frames(self) -> Iterator[Rows]:
        """Read frames in pieces, with many frames together if the format supports columns."""
        reader, failed = log_reader.read_log(self._path), None
        rows, singles, held = list[Rows](), list[Record](), 0
        try:
            for found in self._frames(reader):
                if isinstance(found, Record):
                    singles.append(found)
                    held += 1
                else:
                    rows += [*self._batch(singles), found]
                    held += len(found.known)
                if held >= _BATCH:
                    self.tally = reader.tally
                    yield Rows.joined([*rows, *self._batch(singles)])
                    rows, held = [], 0
        except (log_file.LogError, OSError) as error:  # all that was read before it counts
            failed = error
        self.tally = reader.tally
        if held:
            yield Rows.joined([*rows, *self._batch(singles)])
        if failed is not None:
            raise failed

    def _batch(self, singles: list[Record]) -> list[Rows]:
        rows = [Rows.of(singles, self._channels)] if singles else []
        singles.clear()
        return rows

    def _frames(self, reader: log_reader.LogReader) -> Iterator[Record | Rows]:
        if self._kind is not log_file.LogFormat.BLF:
            return iter(reader)
        # python-can is slow to import
        from tickrig.host.canmon.model.logs.can_log import CanLogReader  # noqa: PLC0415

        assert isinstance(reader, CanLogReader), "it reads BLF"
        found = reader.blocks(BlfBlocks(self._channels))
        return (one if isinstance(one, Record) else one.rows for one in found)

    def _of_lines(self) -> Iterator[Rows]:
        number, clock = 0, None
        for text, _ in self._whole_lines():
            clock = clock or ScreenClock.of(text[:HEAD].decode("latin-1"))
            rows = self._take_apart(text, number, clock)
            number += len(rows.known)
            yield rows

    def _whole_lines(self) -> Iterator[tuple[bytes, int]]:
        """Read whole lines. Each text comes with how many of its bytes an earlier block held."""
        whole = log_reader.WholeLines()
        with log_file.open_log(self._path) as file:
            for data in log_file.read_blocks(file, self._path, BLOCK_BYTES):
                if text := whole.push(data):
                    yield text, len(text) - data.rfind(b"\n") - 1
        if rest := whole.finish():
            yield rest + b"\n", len(rest)

    def _take_apart(self, text: bytes, number: int, clock: ScreenClock) -> Rows:
        """Return a row for each line. `number` is the number of lines before these lines."""
        block = CandumpBlock(text)
        rows = Rows(len(block.starts))
        block.take(rows, self._channels)
        for row in (~rows.known).nonzero()[0].tolist():
            record = log_reader.parse_log_line(block.line(row), number + row + 1, self.tally, clock)
            if record is not None:
                rows.put(row, record, self._channels.place(record.channel))
        return rows
