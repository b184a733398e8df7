"""The commands `tickrig campaign run` and `merge`: from the options to the table."""

from __future__ import annotations

import io
import os
import shlex
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import closing, contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any, Final, NoReturn, Protocol

import click
from click._termui_impl import ProgressBar

from tickrig._lazy import LazyModule
from tickrig.emulators.testing.campaign.crew import Crew, LocalWorkers
from tickrig.emulators.testing.campaign.journal import CampaignJournal, JournalFullError
from tickrig.emulators.testing.campaign.order import CampaignOrder, CampaignRefusal, Run, RunVerdict
from tickrig.emulators.testing.campaign.plan import CampaignPlan, Seeds, Shard
from tickrig.emulators.testing.campaign.table import (
    PARQUET,
    WELL,
    CampaignTable,
    merge_tables,
    missing_seeds,
    read_table,
    summary,
    table_of,
    write_table,
)
from tickrig.host.cli.messages import Refused, say
from tickrig.host.cli.options import VERSION
from tickrig.host.cli.start import INTERRUPTED, UNWRITTEN, as_is
from tickrig.host.text.names import known
from tickrig.host.text.values import counted
from tickrig.host.text.whole_file import check_file

if TYPE_CHECKING:
    from tickrig.emulators.testing.campaign import dask_workers
else:
    dask_workers = LazyModule("tickrig.emulators.testing.campaign.dask_workers")  # an extra

# Theory of operation
# ===================
#
# A campaign is a list of runs (test x seed), each with a number. Only the journal records what was
# done: after a kill at any time, the next start reads it, skips what it contains, and continues.
# This gives the rules:
#
# - A verdict counts when it is on the disk (`CampaignJournal.add` syncs), not when it arrives. The
#   progress bar and the table use only what `add` returned.
# - A verdict depends on test and seed alone. The worker, the number of repetitions and the order of
#   runs do not matter. A run that was done twice is written once.
# - The head of the journal (`CampaignPlan.head`) has everything that a verdict depends on: tests,
#   seeds, shard, rig file, version, and a digest of the files of the tests. A journal with another
#   head is refused, so that a table never has results of two programs.
# - Workers only answer. If a worker dies, its run is tried three times, then it is `died`. If a
#   worker hangs, it is killed, and its run is `hung`. crew.py waits for each verdict with a
#   time-out, so that a batch always ends.
#
# Batches. A run takes a millisecond or a minute, which is unknown before. A batch grows while it
# takes less than a second, and shrinks if it takes more than four. Its time in the queue is
# included. Towards the end batches get smaller, so that all workers end together. Each worker has
# two batches: one runs, one waits.
#
# A campaign can end in three ways. The table is written before the journal is removed.
#
# - All runs are done: the table is written, and the journal is removed.
# - Interrupted, or the disk is full: the journal is kept, and the command to continue is printed.
# - Refused: no run was started.

# A running campaign: runs are submitted, and verdicts returned, until all are done.

_BATCH_S: Final = 1.0
"""Target duration of a batch: a kill loses a whole batch, and each batch costs time."""

_MOST: Final = 500
"""Limits of the number of runs in a batch."""


class _Workers(Protocol):
    """Workers on this machine or on a cluster."""

    @property
    def count(self) -> int:
        """Number of parallel runs."""
        ...

    def submit(self, runs: Sequence[Run]) -> Future[list[RunVerdict]]:
        """Submit runs; the returned future may raise CampaignRefusal."""
        ...

    def close(self) -> None:
        """Stop all workers."""
        ...


