"""Rows of a log in columns: some of them, or one as a frame; needs numpy."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from tickrig.host.monitor.heard import Heard
from tickrig.host.monitor.ident import ERROR, EXTENDED, REMOTE
from tickrig.host.monitor.logs.columns import Columns
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


def heard_at(columns: Columns, row: int) -> Heard:
    """Return a row as it was heard; who sent it is not in it."""
    name = columns.channels[columns.channel[row]]
    return Heard(int(columns.at_us[row]), name, frame_at(columns, row))


def frame_at(columns: Columns, row: int) -> CanFrame | ErrorFrame:
    """Return the frame of a row."""
    ident, dlc = int(columns.ident[row]), int(columns.dlc[row])
    data = int(columns.payload[row]).to_bytes(8, "little")
    if ident & ERROR:
        return ErrorFrame(ident & ERROR_CLASS_MASK, data)
    extended = bool(ident & EXTENDED)
    if ident & REMOTE:
        return CanFrame(ident & EXTENDED_MAX, b"", True, extended, dlc)
    return CanFrame(ident & EXTENDED_MAX, data[:dlc], False, extended)
