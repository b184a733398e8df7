"""Curves as a table of comma-separated values (RFC 4180): all samples, none left out."""

from __future__ import annotations

import csv
import heapq
from collections.abc import Iterator, Sequence
from itertools import groupby
from operator import itemgetter
from typing import TextIO

from tickrig.host.monitor.graph.series import Series, View


def write_csv(file: TextIO, series: Sequence[Series], view: View) -> None:
    """Write the samples in a view: a row for each time, a column for each series.

    A cell is empty where a series has no sample at that time; where it has several, the last
    counts. Times are seconds with six digits, as in the log.
    """
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(["t_s", *(_heading(one) for one in series)])
    samples = heapq.merge(*(_samples(number, one, view) for number, one in enumerate(series)))
    for at_us, group in groupby(samples, key=itemgetter(0)):
        cells: list[str | float] = [""] * len(series)
        for _, number, _, value in group:
            cells[number] = int(value) if value.is_integer() else value
        writer.writerow([f"{at_us // 1_000_000}.{at_us % 1_000_000:06d}", *cells])


def _heading(series: Series) -> str:
    return f"{series.label} [{series.unit}]" if series.unit else series.label


def _samples(number: int, series: Series, view: View) -> Iterator[tuple[int, int, int, float]]:
    """Yield time, which series, which sample, value; in this order they are sorted."""
    seen = series.between(view.from_us, view.to_us)
    for index in range(seen.start, seen.stop):
        yield series.at_us[index], number, index, series.values[index]
