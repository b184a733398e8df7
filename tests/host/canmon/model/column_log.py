"""Columns from frames, without a file."""

from __future__ import annotations

from tickrig.host.canmon.model.columns.columns import ChannelNames, Columns, Rows
from tickrig.host.canmon.model.frames import Record


def blocks(records: list[Record], size: int) -> list[Columns]:
    """Return frames in blocks of so many, as a reader of a log gives them."""
    names = ChannelNames()
    cuts = range(0, len(records), size)
    return [Rows.of(records[cut : cut + size], names).columns(names) for cut in cuts]
