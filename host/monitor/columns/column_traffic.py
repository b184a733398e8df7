"""Statistics of a whole log at once, the same as `Traffic` finds frame by frame; needs numpy."""

from __future__ import annotations

import numpy as np

from tickrig.host.monitor.columns.column_bits import column_bits
from tickrig.host.monitor.columns.column_changes import column_changes
from tickrig.host.monitor.columns.column_gaps import column_gaps
from tickrig.host.monitor.columns.column_rows import by_channel, frames_of, heards, select
from tickrig.host.monitor.columns.columns import Columns
from tickrig.host.monitor.columns.runs import Ints, Runs
from tickrig.host.monitor.frames.heard import Heard
from tickrig.host.monitor.frames.ident import ERROR
from tickrig.host.monitor.traffic.bits import BitRow
from tickrig.host.monitor.traffic.controller import Controller
from tickrig.host.monitor.traffic.gaps import Gaps
from tickrig.host.monitor.traffic.load import WINDOW_US, Load, Window
from tickrig.host.monitor.traffic.tally import IdRow
from tickrig.host.monitor.traffic.traffic import BusRow, Snapshot
from tickrig.wire.can import CanFrame
from tickrig.wire.can_error import ErrorFrame


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


def _take_errors(frames: Columns) -> tuple[Controller, Columns]:
    errors = Controller()
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
        heards(frames, runs.order[runs.ends - 1]),
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
    latest: Heard,
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
