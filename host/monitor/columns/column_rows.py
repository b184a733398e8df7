"""Rows of a log in columns: some of them, or one as a frame; needs numpy."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from tickrig.host.monitor.columns.columns import Columns
from tickrig.host.monitor.frames.heard import Heard
from tickrig.host.monitor.frames.ident import ERROR, EXTENDED, REMOTE
from tickrig.wire.can import EXTENDED_MAX, CanFrame
from tickrig.wire.can_error import ERROR_CLASS_MASK, ErrorFrame


def select(columns: Columns, rows: npt.NDArray[np.int64]) -> Columns:
    """Return some rows."""
    return Columns(
        columns.at_us[rows],
        columns.ident[rows],
        columns.dlc[rows],
        columns.payload[rows],
        columns.channel[rows],
        columns.channels,
    )


def by_channel(columns: Columns) -> list[tuple[str, Columns]]:
    """Return the frames of each bus that has any, in the order of their names."""
    present = np.flatnonzero(np.bincount(columns.channel)).tolist()
    if len(present) == 1:
        return [(columns.channels[present[0]], columns)]
    parts = [
        (columns.channels[place], select(columns, np.flatnonzero(columns.channel == place)))
        for place in present
    ]
    return sorted(parts, key=lambda part: part[0])


def heards(columns: Columns, rows: npt.NDArray[np.int64]) -> list[Heard]:
    """Return rows as they were heard; who sent them is not in them."""
    names = columns.channels
    parts = zip(
        columns.at_us[rows].tolist(),
        columns.channel[rows].tolist(),
        columns.ident[rows].tolist(),
        columns.dlc[rows].tolist(),
        columns.payload[rows].tolist(),
        strict=True,
    )
    return [Heard(at_us, names[channel], _frame(*frame)) for at_us, channel, *frame in parts]


def frames_of(columns: Columns, rows: npt.NDArray[np.int64]) -> list[CanFrame | ErrorFrame]:
    """Return the frames of rows."""
    return [heard.frame for heard in heards(columns, rows)]


def _frame(ident: int, dlc: int, payload: int) -> CanFrame | ErrorFrame:
    data = payload.to_bytes(8, "little")
    if ident & ERROR:
        return ErrorFrame(ident & ERROR_CLASS_MASK, data)
    extended = bool(ident & EXTENDED)
    if ident & REMOTE:
        return CanFrame(ident & EXTENDED_MAX, b"", True, extended, dlc)
    return CanFrame(ident & EXTENDED_MAX, data[:dlc], False, extended)
