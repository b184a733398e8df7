"""Statistics and nodes of logs in blocks, equal to `Traffic` and `NodeBoard`.

The module needs numpy.

The memory does not grow with the number of gaps. The module holds sums, the shortest and the
longest gap, which are exact, and the number of gaps in each bucket (see `gaps`). A quantile is
therefore at most one part in 64 too long, and exact below 128 us.

A histogram of whole microseconds would be exact only up to its longest time, and exact quantiles
would require a second pass over the log.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt

from tickrig.host.canmon.model import traffic
from tickrig.host.canmon.model.columns.columns import (
    ColumnLoad,
    Columns,
    Identifiers,
    Ints,
    Runs,
    by_channel,
    grown,
    records,
    select,
)
from tickrig.host.canmon.model.frames import ERROR, REMOTE
from tickrig.host.canmon.model.traffic import EXACT_US, SUB_BITS, Gaps
from tickrig.wire import can
from tickrig.wire.can import CanFrame, ErrorFrame

# The length of many CAN frames on the bus at once, as `frame_bits` has it; needs numpy.


_BLOCK: Final = 1 << 14
"""Number of frames that are processed at a time, so that results fit into the cache."""

_HEAD_BYTES: Final = (3, 5)
"""Number of header bytes before the data, for 11-bit and 29-bit identifiers."""

_Ints = npt.NDArray[np.int64]

_NEXT: Final = np.array(can.NEXT, np.int64)
_STUFFED: Final = np.array(can.STUFFED, np.int64)


def column_bits(
    ident: npt.NDArray[np.uint32], dlc: npt.NDArray[np.uint8], payload: npt.NDArray[np.uint64]
) -> _Ints:
    """Return how many bits each frame occupies on the bus. The bus load is calculated from them.

    Stuff bits and the interframe space are included.

    Args:
        ident: CAN-IDs with flags, as `ident_of` returns them.
        dlc: data length code of each frame, also of remote frames.
        payload: data of each frame as a little-endian number. Missing bytes are 0.
    """
    out = np.empty(len(ident), np.int64)
    for begin in range(0, len(ident), _BLOCK):
        part = slice(begin, begin + _BLOCK)
        out[part] = _block(ident[part].astype(np.int64), dlc[part].astype(np.int64), payload[part])
    return out


def _block(ident: _Ints, dlc: _Ints, payload: npt.NDArray[np.uint64]) -> _Ints:
    lengths = np.where(ident & REMOTE, 0, dlc)
    forms = (ident >> 31) * (can.MAX_DATA_BYTES + 1) + lengths
    out = np.empty(len(ident), np.int64)
    for form in np.flatnonzero(np.bincount(forms)):
        extended, length = divmod(int(form), can.MAX_DATA_BYTES + 1)
        rows = np.flatnonzero(forms == form)
        heads = _heads(ident[rows], dlc[rows], bool(extended))
        out[rows] = _same_form(heads, payload[rows], bool(extended), length)
    return out


def _heads(ident: _Ints, dlc: _Ints, extended: bool) -> _Ints:
    control = (ident & REMOTE) >> 24 | dlc
    can_id = ident & can.EXTENDED_MAX
    if extended:
        can_id = (can_id >> 18) << 20 | can.EXTENDED_FLAGS << 18 | can_id & 0x3_FFFF
    return can_id << 7 | control


def _same_form(heads: _Ints, payload: npt.NDArray[np.uint64], extended: bool, length: int) -> _Ints:
    head_bytes = _HEAD_BYTES[extended]
    columns = [heads >> 8 * place & 0xFF for place in reversed(range(head_bytes))]
    octets = payload.astype("<u8").view(np.uint8).reshape(-1, 8)
    columns += [octets[:, place].astype(np.int64) for place in range(length)]
    crc = np.zeros(len(heads), np.int64)
    for column, table in zip(columns, _crc_tables(len(columns)), strict=True):
        crc ^= table[column]
    crc |= ~crc >> 1 & 1
    return _feed([*columns, crc >> 8, crc & 0xFF], extended) + 8 * length


def _feed(columns: list[_Ints], extended: bool) -> _Ints:
    """Run the stuffing automaton over each frame."""
    state = np.full(len(columns[0]), (can.START_EXTENDED if extended else can.START_STANDARD) << 8)
    bits = np.full(len(columns[0]), can.EXTENDED_BITS if extended else can.STANDARD_BITS)
    for column in columns:
        state += column
        bits += _STUFFED[state]
        state = _NEXT[state]
    return bits


@lru_cache
def _crc_tables(length: int) -> tuple[_Ints, ...]:
    """Return a table for each byte of a stream.

    The CRC is linear, so its parts are combined by XOR.
    """
    return tuple(
        np.array([can.crc16(bytes([byte]) + bytes(behind)) for byte in range(256)], np.int64)
        for behind in reversed(range(length))
    )


# The gaps of each identifier, block after block, the same as `Gaps` counts them; needs numpy.


_MANTISSA_BITS: Final = 52
_EXPONENT_BIAS: Final = 1023
_COARSE: Final = -1 << 12
"""Mask that leaves as many bits of the longest times as the mantissa has."""

_BUCKET_BITS: Final = 12
_BUCKET_MASK: Final = (1 << _BUCKET_BITS) - 1
"""Mask of all bucket numbers."""

_MERGED: Final = 1 << 16
"""Smallest number of counts that are added up at once."""

_LONGEST_US: Final = np.iinfo(np.int64).max


class _ColumnGaps:
    """Counter of the gaps of each identifier of a bus.

    Attributes:
        latest_us: latest gap of each identifier.
    """

    def __init__(self) -> None:
        self.latest_us = self._frames = self._total_us = np.empty(0, np.int64)
        self._min_us = self._max_us = self._wander_us = self.latest_us
        self._keys, self._counts = np.empty(0, np.int64), np.empty(0, np.int64)
        self._new: list[tuple[Ints, Ints]] = []

    def take(self, runs: Runs, count: int) -> None:
        """Count the gaps of a block. `count` is the current number of identifiers."""
        self._grow(count)
        numbers, gaps_us, firsts = runs.numbers, runs.gaps_us, runs.begins[runs.fresh]
        self._total_us[numbers] += runs.sums(gaps_us)
        self._wander_us[numbers] += runs.sums(self._wander(runs))
        self._frames[numbers] += runs.lengths
        self.latest_us[numbers] = gaps_us[runs.ends - 1]
        longest = np.maximum.reduceat(gaps_us, runs.begins)
        self._max_us[numbers] = np.maximum(self._max_us[numbers], longest)
        self._count(runs, column_buckets(gaps_us))
        if len(firsts):
            self._min_us[numbers[runs.fresh]] = _LONGEST_US
            gaps_us = gaps_us.copy()
            gaps_us[firsts] = _LONGEST_US
        shortest = np.minimum.reduceat(gaps_us, runs.begins)
        self._min_us[numbers] = np.minimum(self._min_us[numbers], shortest)

    def rows(self) -> Iterator[Gaps]:
        """Yield the results for each identifier."""
        self._merge()
        yield from map(self._row, range(len(self._frames)))

    def _grow(self, count: int) -> None:
        self.latest_us, self._frames = grown(self.latest_us, count), grown(self._frames, count)
        self._total_us = grown(self._total_us, count)
        self._wander_us = grown(self._wander_us, count)
        self._min_us, self._max_us = grown(self._min_us, count), grown(self._max_us, count)

    def _wander(self, runs: Runs) -> Ints:
        """Return the difference of each gap from the previous gap, with 0 for a first gap."""
        wander_us = np.abs(np.diff(runs.gaps_us, prepend=0))
        begins, frames = runs.begins, self._frames[runs.numbers]
        across = np.abs(runs.gaps_us[begins] - self.latest_us[runs.numbers])
        wander_us[begins] = np.where(frames > 1, across, 0)
        seconds = begins[runs.fresh] + 1
        wander_us[seconds[seconds < runs.ends[runs.fresh]]] = 0
        return wander_us

    def _count(self, runs: Runs, buckets: npt.NDArray[np.int16]) -> None:
        """Count the gaps in each bucket of each identifier."""
        # 32 bits are sorted three times as fast as 64.
        places = np.repeat(
            np.arange(len(runs.numbers), dtype=np.int32) << _BUCKET_BITS, runs.lengths
        )
        places += buckets
        places = np.delete(places, runs.begins[runs.fresh])
        places.sort()
        begins = np.flatnonzero(np.diff(places, prepend=-1))
        found, counts = places[begins], np.diff(begins, append=len(places))
        keys = runs.numbers[found >> _BUCKET_BITS] << _BUCKET_BITS | found & _BUCKET_MASK
        self._new.append((keys, counts))
        if sum(len(new) for new, _ in self._new) > max(_MERGED, len(self._keys)):
            self._merge()

    def _merge(self) -> None:
        """Add up new counts. The sums are made rarely, so that many buckets cost little time."""
        keys = np.concatenate([self._keys, *(new for new, _ in self._new)])
        counts = np.concatenate([self._counts, *(new for _, new in self._new)])
        order = np.argsort(keys, kind="stable")  # it merges what is sorted already
        keys, counts = keys[order], counts[order]
        begins = np.flatnonzero(np.diff(keys, prepend=-1))
        self._keys, self._new = keys[begins], []
        self._counts = np.add.reduceat(counts, begins) if len(begins) else counts

    def _row(self, number: int) -> Gaps:
        gaps = Gaps()
        gaps.count = int(self._frames[number]) - 1
        if gaps.count:
            gaps.total_us = int(self._total_us[number])
            gaps.wander_us = int(self._wander_us[number])
            gaps.min_us, gaps.max_us = int(self._min_us[number]), int(self._max_us[number])
            first = number << _BUCKET_BITS
            begin, end = np.searchsorted(self._keys, (first, first + (1 << _BUCKET_BITS)))
            buckets = (self._keys[begin:end] - first).tolist()
            gaps.buckets = dict(zip(buckets, self._counts[begin:end].tolist(), strict=True))
        return gaps


def column_buckets(times_us: Ints) -> npt.NDArray[np.int16]:
    """Return the histogram bucket numbers of several times, as `bucket_of` does for one time.

    Args:
        times_us: times in microseconds.
    """
    # The exponent and the first mantissa bits of a float are its bucket. A time that is too long
    # for an exact float is rounded down first, so that it does not fall into the next bucket.
    exact = np.where(times_us >> _MANTISSA_BITS, times_us & _COARSE, times_us)
    bits = exact.astype(np.float64).view(np.int64) >> _MANTISSA_BITS - SUB_BITS
    wide = bits - (_EXPONENT_BIAS + SUB_BITS - 1 << SUB_BITS)
    return np.where(times_us < EXACT_US, times_us, wide).astype(np.int16)


# Change counts of payload bits, block after block, as in `BitMemory`; needs numpy.

_Payloads = npt.NDArray[np.uint64]

_BYTES: Final = 8
_ADDED: Final = 255
"""Number of bits that can be added up in a byte."""

_SPREAD: Final = (
    np.unpackbits(np.arange(256, dtype=np.uint8)[:, np.newaxis], axis=1, bitorder="little")
    .view("<u8")[:, 0]
    .astype(np.uint64)
)
"""The bits of each byte value, with one bit in each byte of a word."""


class _ColumnChanges:
    """Counter of the changes of each payload bit of each identifier of a bus.

    A payload that is shorter than the previous one is padded with zeros.

    Attributes:
        payload: the latest payload of each identifier.
    """

    def __init__(self) -> None:
        self.payload, self._latest = np.empty(0, np.uint64), np.empty(0, np.uint64)
        self._counts = np.empty((0, traffic.PAYLOAD_BITS), np.int64)

    def take(self, runs: Runs, payload: _Payloads, count: int) -> None:
        """Compare the payloads of a block. `count` is the current number of identifiers."""
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
        """Return the changed bits of each identifier."""
        planes, latest = _planes(self._counts), self._latest.tolist()
        return [traffic.BitRow(*row) for row in zip(latest, planes, strict=True)]

    def _add(self, runs: Runs, changes: _Payloads) -> None:
        """Add up the bits of each byte side by side, for as many rows as a byte can count."""
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
    """Split runs into pieces. Return the start of each piece, and the first piece of each run."""
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
    """Traffic statistics for all buses of a log, calculated from blocks of frames with numpy.

    The memory grows with the number of CAN-IDs, not with the number of frames.
    """

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
    """Counter of one bus.

    Args:
        channel: name of the bus.
        first_us: time of the first frame or error frame.
    """

    def __init__(self, channel: str, first_us: int) -> None:
        self._channel, self._first_us, self._last_us = channel, first_us, first_us
        self._frames = self._went_back = 0
        self._load, self._errors = ColumnLoad(first_us), traffic.ErrorStatistics()
        self._idents, self._gaps, self._changes = Identifiers(), _ColumnGaps(), _ColumnChanges()
        self._bits, self._dlc = np.empty(0, np.int64), np.empty(0, np.uint8)

    def take(self, frames: Columns) -> None:
        """Count frames. There is at least one frame."""
        self._went_back += int(np.count_nonzero(np.diff(frames.at_us, prepend=self._last_us) < 0))
        self._last_us = int(frames.at_us[-1])
        errors = frames.ident & ERROR != 0
        if errors.any():
            for record in records(select(frames, np.flatnonzero(errors))):
                assert isinstance(record.frame, ErrorFrame)
                self._errors.take(record.frame)
            frames = select(frames, np.flatnonzero(~errors))
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
        """Return the statistics of the bus."""
        return traffic.BusRow(
            self._channel,
            self._frames,
            self._first_us,
            self._last_us,
            self._load.load.row(now_us, self._last_us, ended=True),
            self._errors.row(),
            self._went_back,
        )

    def id_rows(self) -> list[traffic.IdRow]:
        """Return the statistics of the identifiers in their order."""
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
        rows, channel = list[traffic.IdRow](), self._channel
        for ident, first_us, latest, gap_us, gaps, bits, changed in values:
            frame, known_us = latest.frame, gap_us if gaps.count else None
            assert isinstance(frame, CanFrame)
            times = gaps.count + 1, first_us, latest.at_us
            row = traffic.IdRow(channel, ident, *times, frame, known_us, gaps.row(), bits, changed)
            rows.append(row)
        return sorted(rows)

    def _latest(self) -> Columns:
        """Return the latest frame of each identifier."""
        idents = self._idents
        channel, sent = np.zeros(len(idents), np.uint8), np.zeros(len(idents), np.bool_)
        ident, payload = idents.idents.astype(np.uint32), self._changes.payload
        return Columns(idents.last_us, ident, self._dlc, payload, sent, channel, (self._channel,))
