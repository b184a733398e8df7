"""Whole runs of the conformance tester at R1: intrusive, all checks and all objects."""

from __future__ import annotations

import statistics
from collections.abc import Callable
from pathlib import Path
from typing import Final

from benchmarks import table
from tickrig import Bench
from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.canopen.build import describe
from tickrig.emulators.canopen.eds import EdsCache
from tickrig.testing import conformance

EDS: Final = Path(__file__).parents[2] / "tests" / "golden" / "canopen" / "r1.eds"
NODE_ID: Final = 5


def run(seconds: float) -> None:
    """Print the seconds of processor that a run takes."""
    del seconds
    measure("a slave in a script", by_script)
    measure("a device of a bench", on_bench)


def measure(where: str, judge: Callable[[], int]) -> None:
    """Measure one kind of run."""
    checks = judge()
    taken = [table.seconds(judge) for _ in range(table.RUNS)]
    busy = statistics.median(wall_s / cpu_s for cpu_s, wall_s in taken)
    cpus = [cpu_s for cpu_s, _ in taken]
    table.row(f"conformance of R1, {checks} checks, {where}", cpus, "s of processor", busy)


def by_script() -> int:
    """Judge a slave of ours; return how many checks were made."""
    described = describe(EdsCache(), EDS)
    slave = make_slave(described.make_dictionary(), NODE_ID, application=described.application)
    return len(conformance(slave, eds=EDS).results)


def on_bench() -> int:
    """Judge a device of a bench, which keeps its journal and its trace meanwhile."""
    with Bench(f"{NODE_ID}={EDS}") as bench:
        return len(conformance(bench, eds=EDS).results)
