"""A log as columns of numpy, with an array for each property of a frame.

numpy comes with the extra `fast`. This module is imported only if numpy is installed.

The module also groups the frames of a bus by identifier, block after block.

>>> idents = Identifiers()
>>> runs = idents.take(np.array([0x181, 0x080, 0x181]), np.array([100, 200, 500]))
>>> [hex(ident) for ident in idents.idents[runs.numbers]], runs.gaps_us.tolist()
(['0x80', '0x181'], [0, 0, 400])
>>> idents.take(np.array([0x080]), np.array([250])).gaps_us.tolist()
[50]
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeVar

import numpy as np
import numpy.typing as npt

from tickrig.host.canmon.model.frames import Record, flagged_id, frame_of
from tickrig.host.canmon.model.logs.log_file import LogError
from tickrig.host.canmon.model.traffic import WINDOW_US, BusSecond, Load
from tickrig.wire.can import ErrorFrame, FdFrame

_MOST_CHANNELS: Final = 256

Ints = npt.NDArray[np.int64]


class NoColumnsError(ValueError):
    """Raised if a log with CAN FD frames is read as numpy arrays. Read it frame by frame."""


@dataclass(frozen=True, slots=True, eq=False)
class Columns:
    """A block of frames in the order of the log, stored as one numpy array for each property.

    Attributes:
        at_us: time of the end of each frame in microseconds.
        ident: CAN-ID of each frame with flags: bit 31 for an extended frame, bit 30 for a remote
            frame, and bit 29 for an error frame.
        dlc: data length code of each frame, 0 to 8.
        payload: data of each frame as a little-endian number, padded with zeros.
        sent: whether the recorder sent the frame.
        channel: index in `channels` of the bus of each frame.
        channels: names of the buses, in the order of their first frames.
    """

    at_us: npt.NDArray[np.int64]
    ident: npt.NDArray[np.uint32]
    dlc: npt.NDArray[np.uint8]
    payload: npt.NDArray[np.uint64]
    sent: npt.NDArray[np.bool_]
    channel: npt.NDArray[np.uint8]
    channels: tuple[str, ...] = ()

    @property
    def parts(self) -> tuple[npt.NDArray[Any], ...]:
        """The arrays of the frames' properties."""
        return self.at_us, self.ident, self.dlc, self.payload, self.sent, self.channel

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.at_us)


class ChannelNames:
    """Names of buses in the order in which they appear."""

    def __init__(self) -> None:
        self._places: dict[str, int] = {}

    @property
    def names(self) -> tuple[str, ...]:
        """The names in the order of appearance."""
        return tuple(self._places)

    def place(self, name: str) -> int:
        """Return the index of a name. Raise LogError if there are too many names."""
        place = self._places.setdefault(name, len(self._places))
        if place >= _MOST_CHANNELS:
            raise LogError(f"more than {_MOST_CHANNELS} buses in a log")
        return place


class Rows:
    """A block of frames that is filled row by row while a log is parsed, and becomes `Columns`.

    Attributes:
        at_us, ident, dlc, payload, sent, channel: arrays as in `Columns`. Rows that are not filled
            yet contain 0.
        known: whether a row is filled with a frame.
    """

    def __init__(self, count: int) -> None:
        self.at_us = np.zeros(count, np.int64)
        self.ident = np.zeros(count, np.uint32)
        self.dlc = np.zeros(count, np.uint8)
        self.payload = np.zeros(count, np.uint64)
        self.sent = np.zeros(count, np.bool_)
        self.channel = np.zeros(count, np.uint8)
        self.known = np.zeros(count, np.bool_)

    @classmethod
    def of(cls, frames: list[Record], channels: ChannelNames) -> Rows:
        """Return rows of frames."""
        rows = cls(len(frames))
        for row, record in enumerate(frames):
            rows.put(row, record, channels.place(record.channel))
        return rows

    @classmethod
    def joined(cls, pieces: Sequence[Rows]) -> Rows:
        """Return the rows of several pieces. There is at least one piece."""
        if len(pieces) == 1:
            return pieces[0]
        rows = cls(sum(len(piece.known) for piece in pieces))
        for name in ("at_us", "ident", "dlc", "payload", "sent", "channel", "known"):
            np.concatenate([getattr(piece, name) for piece in pieces], out=getattr(rows, name))
        return rows

    def put(self, row: int, record: Record, channel: int) -> None:
        """Fill a row with a frame. Raise NoColumnsError for a CAN FD frame.

        Args:
            row: index of the row.
            record: frame, with its time.
            channel: index of the bus.
        """
        frame = record.frame
        if isinstance(frame, FdFrame):
            raise NoColumnsError("CAN FD")
        self.at_us[row], self.ident[row] = record.at_us, flagged_id(record)
        self.dlc[row] = len(frame.data) if isinstance(frame, ErrorFrame) else frame.dlc
        self.payload[row] = int.from_bytes(frame.data, "little")
        self.sent[row] = record.sent
        self.channel[row], self.known[row] = channel, True

    def columns(self, channels: ChannelNames) -> Columns:
        """Return the known rows as columns."""
        parts = self.at_us, self.ident, self.dlc, self.payload, self.sent, self.channel
        columns = Columns(*parts, channels.names)
        return columns if self.known.all() else select(columns, np.flatnonzero(self.known))


