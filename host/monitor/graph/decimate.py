"""Bring many samples into few columns so that no spike vanishes."""

from __future__ import annotations

from bisect import bisect_left
from typing import NamedTuple

from tickrig.host.monitor.graph.series import Series


class Bar(NamedTuple):
    """The samples of one column.

    Attributes:
        first: the earliest value, which a line comes from the left to,
        low: the least,
        high: the greatest,
        last: the latest, which a line leaves from.
    """

    first: float
    low: float
    high: float
    last: float


def decimate(series: Series, from_us: int, to_us: int, columns: int) -> list[Bar | None]:
    """Return what lies in each of so many columns of equal time; None where nothing does.

    Args:
        series: the samples.
        from_us: where the first column begins.
        to_us: the last time of the last column.
        columns: how many, at least 1.
    """
    at_us, values = series.at_us, series.values
    span_us = max(1, to_us + 1 - from_us)
    begin = bisect_left(at_us, from_us)
    bars: list[Bar | None] = []
    for column in range(1, columns + 1):
        end = bisect_left(at_us, from_us - (-span_us * column // columns), begin)
        piece = values[begin:end]
        bars.append(Bar(piece[0], min(piece), max(piece), piece[-1]) if piece else None)
        begin = end
    return bars
