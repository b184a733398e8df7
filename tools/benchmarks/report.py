"""The page of a test run: a thousand tests of two devices, a hundred journal lines each."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from report_picture import sample

from benchmarks.table import RUNS, row
from tickrig.emulators.testing.report.bench_report import BenchReport
from tickrig.emulators.testing.report.report_file import read_run, write_report, write_run

TESTS, LINES = 1_000, 100


def run(seconds: float) -> None:
    """Print the rows of this suite."""
    del seconds
    report = large()
    with TemporaryDirectory() as folder:
        page, kept = Path(folder, "bench.html"), Path(folder, "run.json")
        measure("keep them as JSON", lambda: write_run(report, kept))
        measure("read them", lambda: read_run(kept))
        measure("write their page", lambda: write_report(report, page))
        row("their JSON", [kept.stat().st_size / 1e6], "MB")
        row("their page", [page.stat().st_size / 1e6], "MB")


def large() -> BenchReport:
    """Return a report of many tests, each with its journal, three to five signals and a fault."""
    report = sample()
    models = [replace(test, journal=(test.journal * LINES)[:LINES]) for test in report.tests]
    names = (f"tests/test_{n // 25}.py::test_{n}" for n in range(TESTS))
    tests = [replace(models[n % 3], nodeid=name) for n, name in enumerate(names)]
    return replace(report, tests=tuple(tests))


def measure(name: str, done: Callable[[], object]) -> None:
    """Measure the seconds of processor that something takes."""
    values = []
    for _ in range(RUNS):
        began = time.process_time()
        done()
        values.append(time.process_time() - began)
    row(f"{TESTS} tests with {LINES} lines each: {name}", values, "s of processor")
