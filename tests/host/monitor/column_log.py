"""Columns from frames, without a file."""

from __future__ import annotations

from tickrig.host.monitor.columns.columns import ChannelNames, Columns, Rows, joined
from tickrig.host.monitor.frames.record import Record
from tickrig.host.monitor.logs.tally import Tally


def columns(records: list[Record]) -> Columns:
    names = ChannelNames()
    return joined([Rows.of(records, names)], names, Tally())
