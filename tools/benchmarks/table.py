"""Rows of the table that tools/bench prints."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence

RUNS = 5


def row(what: str, values: Sequence[float], unit: str) -> None:
    """Print the median and the range of some values."""
    median, low, high = statistics.median(values), min(values), max(values)
    print(f"| {what} | {median:,.4g} {unit} | {low:,.4g} .. {high:,.4g} |", flush=True)


def percentiles(what: str, values: Sequence[float], unit: str) -> None:
    """Print p50, p99 and the maximum of many values."""
    ordered = sorted(values)
    p50, p99 = (ordered[int(len(ordered) * p)] for p in (0.5, 0.99))
    print(f"| {what}: p50 | {p50:,.4g} {unit} | p99 {p99:,.4g}, max {ordered[-1]:,.4g} |")


def rates(what: str, amount: float, unit: str, work: Callable[[], None]) -> None:
    """Run `work` and print how much of `amount` it does in a second."""
    values = []
    for _ in range(RUNS):
        start = time.perf_counter()
        work()
        values.append(amount / (time.perf_counter() - start))
    row(what, values, unit)