def select(columns: Columns, rows: Ints | slice) -> Columns:
    """Return some rows."""
    at_us, ident, dlc, payload, sent, channel = (part[rows] for part in columns.parts)
    return Columns(at_us, ident, dlc, payload, sent, channel, columns.channels)


def by_channel(columns: Columns) -> list[tuple[str, Ints, Columns]]:
    """Split a block of frames by bus. Buses without a frame in the block are left out.

    Returns:
        The name, the row indices and the frames of each bus, sorted by name.
    """
    present = np.flatnonzero(np.bincount(columns.channel)).tolist()
    if len(present) == 1:
        return [(columns.channels[present[0]], np.arange(len(columns)), columns)]
    rows = {columns.channels[place]: np.flatnonzero(columns.channel == place) for place in present}
    return [(channel, rows[channel], select(columns, rows[channel])) for channel in sorted(rows)]


def records(columns: Columns) -> list[Record]:
    """Return frames as records, as a reader of single frames returns them."""
    names = columns.channels
    rows = zip(*(part.tolist() for part in columns.parts), strict=True)
    return [
        Record(at_us, names[channel], frame_of(ident, dlc, payload), sent)
        for at_us, ident, dlc, payload, sent, channel in rows
    ]


def record_at(columns: Columns, row: int) -> Record:
    """Return one frame."""
    at_us, ident, dlc, payload, sent, channel = (part[row].item() for part in columns.parts)
    return Record(at_us, columns.channels[channel], frame_of(ident, dlc, payload), sent)


Numbers = TypeVar("Numbers", bound=npt.NDArray[Any])

_RADIX: Final = 1 << 16
"""Size of a digit for sorting. numpy sorts 16 bits three times as fast as 32."""

_NO_IDENT: Final = 0xFFFF_FFFF


@dataclass(frozen=True, slots=True)
class Runs:
    """The rows of a block sorted by CAN-ID.

    The rows of one CAN-ID keep their order, and are called a run.

    Attributes:
        order: row indices in the sorted order.
        begins: index in `order` of the first row of each run.
        ends: index in `order` after the last row of each run.
        numbers: number that `Identifiers` gave to the CAN-ID of each run.
        fresh: whether a run contains the first frame of its CAN-ID in the whole log.
        gaps_us: time in microseconds since the previous frame of the CAN-ID, for each row in
            `order`. The gap is 0 for the first frame of a CAN-ID, and if the time decreases.
    """

    order: Ints
    begins: Ints
    ends: Ints
    numbers: Ints
    fresh: npt.NDArray[np.bool_]
    gaps_us: Ints

    @property
    def lengths(self) -> Ints:
        """The number of frames of each run."""
        return self.ends - self.begins

    def sums(self, values: Ints) -> Ints:
        """Add up the values of each run, and return one sum for each run.

        A run consists of the rows of one CAN-ID.

        Args:
            values: one value for each row, in the sequence of `order`.
        """
        return np.add.reduceat(values, self.begins)


