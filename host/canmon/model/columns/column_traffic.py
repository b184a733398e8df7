"""Statistics of logs in blocks, the same as `Traffic` finds frame by frame; needs numpy."""

from __future__ import annotations

import numpy as np

from tickrig.host.canmon.model.columns.column_bits import column_bits
from tickrig.host.canmon.model.columns.column_changes import ColumnChanges
from tickrig.host.canmon.model.columns.column_gaps import ColumnGaps
from tickrig.host.canmon.model.columns.column_load import ColumnLoad
from tickrig.host.canmon.model.columns.columns import Columns, by_channel, records, split_errors
from tickrig.host.canmon.model.columns.runs import Identifiers, grown
from tickrig.host.canmon.model.frames.record import Record
from tickrig.host.canmon.model.traffic.controller import ErrorStatistics
from tickrig.host.canmon.model.traffic.gaps import Gaps
from tickrig.host.canmon.model.traffic.tally import BitRow, IdRow
from tickrig.host.canmon.model.traffic.traffic import BusRow, Snapshot
from tickrig.wire.can import CanFrame
from tickrig.wire.can_error import ErrorFrame


class ColumnTraffic:
    """Counts all frames of all buses; what it keeps grows with identifiers, not with frames."""

    def __init__(self) -> None:
        self._buses: dict[str, ColumnBus] = {}
        self._last_us = 0

    def take(self, columns: Columns) -> None:
        """Count a block of frames, in the order of the log."""
        for channel, _, frames in by_channel(columns):
            if channel not in self._buses:
                self._buses[channel] = ColumnBus(channel, int(frames.at_us[0]))
            self._buses[channel].take(frames)
            self._last_us = int(columns.at_us[-1])

    def snapshot(self) -> Snapshot:
        """Return all rows, at the time of the latest frame."""
        buses = [self._buses[channel] for channel in sorted(self._buses)]
        rows = tuple(row for bus in buses for row in bus.id_rows())
        return Snapshot(self._last_us, tuple(bus.row(self._last_us) for bus in buses), rows)


class ColumnBus:
    """Counts one bus.

    Args:
        channel: its name.
        first_us: when the first frame came, or error frame.
    """

    def __init__(self, channel: str, first_us: int) -> None:
        self._channel, self._first_us, self._last_us = channel, first_us, first_us
        self._frames = self._went_back = 0
        self._load, self._errors = ColumnLoad(first_us), ErrorStatistics()
        self._idents, self._gaps, self._changes = Identifiers(), ColumnGaps(), ColumnChanges()
        self._bits, self._dlc = np.empty(0, np.int64), np.empty(0, np.uint8)

    def take(self, frames: Columns) -> None:
        """Count frames, one at least."""
        self._went_back += int(np.count_nonzero(np.diff(frames.at_us, prepend=self._last_us) < 0))
        self._last_us = int(frames.at_us[-1])
        errors, frames = split_errors(frames)
        for record in records(errors):
            assert isinstance(record.frame, ErrorFrame)
            self._errors.take(record.frame)
        if len(frames):
            self._take_frames(frames)

    def _take_frames(self, frames: Columns) -> None:
        self._frames += len(frames)
        bits = column_bits(frames.ident, frames.dlc, frames.payload)
        self._load.take(frames.at_us, bits)
        runs = self._idents.take(frames.ident, frames.at_us)
        count = len(self._idents)
        self._gaps.take(runs, count)
        self._changes.take(runs, frames.payload, count)
        self._bits, self._dlc = grown(self._bits, count), grown(self._dlc, count)
        self._bits[runs.numbers] += runs.sums(bits[runs.order])
        self._dlc[runs.numbers] = frames.dlc[runs.order[runs.ends - 1]]

    def row(self, now_us: int) -> BusRow:
        """Return what the bus did."""
        return BusRow(
            self._channel,
            self._frames,
            self._first_us,
            self._last_us,
            self._load.load.row(now_us),
            self._errors.row(),
            self._went_back,
        )

    def id_rows(self) -> list[IdRow]:
        """Return what its identifiers did, in their order."""
        values = zip(
            self._idents.idents.tolist(),
            self._idents.first_us.tolist(),
            records(self._latest()),
            self._gaps.latest_us.tolist(),
            self._gaps.rows(),
            self._bits.tolist(),
            self._changes.rows(),
            strict=True,
        )
        return sorted(_id_row(self._channel, *row) for row in values)

    def _latest(self) -> Columns:
        """Return the latest frame of each identifier."""
        idents = self._idents
        channel = np.zeros(len(idents), np.uint8)
        ident, payload = idents.idents.astype(np.uint32), self._changes.payload
        return Columns(idents.last_us, ident, self._dlc, payload, channel, (self._channel,))


def _id_row(  # noqa: PLR0913, PLR0917 - a value of each column
    channel: str,
    ident: int,
    first_us: int,
    latest: Record,
    gap_us: int,
    gaps: Gaps,
    bits: int,
    changed: BitRow,
) -> IdRow:
    frame = latest.frame
    assert isinstance(frame, CanFrame)
    known_us = gap_us if gaps.count else None
    times = (gaps.count + 1, first_us, latest.at_us)
    return IdRow(channel, ident, *times, frame, known_us, gaps.row(), bits, changed)
