"""The work of `tools/fuzz`: make mutated files of a kind, and judge each of them.

It prints its progress each minute, and the result when you interrupt it. A seed gives the same
files, however many processes share them.
"""

from __future__ import annotations

import argparse
import importlib
import signal
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable
from multiprocessing import Pool
from pathlib import Path
from random import Random
from typing import Final, NamedTuple

Make = Callable[[Random], tuple[str, bytes]]
"""Returns the name and the bytes of a file with chance in it."""
Judge = Callable[[str, bytes], str]
"""Says in a word what a file is; raises if it is not as it should be."""

KINDS: Final = {
    "bus": "tests.host.canopen.bus_file.mutations",
    "check": "tests.host.canmon.model.check.mutations",
    "conform": "tests.host.canopen.conform.fuzzing",
    "diagnosis": "tests.host.canmon.model.check.log_mutations",
    "eds": "tests.host.canopen.data_sheet.mutations",
    "logs": "tests.host.canmon.model.logs.mutations",
    "net": "tests.host.canmon.net.net_mutations",
    "report": "tests.host.canmon.output.mutations",
    "rig-files": "tests.emulators.testing.rig_file.mutations",
    "rrc": "tests.emulators.rrc.fuzzing",
}
"""The module of each kind: its docstring, `mutated` and `judge`."""

BATCH: Final = 100
"""Files that a process takes at a time."""
TOLD_EACH_S: Final = 60.0


class Batch(NamedTuple):
    """What came of some files: how they were judged, and the one that was not as it should be."""

    seen: Counter[str]
    slowest_s: float
    fault: str = ""


class Work(NamedTuple):
    """Files of a seed from `first` to before `end`, and what is done with them."""

    make: Make
    judge: Judge
    seed: int
    first: int
    end: int


def judge_batch(work: Work) -> Batch:
    """Judge files until the first fault; its file is kept."""
    seen: Counter[str] = Counter()
    slowest_s = 0.0
    for number in range(work.first, work.end):
        name, data = work.make(Random(f"{work.seed} {number}"))
        started = time.process_time()
        try:
            seen[work.judge(name, data)] += 1
        except Exception:  # what is looked for
            kept = f"mutated-{number}-{Path(name).name}"
            Path(kept).write_bytes(data)
            said = f"{traceback.format_exc()}file {number} of seed {work.seed}, in {kept}"
            return Batch(seen, slowest_s, said)
        slowest_s = max(slowest_s, time.process_time() - started)
    return Batch(seen, slowest_s)


def _ignore_interrupts() -> None:
    """Leave Ctrl-C to the process that shares out the files."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


class Tally:
    """All batches so far."""

    def __init__(self, seed: int) -> None:
        self._seed, self._seen, self._slowest_s = seed, Counter[str](), 0.0
        self._begun = self._told = time.perf_counter()

    def add(self, batch: Batch) -> None:
        """Take a batch; say each minute how far it is."""
        self._seen += batch.seen
        self._slowest_s = max(self._slowest_s, batch.slowest_s)
        if time.perf_counter() - self._told >= TOLD_EACH_S:
            self._told = time.perf_counter()
            print(self, file=sys.stderr, flush=True)

    def __str__(self) -> str:
        """Say what was judged, in one line."""
        took_s = time.perf_counter() - self._begun
        files = self._seen.total()
        return (
            f"seed {self._seed}: {files} files, {dict(sorted(self._seen.items()))}; {took_s:.0f} s,"
            f" {took_s / max(files, 1) * 1e3:.1f} ms a file,"
            f" the slowest {self._slowest_s * 1e3:.0f} ms of CPU"
        )


def main(words: list[str] | None = None) -> int:
    """Judge mutated files until there are enough or one has a fault, or judge the given files."""
    options = _parser().parse_args(words)
    module = importlib.import_module(KINDS[options.kind])
    for path in options.paths:
        print(f"{path}: {module.judge(path.name, path.read_bytes())}")
    return 0 if options.paths else _search(module.mutated, module.judge, options)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("paths", metavar="FILE", nargs="*", type=Path, help="judge only these")
    parser.add_argument("--files", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-j", "--jobs", type=int, default=1, help="processes  [1]")
    return parser


def _search(make: Make, judge: Judge, options: argparse.Namespace) -> int:
    """Judge files until there are enough, or one has a fault.

    Args:
        make: of a module that other processes can import.
        judge: likewise.
        options: of the command line.
    """
    tally = Tally(options.seed)
    batches = (
        Work(make, judge, options.seed, first, min(first + BATCH, options.files))
        for first in range(0, options.files, BATCH)
    )
    fault = ""
    with Pool(max(options.jobs, 1), _ignore_interrupts) as pool:
        try:
            for batch in pool.imap_unordered(judge_batch, batches):
                tally.add(batch)
                if fault := batch.fault:
                    print(fault)
                    break
        except KeyboardInterrupt:
            pass
    print(tally)
    return int(bool(fault))
