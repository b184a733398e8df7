"""A log as columns of numpy: an array for each property of a frame.

numpy comes with the extra `fast`; this module is imported only where it is there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from tickrig.host.canmon.model.frames.ident import ERROR, EXTENDED, REMOTE, flagged_id
from tickrig.host.canmon.model.frames.record import Record
from tickrig.host.canmon.model.logs.log_file import LogError
from tickrig.wire.can import EXTENDED_MAX, CanFrame
from tickrig.wire.can_error import ERROR_CLASS_MASK, ErrorFrame
from tickrig.wire.can_fd import FdFrame

MOST_CHANNELS: Final = 256

Ints = npt.NDArray[np.int64]


class NoColumnsError(ValueError):
    """A log that is no columns, for it holds CAN FD: it is to be read frame by frame."""


@dataclass(frozen=True, slots=True, eq=False)
class Columns:
    """Frames, column by column, in the order of the log.

    Attributes:
        at_us: when each had ended, microseconds.
        ident: identifier; bit 31 extended, bit 30 remote, bit 29 error frame.
        dlc: data length code, 0 to 8.
        payload: data as a little-endian number, zeros behind it.
        channel: place of the bus in `channels`.
        channels: names of the buses, in the order in which they appeared.
    """

    at_us: npt.NDArray[np.int64]
    ident: npt.NDArray[np.uint32]
    dlc: npt.NDArray[np.uint8]
    payload: npt.NDArray[np.uint64]
    channel: npt.NDArray[np.uint8]
    channels: tuple[str, ...] = ()

    @property
    def parts(self) -> tuple[npt.NDArray[Any], ...]:
        """The arrays of the frames' properties."""
        return self.at_us, self.ident, self.dlc, self.payload, self.channel

    def __len__(self) -> int:
        """Return how many frames there are."""
        return len(self.at_us)


class ChannelNames:
    """Names of buses in the order in which they appear."""

    def __init__(self) -> None:
        self._places: dict[str, int] = {}

    @property
    def names(self) -> tuple[str, ...]:
        """The names."""
        return tuple(self._places)

    def place(self, name: str) -> int:
        """Return the place of a name; LogError if there are too many."""
        place = self._places.setdefault(name, len(self._places))
        if place >= MOST_CHANNELS:
            raise LogError(f"more than {MOST_CHANNELS} buses in a log")
        return place


class Rows:
    """Columns of some frames, of which not all are known yet.

    Attributes:
        at_us, ident, dlc, payload, channel: as in `Columns`; 0 where nothing is known.
        known: which rows hold a frame.
    """

    def __init__(self, count: int) -> None:
        self.at_us = np.zeros(count, np.int64)
        self.ident = np.zeros(count, np.uint32)
        self.dlc = np.zeros(count, np.uint8)
        self.payload = np.zeros(count, np.uint64)
        self.channel = np.zeros(count, np.uint8)
        self.known = np.zeros(count, np.bool_)

    @classmethod
    def of(cls, frames: list[Record], channels: ChannelNames) -> Rows:
        """Return rows of frames."""
        rows = cls(len(frames))
        for row, record in enumerate(frames):
            rows.put(row, record, channels.place(record.channel))
        return rows

    def put(self, row: int, record: Record, channel: int) -> None:
        """Write one row; NoColumnsError where a frame of CAN FD does not fit into it."""
        frame = record.frame
        if isinstance(frame, FdFrame):
            raise NoColumnsError("CAN FD")
        self.at_us[row], self.ident[row] = record.at_us, flagged_id(record)
        self.dlc[row] = len(frame.data) if isinstance(frame, ErrorFrame) else frame.dlc
        self.payload[row] = int.from_bytes(frame.data, "little")
        self.channel[row], self.known[row] = channel, True

    def columns(self, channels: ChannelNames) -> Columns:
        """Return the rows that are known as columns."""
        columns = Columns(
            self.at_us, self.ident, self.dlc, self.payload, self.channel, channels.names
        )
        return columns if self.known.all() else select(columns, np.flatnonzero(self.known))


def select(columns: Columns, rows: Ints) -> Columns:
    """Return some rows."""
    at_us, ident, dlc, payload, channel = (part[rows] for part in columns.parts)
    return Columns(at_us, ident, dlc, payload, channel, columns.channels)


def by_channel(columns: Columns) -> list[tuple[str, Ints, Columns]]:
    """Return each bus that has any frames, in the order of the names, its rows and its frames."""
    present = np.flatnonzero(np.bincount(columns.channel)).tolist()
    if len(present) == 1:
        return [(columns.channels[present[0]], np.arange(len(columns)), columns)]
    rows = {columns.channels[place]: np.flatnonzero(columns.channel == place) for place in present}
    return [(channel, rows[channel], select(columns, rows[channel])) for channel in sorted(rows)]


def split_errors(columns: Columns) -> tuple[Columns, Columns]:
    """Return the error frames, and the others."""
    errors = columns.ident & ERROR != 0
    if not errors.any():
        return select(columns, np.empty(0, np.int64)), columns
    return select(columns, np.flatnonzero(errors)), select(columns, np.flatnonzero(~errors))


def records(columns: Columns) -> list[Record]:
    """Return frames as they were heard; who sent them is not in them."""
    names = columns.channels
    rows = zip(*(part.tolist() for part in columns.parts), strict=True)
    return [Record(at_us, names[channel], _frame(*frame)) for at_us, *frame, channel in rows]


def _frame(ident: int, dlc: int, payload: int) -> CanFrame | ErrorFrame:
    data = payload.to_bytes(8, "little")
    if ident & ERROR:
        return ErrorFrame(ident & ERROR_CLASS_MASK, data)
    extended = bool(ident & EXTENDED)
    if ident & REMOTE:
        return CanFrame(ident & EXTENDED_MAX, b"", True, extended, dlc)
    return CanFrame(ident & EXTENDED_MAX, data[:dlc], False, extended)
