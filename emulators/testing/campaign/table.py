"""The table of a campaign: a row for each run, independent of the order of the runs."""

from __future__ import annotations

import csv
import io
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from tickrig._lazy import LazyModule
from tickrig.emulators.testing.campaign.order import CampaignRefusal, RunVerdict
from tickrig.emulators.testing.campaign.plan import CampaignPlan, Seeds
from tickrig.emulators.testing.report.overview import natural
from tickrig.host.text.values import counted
from tickrig.host.text.whole_file import write_whole

if TYPE_CHECKING:
    from tickrig.emulators.testing.campaign import parquet_file
else:
    parquet_file = LazyModule("tickrig.emulators.testing.campaign.parquet_file")  # an extra

FIRST: Final = ("test", "seed")
LAST: Final = ("outcome", "virtual_us", "where", "reason", "replay")
PARQUET: Final = ".parquet"
WELL: Final = ("passed", "skipped")


class CampaignRow(NamedTuple):
    """A row of a campaign's table, with the result of one run.

    Attributes:
        test: node ID of the test.
        seed: seed of all random numbers.
        values: values of the parameters, as written in the command line. A value is empty if the
            test does not have the parameter.
        outcome: outcome of the run, such as `passed`.
        virtual_us: virtual time on the bench at the end of the run, in microseconds.
        where: file and line of the failure, or empty if the run passed.
        reason: reason of the outcome in one line, or empty if the run passed.
        replay: command line that repeats the run with a trace, or empty if the run passed.
    """

    test: str
    seed: int
    values: tuple[str, ...]
    outcome: str
    virtual_us: int
    where: str
    reason: str
    replay: str

    def cells(self) -> tuple[str | int, ...]:
        """Return the values of the columns."""
        return (self.test, self.seed, *self.values, *self[3:])


class CampaignTable(NamedTuple):
    """Results of all runs of a campaign as a table, sorted by test and seed.

    Attributes:
        parameters: names of the parameters, each of which is a column.
        rows: rows of the table, one row for each run.
    """

    parameters: tuple[str, ...]
    rows: Sequence[CampaignRow]

    @property
    def columns(self) -> tuple[str, ...]:
        """The names of all columns."""
        return (*FIRST, *self.parameters, *LAST)


def table_of(plan: CampaignPlan, verdicts: Iterable[RunVerdict]) -> CampaignTable:
    """Return the table of finished runs."""
    return CampaignTable(plan.parameters, _sorted(_row(plan, verdict) for verdict in verdicts))


def _row(plan: CampaignPlan, verdict: RunVerdict) -> CampaignRow:
    number, outcome, virtual_us, where, reason = verdict
    run, values = plan.run(number), plan.values(number)
    replay = "" if outcome in WELL else plan.command(number)
    return CampaignRow(run.nodeid, run.seed, values, outcome, virtual_us, where, reason, replay)


def _sorted(rows: Iterable[CampaignRow]) -> list[CampaignRow]:
    places: dict[str, tuple[object, object, str]] = {}

    def place(row: CampaignRow) -> tuple[object, int]:
        if row.test not in places:
            test, _, values = row.test.partition("[")
            places[row.test] = (natural(test), _by_value(values), row.test)
        return places[row.test], row.seed

    return sorted(rows, key=place)


def _by_value(values: str) -> list[tuple[float, str]]:
    """Return a key by which `flip=0.003]` comes before `flip=0.02]`."""
    pieces = re.split(r"([0-9]+(?:\.[0-9]+)?(?:e-?[0-9]+)?)", values)
    return [(float(each), "") if each[:1].isdecimal() else (-1, each) for each in pieces]


def write_table(table: CampaignTable, path: Path) -> None:
    """Write the table of a campaign to a file: Parquet or CSV, according to the suffix of the path.

    A reader of the file sees the old or the new table, never a part.

    Raises:
        OSError: the file cannot be written.
    """
    if path.suffix == PARQUET:
        rows = [row.cells() for row in table.rows]
        write_whole(path, parquet_file.parquet_of(table.columns, rows))
        return
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows(row.cells() for row in table.rows)
    write_whole(path, text.getvalue())


def read_table(path: Path) -> CampaignTable:
    """Read the table of a campaign that `write_table` has written.

    Raises:
        Refusal: the file is not a table of a campaign.
        OSError: the file cannot be read.
    """
    if path.suffix == PARQUET:
        return _table(path, parquet_file.read_parquet(path))
    try:
        with path.open(encoding="utf-8", newline="") as file:
            return _table(path, csv.reader(file, strict=True))
    except (UnicodeDecodeError, csv.Error) as error:
        raise CampaignRefusal(f"{path} is no table of a campaign: {error}") from None


