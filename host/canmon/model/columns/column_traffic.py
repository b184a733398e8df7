"""Statistics and nodes of logs in blocks, as `Traffic` and `NodeBoard` have them; needs numpy."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from tickrig.host.canmon.model import traffic
from tickrig.host.canmon.model.columns.column_bits import column_bits
from tickrig.host.canmon.model.columns.column_gaps import ColumnGaps
from tickrig.host.canmon.model.columns.columns import (
    ColumnLoad,
    Columns,
    Identifiers,
    Ints,
    Runs,
    by_channel,
    grown,
    records,
    split_errors,
)
from tickrig.host.canmon.model.frames import Record
from tickrig.wire.can import CanFrame, ErrorFrame

# How often each payload bit changes, block after block, as in `BitMemory`; needs numpy.

_Payloads = npt.NDArray[np.uint64]

_BYTES: Final = 8
_ADDED: Final = 255
"""So many bits are added up in a byte."""

_SPREAD: Final = (
    np.unpackbits(np.arange(256, dtype=np.uint8)[:, np.newaxis], axis=1, bitorder="little")
    .view("<u8")[:, 0]
    .astype(np.uint64)
)
"""The bits of each byte, a byte of a word each."""


class _ColumnChanges:
    """Counts the changes of each bit of each identifier of a bus.

    A payload that is shorter than the one before counts as filled up with zeros.

    Attributes:
        payload: the latest of each.
    """

    def __init__(self) -> None:
        self.payload, self._latest = np.empty(0, np.uint64), np.empty(0, np.uint64)
        self._counts = np.empty((0, traffic.PAYLOAD_BITS), np.int64)

    def take(self, runs: Runs, payload: _Payloads, count: int) -> None:
        """Compare the payloads of a block; there are `count` identifiers now."""
        self.payload, self._latest = grown(self.payload, count), grown(self._latest, count)
        self._counts = grown(self._counts, count)
        ordered = payload[runs.order]
        changes = ordered ^ np.roll(ordered, 1)
        across = ordered[runs.begins] ^ self.payload[runs.numbers]
        changes[runs.begins] = np.where(runs.fresh, np.uint64(0), across)
        self.payload[runs.numbers] = ordered[runs.ends - 1]
        self._latest[runs.numbers] = changes[runs.ends - 1]
        self._add(runs, changes)

    def rows(self) -> list[traffic.BitRow]:
        """Return what changed in each identifier."""
        planes, latest = _planes(self._counts), self._latest.tolist()
        return [traffic.BitRow(*row) for row in zip(latest, planes, strict=True)]

    def _add(self, runs: Runs, changes: _Payloads) -> None:
        """Add up each byte's bits side by side: as many rows at once as a byte can count."""
        begins, pieces = _pieces(runs)
        octets = changes.astype("<u8").view(np.uint8).reshape(-1, _BYTES)
        for place in range(_BYTES):
            column = octets[:, place]
            if column.any():
                words = np.add.reduceat(_SPREAD[column], begins)
                counts = words.astype("<u8").view(np.uint8).reshape(-1, 8).astype(np.int64)
                bits = slice(8 * place, 8 * place + 8)
                self._counts[runs.numbers, bits] += np.add.reduceat(counts, pieces, axis=0)


def _pieces(runs: Runs) -> tuple[Ints, Ints]:
    """Cut runs; return where each piece begins, and the first piece of each run."""
    counts = -(-runs.lengths // _ADDED)
    firsts = np.cumsum(counts) - counts
    nth = np.arange(int(counts.sum())) - np.repeat(firsts, counts)
    return np.repeat(runs.begins, counts) + nth * _ADDED, firsts


def _planes(counts: Ints) -> list[tuple[int, ...]]:
    most = [int(row).bit_length() for row in counts.max(axis=1)]
    stacked = [
        np.packbits((counts >> place & 1).astype(np.uint8), axis=1, bitorder="little")
        .view("<u8")[:, 0]
        .tolist()
        for place in range(max(most, default=0))
    ]
    return [tuple(plane[run] for plane in stacked[:depth]) for run, depth in enumerate(most)]


# Statistics of logs in blocks, the same as `Traffic` finds frame by frame; needs numpy.


class ColumnTraffic:
    """Counts all frames of all buses; what it keeps grows with identifiers, not with frames."""

    def __init__(self) -> None:
        self._buses: dict[str, _ColumnBus] = {}
        self._last_us = 0

    def take(self, columns: Columns) -> None:
        """Count a block of frames, in the order of the log."""
        for channel, _, frames in by_channel(columns):
            if channel not in self._buses:
                self._buses[channel] = _ColumnBus(channel, int(frames.at_us[0]))
            self._buses[channel].take(frames)
            self._last_us = int(columns.at_us[-1])

    def snapshot(self) -> traffic.TrafficSnapshot:
        """Return all rows, at the time of the latest frame."""
        buses = [self._buses[channel] for channel in sorted(self._buses)]
        rows = tuple(row for bus in buses for row in bus.id_rows())
        return traffic.TrafficSnapshot(
            self._last_us, tuple(bus.row(self._last_us) for bus in buses), rows
        )


class _ColumnBus:
    """Counts one bus.

    Args:
        channel: its name.
        first_us: when the first frame came, or error frame.
    """

    def __init__(self, channel: str, first_us: int) -> None:
        self._channel, self._first_us, self._last_us = channel, first_us, first_us
        self._frames = self._went_back = 0
        self._load, self._errors = ColumnLoad(first_us), traffic.ErrorStatistics()
        self._idents, self._gaps, self._changes = Identifiers(), ColumnGaps(), _ColumnChanges()
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

    def row(self, now_us: int) -> traffic.BusRow:
        """Return what the bus did."""
        return traffic.BusRow(
            self._channel,
            self._frames,
            self._first_us,
            self._last_us,
            self._load.load.row(now_us),
            self._errors.row(),
            self._went_back,
        )

    def id_rows(self) -> list[traffic.IdRow]:
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
        channel, sent = np.zeros(len(idents), np.uint8), np.zeros(len(idents), np.bool_)
        ident, payload = idents.idents.astype(np.uint32), self._changes.payload
        return Columns(idents.last_us, ident, self._dlc, payload, sent, channel, (self._channel,))


def _id_row(  # noqa: PLR0913, PLR0917 - a value of each column
    channel: str,
    ident: int,
    first_us: int,
    latest: Record,
    gap_us: int,
    gaps: traffic.Gaps,
    bits: int,
    changed: traffic.BitRow,
) -> traffic.IdRow:
    frame = latest.frame
    assert isinstance(frame, CanFrame)
    known_us = gap_us if gaps.count else None
    times = (gaps.count + 1, first_us, latest.at_us)
    return traffic.IdRow(channel, ident, *times, frame, known_us, gaps.row(), bits, changed)
