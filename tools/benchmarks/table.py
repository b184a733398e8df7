"""Rows of the table that tools/bench prints: medians of processor time, marked if under load."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter, process_time

RUNS = 5
BUSY = 1.15
"""Wall time over processor time from which a row counts as taken under load."""

HEAD = "| what | median | min .. max |\n|---|---|---|"
TURNS = 1_000_000


@dataclass(frozen=True, slots=True)
class Row:
    """What was measured.

    Args:
        what: the work.
        values: one of each run.
        unit: theirs, as it is printed.
        busy: wall time over processor time, median; 0 where it says nothing (a row that waits).
    """

    what: str
    values: tuple[float, ...]
    unit: str
    busy: float = 0.0

    @property
    def median(self) -> float:
        """The value in the middle."""
        return statistics.median(self.values)

    def __str__(self) -> str:
        mark = f"; under load, x {self.busy:.1f}" if self.busy > BUSY else ""
        low, high = min(self.values), max(self.values)
        return f"| {self.what} | {self.median:,.4g} {self.unit} | {low:,.4g} .. {high:,.4g}{mark} |"


rows: list[Row] = []
"""All that this run has printed."""


def row(what: str, values: Sequence[float], unit: str, busy: float = 0.0) -> None:
    """Print the median and the range of some values."""
    rows.append(Row(what, tuple(values), unit, busy))
    print(rows[-1], flush=True)


def percentiles(what: str, values: Sequence[float], unit: str) -> None:
    """Print p50, p99 and the maximum of many values."""
    ordered = sorted(values)
    p50, p99 = (ordered[int(len(ordered) * p)] for p in (0.5, 0.99))
    print(f"| {what}: p50 | {p50:,.4g} {unit} | p99 {p99:,.4g}, max {ordered[-1]:,.4g} |")


def rates(what: str, amount: float, unit: str, work: Callable[[], object]) -> None:
    """Run `work` and print how much of `amount` it does in a second of processor time."""
    taken = [seconds(work) for _ in range(RUNS)]
    busy = statistics.median(wall_s / cpu_s for cpu_s, wall_s in taken)
    row(what, [amount / cpu_s for cpu_s, _ in taken], unit, busy)


def seconds(work: Callable[[], object]) -> tuple[float, float]:
    """Run `work`; return the processor time and the wall time it took."""
    cpu_s, wall_s = process_time(), perf_counter()
    work()
    return process_time() - cpu_s, perf_counter() - wall_s


def turn_ns() -> float:
    """Return what a turn of a fixed loop takes, at best: how fast this machine is now."""

    def loop() -> None:
        total = 0
        for number in range(TURNS):
            total = (total * 31 + number) & 0xFFFF_FFFF

    return min(seconds(loop)[0] for _ in range(RUNS)) / TURNS * 1e9