def _table(path: Path, lines: Iterable[Sequence[str]]) -> CampaignTable:
    numbered = enumerate(lines, 1)
    _, columns = next(numbered, (1, ()))
    if tuple(columns[:2]) != FIRST or tuple(columns[-len(LAST) :]) != LAST:
        raise CampaignRefusal(
            f"{path} is no table of a campaign: its columns are {', '.join(columns)}"
        )
    return CampaignTable(tuple(columns[2 : -len(LAST)]), list(_rows(path, len(columns), numbered)))


def _rows(
    path: Path, width: int, lines: Iterator[tuple[int, Sequence[str]]]
) -> Iterator[CampaignRow]:
    for number, cells in lines:
        seed, virtual = (cells[1], cells[1 - len(LAST)]) if len(cells) == width else ("", "")
        if not (seed.isdecimal() and virtual.isdecimal()):
            raise CampaignRefusal(f"{path}:{number}: no row of a campaign: {','.join(cells)[:60]}")
        values, (outcome, _, *ended) = tuple(cells[2 : -len(LAST)]), cells[-len(LAST) :]
        yield CampaignRow(cells[0], int(seed), values, outcome, int(virtual), *ended)


def merge_tables(tables: Sequence[tuple[Path, CampaignTable]]) -> CampaignTable:
    """Merge the tables of the parts of a campaign. A run in several tables is counted once.

    Raises:
        Refusal: the columns of the tables differ, or a run ended differently in two tables.
    """
    first, table = tables[0]
    rows: dict[tuple[str, int], tuple[CampaignRow, Path]] = {}
    for path, other in tables:
        if other.columns != table.columns:
            ours, theirs = (", ".join(t.parameters) or "none" for t in (table, other))
            raise CampaignRefusal(f"{path} has the parameters {theirs}; {first} has {ours}")
        for row in other.rows:
            before, where = rows.setdefault((row.test, row.seed), (row, path))
            if before != row:
                run = f"{row.test} with seed {row.seed}"
                ended = f"{before.outcome} in {where}, {row.outcome} in {path}"
                raise CampaignRefusal(f"{run} is not the same in two tables: {ended}")
    return CampaignTable(table.parameters, _sorted(row for row, _ in rows.values()))


# Summary of a campaign, for people.

_ORDER: Final = ("passed", "failed", "error", "blocked", "hung", "died", "skipped")
_COMMANDS: Final = 10
"""Number of commands shown for each failure; the table has all commands."""

_MOST: Final = 120
"""Largest number of characters of a reason."""

_LISTED: Final = 200
"""Largest number of characters of the list of seeds."""


def summary(table: CampaignTable, file: str) -> Iterator[str]:
    """Yield the lines of a campaign's summary: number of runs by outcome, then each failure.

    Args:
        table: table of the runs.
        file: name of the file with the table.
    """
    counts = Counter(row.outcome for row in table.rows)
    ended = ", ".join(f"{counts[name]} {name}" for name in _ORDER if counts[name])
    yield f"{file}: {counted(len(table.rows), 'run')}, {ended or 'none'}"
    of = Counter(row.test for row in table.rows)
    for (test, outcome, where), rows in _alike(table.rows).items():
        reason = rows[0].reason if len(rows[0].reason) <= _MOST else f"{rows[0].reason[:_MOST]}..."
        yield ""
        yield f"{test}: {len(rows)} of {of[test]} {outcome}"
        yield f"  {where}: {reason}" if where else f"  {reason}"
        yield f"  seeds {_seeds(rows)}"
        yield from (f"  {row.replay}" for row in rows[:_COMMANDS])
        if len(rows) > _COMMANDS:
            yield f"  ... and {len(rows) - _COMMANDS} more in the column replay"


def _alike(rows: Sequence[CampaignRow]) -> dict[tuple[str, str, str], list[CampaignRow]]:
    """Return the runs that did not pass, grouped by test, outcome and place."""
    alike: dict[tuple[str, str, str], list[CampaignRow]] = {}
    for row in rows:
        if row.outcome not in WELL:
            alike.setdefault((row.test, row.outcome, row.where), []).append(row)
    return alike


def _seeds(rows: Sequence[CampaignRow]) -> str:
    text = str(Seeds.of_ranges([(row.seed, row.seed) for row in rows]))
    cut = text if len(text) <= _LISTED else text[:_LISTED].rpartition(",")[0] + ",..."
    return f"{cut} ({len(rows)})"


def missing_seeds(table: CampaignTable) -> Iterator[str]:
    """Yield a message for each test that was not run with some of the seeds of its range.

    The range is from the smallest to the largest seed of the test in `table`. Seeds are missing,
    for example, if the campaign ran in several shards and the table of one shard was not merged.
    """
    tests: dict[str, list[int]] = {}
    for row in table.rows:
        tests.setdefault(row.test, []).append(row.seed)
    for test, seeds in tests.items():
        first, last = min(seeds), max(seeds)
        if missing := last - first + 1 - len(seeds):
            yield f"{test}: {missing} of the seeds {first}-{last} are missing: is a shard?"
