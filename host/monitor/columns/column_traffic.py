"""Statistics of a whole log at once, the same as `Traffic` finds frame by frame; needs numpy."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from tickrig.host.monitor.columns.column_bits import column_bits
from tickrig.host.monitor.columns.columns import (
    Columns,
    Ints,
    Runs,
    by_channel,
    frames_of,
    records,
    select,
)
from tickrig.host.monitor.frames.ident import ERROR
from tickrig.host.monitor.frames.record import Record
from tickrig.host.monitor.traffic.controller import ErrorStatistics
from tickrig.host.monitor.traffic.gaps import EXACT_US, SUB_BITS, Gaps
from tickrig.host.monitor.traffic.tally import BitRow, IdRow
from tickrig.host.monitor.traffic.traffic import WINDOW_US, BusRow, Load, Snapshot, Window
from tickrig.wire.can import CanFrame
from tickrig.wire.can_error import ErrorFrame

BYTES: Final = 8
_BITS: Final = np.unpackbits(
    np.arange(256, dtype=np.uint8)[:, np.newaxis], axis=1, bitorder="little"
).astype(np.int64)
"""The bits of each byte."""


def column_changes(runs: Runs, payload: npt.NDArray[np.uint64]) -> list[BitRow]:
    """Return what changed in each run.

    Args:
        runs: frames by identifier.
        payload: of each row of the log.
    """
    ordered = payload[runs.order]
    changes = ordered ^ np.roll(ordered, 1)
    changes[runs.begins] = 0
    planes = _planes(_counts(runs, changes))
    latest = changes[runs.ends - 1].tolist()
    return [BitRow(one, planes[run]) for run, one in enumerate(latest)]


def _counts(runs: Runs, changes: npt.NDArray[np.uint64]) -> Ints:
    """Return how often each bit changed in each run: count the values of each byte first."""
    counts = np.zeros((len(runs.begins), 8 * BYTES), np.int64)
    run = np.repeat(np.arange(len(runs.begins)) << 8, runs.ends - runs.begins)
    octets = changes.astype("<u8").view(np.uint8).reshape(-1, BYTES)
    for place in range(BYTES):
        column = octets[:, place]
        if column.any():
            values = np.bincount(run + column, minlength=counts.shape[0] << 8)
            counts[:, 8 * place : 8 * place + 8] = values.reshape(-1, 256) @ _BITS
    return counts


def _planes(counts: Ints) -> list[tuple[int, ...]]:
    most = [int(row).bit_length() for row in counts.max(axis=1)]
    stacked = [
        np.packbits((counts >> place & 1).astype(np.uint8), axis=1, bitorder="little")
        .view("<u8")[:, 0]
        .tolist()
        for place in range(max(most))
    ]
    return [tuple(plane[run] for plane in stacked[:depth]) for run, depth in enumerate(most)]


MANTISSA_BITS: Final = 52
EXPONENT_BIAS: Final = 1023
COARSE: Final = -1 << 12
"""Leaves as many bits of the longest times as the mantissa has."""


def column_gaps(runs: Runs, gaps_us: Ints) -> list[Gaps]:
    """Return the gaps of each run.

    Args:
        runs: frames by identifier.
        gaps_us: the gap before each row of `runs.order`.
    """
    wander_us = np.abs(np.diff(gaps_us, prepend=0))
    buckets = column_buckets(gaps_us)
    return [
        _of_run(gaps_us[begin + 1 : end], wander_us[begin + 2 : end], buckets[begin + 1 : end])
        for begin, end in zip(runs.begins.tolist(), runs.ends.tolist(), strict=True)
    ]


def _of_run(gaps_us: Ints, wander_us: Ints, buckets: npt.NDArray[np.int16]) -> Gaps:
    gaps = Gaps()
    if len(gaps_us):
        gaps.count, gaps.total_us = len(gaps_us), int(gaps_us.sum())
        gaps.min_us, gaps.max_us = int(gaps_us.min()), int(gaps_us.max())
        gaps.wander_us = int(wander_us.sum())
        lowest = int(buckets.min())
        counts = np.bincount(buckets - lowest)
        filled = np.flatnonzero(counts)
        gaps.buckets = dict(zip((filled + lowest).tolist(), counts[filled].tolist(), strict=True))
    return gaps


def column_buckets(times_us: Ints) -> npt.NDArray[np.int16]:
    """Return the bucket of each time, as `bucket_of` does.

    A bucket is the exponent and the first bits of the mantissa of a floating-point number: both
    are read off its bits. Longer times than it is exact for lose low bits first, so that none is
    rounded up.
    """
    exact = np.where(times_us >> MANTISSA_BITS, times_us & COARSE, times_us)
    bits = exact.astype(np.float64).view(np.int64) >> MANTISSA_BITS - SUB_BITS
    wide = bits - (EXPONENT_BIAS + SUB_BITS - 1 << SUB_BITS)
    return np.where(times_us < EXACT_US, times_us, wide).astype(np.int16)


def snapshot_of(columns: Columns) -> Snapshot:
    """Return what a log holds."""
    if not len(columns):
        return Snapshot()
    now_us = int(columns.at_us[-1])
    buses, rows = [], []
    for channel, frames in by_channel(columns):
        bus, of_bus = _bus(channel, frames, now_us)
        buses.append(bus)
        rows += of_bus
    return Snapshot(now_us, tuple(buses), tuple(rows))


def _bus(channel: str, frames: Columns, now_us: int) -> tuple[BusRow, list[IdRow]]:
    first_us, last_us = int(frames.at_us[0]), int(frames.at_us[-1])
    went_back = int(np.count_nonzero(np.diff(frames.at_us) < 0))
    errors, frames = _take_errors(frames)
    bits = column_bits(frames.ident, frames.dlc, frames.payload)
    load = Load(first_us)
    for window, _ in windows_of(first_us, frames.at_us, bits):
        load.take(*window)
    row = BusRow(
        channel,
        len(frames.at_us),
        first_us,
        last_us,
        load.row(now_us),
        errors.row(),
        went_back,
    )
    return row, _id_rows(channel, frames, bits)


def _take_errors(frames: Columns) -> tuple[ErrorStatistics, Columns]:
    errors = ErrorStatistics()
    is_error = frames.ident & ERROR != 0
    if not is_error.any():
        return errors, frames
    for frame in frames_of(frames, np.flatnonzero(is_error)):
        assert isinstance(frame, ErrorFrame)
        errors.take(frame)
    return errors, select(frames, np.flatnonzero(~is_error))


def windows_of(first_us: int, at_us: Ints, bits: Ints) -> list[tuple[Window, int]]:
    """Return the seconds that have frames, as `Load` opens them, each with its first row."""
    if not len(at_us):
        return []
    seconds = np.maximum.accumulate(np.maximum(at_us - first_us, 0) // WINDOW_US)
    begins = np.flatnonzero(np.diff(seconds, prepend=-1))
    sums = np.add.reduceat(bits, begins)
    starts = seconds[begins] * WINDOW_US + first_us
    windows = map(Window, starts.tolist(), sums.tolist())
    return list(zip(windows, begins.tolist(), strict=True))


def _id_rows(channel: str, frames: Columns, bits: Ints) -> list[IdRow]:
    if not len(frames.at_us):
        return []
    runs = Runs.of(frames.ident)
    gaps_us = runs.gaps_us(frames.at_us)
    columns = zip(
        runs.idents.tolist(),
        frames.at_us[runs.order[runs.begins]].tolist(),
        records(frames, runs.order[runs.ends - 1]),
        gaps_us[runs.ends - 1].tolist(),
        column_gaps(runs, gaps_us),
        runs.sums(bits[runs.order]).tolist(),
        column_changes(runs, frames.payload),
        strict=True,
    )
    return [_id_row(channel, *values) for values in columns]


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