class Campaign:
    """A campaign in progress: gives the remaining runs to workers, and stores their verdicts.

    Args:
        plan: all runs.
        journal: file that stores the verdicts. The runs in the file are not repeated.
        workers: processes or cluster that execute the runs.
    """

    def __init__(self, plan: CampaignPlan, journal: CampaignJournal, workers: _Workers) -> None:
        self._plan, self._journal, self._workers = plan, journal, workers
        done = journal.verdicts
        self._left = (number for number in plan.numbers() if number not in done)
        self._count = plan.size() - len(done)
        self._under_way: dict[Future[list[RunVerdict]], float] = {}
        self._size = 1

    def verdicts(self) -> Iterator[list[RunVerdict]]:
        """Execute all remaining runs; yield their verdicts as soon as they are stored on disk.

        Raises:
            CampaignRefusal: the workers cannot continue.
            JournalFullError: the journal cannot be written.
        """
        while self._submit():
            done, _ = wait(self._under_way, return_when=FIRST_COMPLETED)
            for future in done:
                verdicts, begun_s = future.result(), self._under_way.pop(future)
                self._count -= len(verdicts)
                self._learn(monotonic() - begun_s)
                yield self._journal.add(verdicts)

    def _submit(self) -> bool:
        """Keep all workers busy, with a batch in reserve for each; return False after the last."""
        workers = self._workers.count
        while len(self._under_way) < 2 * workers:
            numbers = list(islice(self._left, self._batch(workers)))
            if not numbers:
                break
            future = self._workers.submit([self._plan.run(number) for number in numbers])
            self._under_way[future] = monotonic()
        return bool(self._under_way)

    def _batch(self, workers: int) -> int:
        """Return the size of the next batch; last batches are small, so workers end together."""
        return max(1, min(self._size, self._count // (4 * workers)))

    def _learn(self, took_s: float) -> None:
        """Adapt the size of batches to the duration of a batch, including waits."""
        if took_s < _BATCH_S:
            self._size = min(_MOST, 2 * self._size)
        elif took_s > 4 * _BATCH_S:
            self._size = max(1, self._size // 2)


_CSV: Final = ".csv"
_NEEDS_ARROW: Final = "Parquet needs pyarrow: pip install 'tickrig[campaign]'"


@dataclass(frozen=True, slots=True, kw_only=True)
class _CampaignOptions:
    """Options of the command line.

    Attributes:
        tests: files, folders and node IDs.
        seeds: seeds, such as `0-9999`.
        parameters: parameters with their values, such as `flip=0.0001,0.001`.
        shard: part of the campaign, such as `3/8`.
        outputs: tables to write.
        workers: number of processes, or None for one process per core.
        timeout_us: time-out of a run.
        bench: path of the rig file, or empty to use the rig file of the tests.
        keyword: expression, as in pytest's `-k`.
        scheduler: address of the scheduler of a Dask cluster, or empty to use this machine.
        fresh: whether to replace earlier results.
        version: version of tickrig.
    """

    tests: tuple[str, ...]
    seeds: str
    parameters: tuple[str, ...] = ()
    shard: str = "1/1"
    outputs: tuple[Path, ...] = ()
    workers: int | None = None
    timeout_us: int = 60_000_000
    bench: str = ""
    keyword: str = ""
    scheduler: str = ""
    fresh: bool = False
    version: str = ""

    @property
    def output_paths(self) -> tuple[Path, ...]:
        """Paths of the campaign's tables.

        The default is `campaign.csv`. If the campaign is divided into 4 parts, the default for its
        part 2 is `campaign-2-of-4.csv`.
        """
        shard = Shard.parse(self.shard)
        part = f"-{shard.part}-of-{shard.parts}" if shard.parts > 1 else ""
        return self.outputs or (Path(f"campaign{part}{_CSV}"),)

    @property
    def order(self) -> CampaignOrder:
        """The order to the workers."""
        return CampaignOrder(
            tests=self.tests,
            parameters=self.parameters,
            bench=self.bench,
            keyword=self.keyword,
            timeout_s=self.timeout_us / 1e6,
            folder=str(Path.cwd()),
            version=self.version,
        )


_SUFFIX: Final = ".journal"


def _cores() -> int:
    """Return the number of processors for this process."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class _CampaignRun:
    """The run of a campaign.

    Args:
        options: options of the command line.

    Raises:
        CampaignRefusal: the options are invalid.
    """

    def __init__(self, options: _CampaignOptions) -> None:
        self._options = options
        with _refused("--seeds"):
            self._seeds = Seeds.parse(options.seeds)
        with _refused("--shard"):
            self._shard = Shard.parse(options.shard)
        if options.timeout_us == 0:
            raise CampaignRefusal("--timeout 0: no run is over at once; write 60s")
        _check_outputs(options.output_paths)
        self._paths = options.output_paths
        self._journal_path = Path(f"{self._paths[0]}{_SUFFIX}")
        self._check_old()

    def _check_old(self) -> None:
        """Refuse to replace a table, unless its campaign was interrupted at the end."""
        if self._options.fresh:
            self._journal_path.unlink(missing_ok=True)
            return
        there = [path for path in self._paths if path.exists() and path.is_file()]
        if there and not self._journal_path.exists():
            raise CampaignRefusal(
                f"{there[0]} is there already: --fresh replaces it, -o takes another"
            )

    def run(self) -> CampaignTable:
        """Execute the remaining runs of the campaign, and return the table of the results.

        This method also writes the table to the output files.

        Raises:
            CampaignRefusal: the campaign cannot run or continue. The results of finished runs are
                kept.
        """
        crew = Crew(self._options.order)
        try:
            return self._run(crew)
        except JournalFullError as error:
            self._end(UNWRITTEN, f"{error.filename}: {error.strerror}; make room")
        except OSError as error:
            raise CampaignRefusal(
                f"{error.filename or 'campaign'}: {error.strerror or error}"
            ) from None
        except KeyboardInterrupt:
            self._end(INTERRUPTED, "interrupted")
        finally:
            crew.close()

    def _run(self, crew: Crew) -> CampaignTable:
        collected = crew.collect()
        if not collected.tests:
            if not collected.left_out:
                raise CampaignRefusal("no tests were collected")
            without = known(collected.left_out)
            raise CampaignRefusal(
                f"no test takes the fixture bench, so no seed changes anything: {without};"
                " a search takes its own: check_host(..., seed=1)"
            )
        if collected.left_out:
            say(f"{counted(len(collected.left_out), 'test')} without a bench left out")
        plan = CampaignPlan(self._options.order, collected, self._seeds, self._shard)
        self._plan = plan
        self._journal = CampaignJournal(self._journal_path, plan.head)
        with closing(self._journal):
            with closing(self._workers(crew, plan)) as workers:
                self._do(plan, workers)
            table = table_of(plan, self._journal.verdicts.values())
            _write_outputs(table, self._paths)
            self._journal.remove()
        return table

    def _workers(self, crew: Crew, plan: CampaignPlan) -> _Workers:
        if not self._options.scheduler:
            return LocalWorkers(crew, plan.collected.digest, self._options.workers or _cores())
        try:
            return dask_workers.DaskWorkers(self._options.scheduler, plan)
        except ImportError:
            raise CampaignRefusal(
                "--scheduler needs Dask: pip install 'tickrig[campaign]'"
            ) from None

    def _do(self, plan: CampaignPlan, workers: _Workers) -> None:
        """Do all runs; show a progress bar on a terminal."""
        kept = self._journal.verdicts
        if kept:
            say(f"{self._journal_path}: {len(kept)} of {counted(plan.size(), 'run')} are done")
        failed = Counter(verdict.outcome in WELL for verdict in kept.values())
        bar: ProgressBar[int] = click.progressbar(
            length=plan.size(),
            file=as_is(sys.stderr) if sys.stderr.isatty() else io.StringIO(),
            item_show_func=lambda _: f"{failed[False]} not passed",
        )
        with bar:
            bar.update(len(kept))
            for verdicts in Campaign(plan, self._journal, workers).verdicts():
                failed.update(verdict.outcome in WELL for verdict in verdicts)
                bar.update(len(verdicts), len(verdicts))

    def _end(self, status: int, why: str) -> NoReturn:
        """Stop early, and print how to continue."""
        if not hasattr(self, "_journal"):
            say(f"{why}; nothing was started")
        else:
            done, size = len(self._journal.verdicts), self._plan.size()
            command = shlex.join(["tickrig", *[word for word in sys.argv[1:] if word != "--fresh"]])
            say(f"{why}: {done} of {size} runs are kept; go on with {command}")
        raise click.exceptions.Exit(status)


@contextmanager
def _refused(option: str) -> Iterator[None]:
    try:
        yield
    except ValueError as error:
        raise CampaignRefusal(f"{option}: {error}") from None


def _check_outputs(paths: Sequence[Path]) -> None:
    """Refuse tables that cannot be written."""
    for path in paths:
        if path.suffix not in (_CSV, PARQUET):
            raise CampaignRefusal(f"-o {path}: a table is a .csv or a .parquet")
        with _refused("-o"):
            check_file(path, "table")
    _check_arrow(paths)


def _check_arrow(paths: Sequence[Path]) -> None:
    """Refuse Parquet where pyarrow is missing."""
    if any(path.suffix == PARQUET for path in paths):
        try:
            import pyarrow  # noqa: F401, PLC0415 - whether it is there
        except ImportError:
            raise CampaignRefusal(_NEEDS_ARROW) from None


def _write_outputs(table: CampaignTable, paths: Sequence[Path]) -> None:
    """Write a table to each path; raise OSError if a file cannot be written."""
    for path in paths:
        write_table(table, path)


# The commands `tickrig campaign run` and `tickrig campaign merge`.

_NOT_PASSED: Final = 1


def run(**options: Any) -> int:
    """Do the runs; return the exit status."""
    try:
        wanted = _CampaignOptions(version=VERSION, **options)
        table = _CampaignRun(wanted).run()
    except CampaignRefusal as refusal:
        raise Refused(str(refusal)) from None
    return _shown(table, wanted.output_paths[0])


def merge(tables: tuple[Path, ...], outputs: tuple[Path, ...]) -> int:
    """Join the tables; return the exit status."""
    try:
        _check_outputs(outputs)
        _check_arrow(tables)
        table = merge_tables([(path, read_table(path)) for path in tables])
        _write_outputs(table, outputs)
    except CampaignRefusal as refusal:
        raise Refused(str(refusal)) from None
    except OSError as error:
        raise Refused(f"{error.filename}: {error.strerror}") from None
    for line in missing_seeds(table):
        say(f"warning: {line}")
    return _shown(table, outputs[0])


def _shown(table: CampaignTable, path: Path) -> int:
    for line in summary(table, str(path)):
        click.echo(line)
    return 0 if all(row.outcome in WELL for row in table.rows) else _NOT_PASSED