class Identifiers:
    """The CAN-IDs of a bus, numbered in the order of their first frames.

    A CAN-ID has the same number in all blocks of frames. The method `take` sorts the frames of one
    block by these numbers.

    Attributes:
        idents: CAN-IDs with flags, indexed by number.
        first_us: time of the first frame of each CAN-ID in microseconds, indexed by number.
        last_us: time of the last frame of each CAN-ID in microseconds, indexed by number.
    """

    def __init__(self) -> None:
        self.idents = self.first_us = self.last_us = np.empty(0, np.int64)
        self._sorted = np.array([_NO_IDENT], np.uint32)
        self._numbers = np.array([-1])

    def __len__(self) -> int:
        """Return the number of identifiers."""
        return len(self.idents)

    def take(self, ident: npt.NDArray[np.uint32], at_us: Ints) -> Runs:
        """Sort a block of frames. There is at least one frame."""
        before = len(self)
        numbers = self._numbered(ident)
        order = np.argsort(
            numbers.astype(np.uint16) if len(self) <= _RADIX else numbers, kind="stable"
        )
        numbers, times_us = numbers[order], at_us[order]
        begins = np.flatnonzero(np.diff(numbers, prepend=-1))
        ends = np.append(begins[1:], len(numbers))
        numbers = numbers[begins]
        fresh = numbers >= before
        gaps_us = np.diff(times_us, prepend=0)
        self.first_us[numbers[fresh]] = self.last_us[numbers[fresh]] = times_us[begins[fresh]]
        gaps_us[begins] = times_us[begins] - self.last_us[numbers]
        self.last_us[numbers] = times_us[ends - 1]
        return Runs(order, begins, ends, numbers, fresh, np.maximum(gaps_us, 0, out=gaps_us))

    def _numbered(self, ident: npt.NDArray[np.uint32]) -> Ints:
        """Return the number of each row's identifier. New identifiers get the next numbers."""
        places = np.searchsorted(self._sorted, ident)
        strange = self._sorted[places] != ident
        if strange.any():
            self._add(np.unique(ident[strange]))
            places = np.searchsorted(self._sorted, ident)
        return self._numbers[places]

    def _add(self, idents: npt.NDArray[np.uint32]) -> None:
        numbers = np.arange(len(self), len(self) + len(idents))
        places = np.searchsorted(self._sorted, idents)
        self._sorted = np.insert(self._sorted, places, idents)
        self._numbers = np.insert(self._numbers, places, numbers)
        self.idents = np.append(self.idents, idents.astype(np.int64))
        self.first_us = grown(self.first_us, len(self))
        self.last_us = grown(self.last_us, len(self))


def grown(column: Numbers, count: int) -> Numbers:
    """Return a column, extended to `count` rows. New rows are 0."""
    if len(column) == count:
        return column
    rows = np.zeros((count, *column.shape[1:]), column.dtype)
    rows[: len(column)] = column
    return rows  # type: ignore[return-value]  # of the same kind


# The seconds of a bus, block after block, as `Load` opens them; needs numpy.


class ColumnLoad:
    """Calculator of the bus load in each second, which processes many frames at once.

    Args:
        first_us: time of the first frame in microseconds. The first second begins at this time.

    Attributes:
        load: bus load calculated so far.
    """

    def __init__(self, first_us: int) -> None:
        self._first_us, self.load = first_us, Load(first_us)

    def take(self, at_us: Ints, bits: Ints) -> list[tuple[BusSecond, int]]:
        """Count frames. Return the completed seconds, each with the row that ended it."""
        if not len(at_us):
            return []
        opened = (self.load.begin_us - self._first_us) // WINDOW_US
        latest_us = np.maximum.accumulate(at_us - self._first_us)
        seconds = np.maximum(latest_us // WINDOW_US, opened)
        begins = np.flatnonzero(np.diff(seconds, prepend=-1))
        starts_us = (seconds[begins] * WINDOW_US + self._first_us).tolist()
        sums = np.add.reduceat(bits, begins).tolist()
        ended = [self.load.take(*one) for one in zip(starts_us, sums, strict=True)]
        rows = zip(ended, begins.tolist(), strict=True)
        return [(window, row) for window, row in rows if window is not None]
