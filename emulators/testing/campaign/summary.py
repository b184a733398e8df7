"""What a campaign found, for people."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Final

from tickrig.emulators.testing.campaign.seeds import Seeds
from tickrig.emulators.testing.campaign.table import WELL, Row, Table
from tickrig.host.text.values import counted

ORDER: Final = ("passed", "failed", "error", "blocked", "hung", "died", "skipped")
COMMANDS: Final = 10
"""So many commands are shown for each way to fail; the table has them all."""

MOST: Final = 120
"""Characters of a reason."""

LISTED: Final = 200
"""Characters of seeds that are listed."""


def summary(table: Table, file: str) -> Iterator[str]:
    """Give the lines: how many ended how, and of what did not pass why, where, and the commands.

    Args:
        table: the runs.
        file: the name of the table.
    """
    counts = Counter(row.outcome for row in table.rows)
    ended = ", ".join(f"{counts[name]} {name}" for name in ORDER if counts[name])
    yield f"{file}: {counted(len(table.rows), 'run')}, {ended or 'none'}"
    of = Counter(row.test for row in table.rows)
    for (test, outcome, where), rows in _alike(table.rows).items():
        reason = rows[0].reason if len(rows[0].reason) <= MOST else f"{rows[0].reason[:MOST]}..."
        yield ""
        yield f"{test}: {len(rows)} of {of[test]} {outcome}"
        yield f"  {where}: {reason}" if where else f"  {reason}"
        yield f"  seeds {_seeds(rows)}"
        yield from (f"  {row.replay}" for row in rows[:COMMANDS])
        if len(rows) > COMMANDS:
            yield f"  ... and {len(rows) - COMMANDS} more in the column replay"


def _alike(rows: Sequence[Row]) -> dict[tuple[str, str, str], list[Row]]:
    """Return the runs that did not pass, by test, outcome and place."""
    alike: dict[tuple[str, str, str], list[Row]] = {}
    for row in rows:
        if row.outcome not in WELL:
            alike.setdefault((row.test, row.outcome, row.where), []).append(row)
    return alike


def _seeds(rows: Sequence[Row]) -> str:
    text = str(Seeds.of_ranges([(row.seed, row.seed) for row in rows]))
    cut = text if len(text) <= LISTED else text[:LISTED].rpartition(",")[0] + ",..."
    return f"{cut} ({len(rows)})"


def missing_seeds(table: Table) -> Iterator[str]:
    """Say of each test between which seeds runs are missing: a shard that was forgotten."""
    tests: dict[str, list[int]] = {}
    for row in table.rows:
        tests.setdefault(row.test, []).append(row.seed)
    for test, seeds in tests.items():
        first, last = min(seeds), max(seeds)
        if missing := last - first + 1 - len(seeds):
            yield f"{test}: {missing} of the seeds {first}-{last} are missing: is a shard?"
