"""A report by groups and by clauses, and in what order people look at its checks."""

from __future__ import annotations

import re
import shlex
from collections import Counter
from collections.abc import Callable, Iterable
from typing import Final, NamedTuple

from tickrig.host.canopen.conform.verdict import Report, Result, Verdict

UNWELL: Final = (Verdict.FAIL, Verdict.BLOCKED, Verdict.INCONCLUSIVE)
"""What somebody has to look at, the worst first."""


class Row(NamedTuple):
    """Checks that belong together.

    Attributes:
        name: of the group, or the clause.
        results: in the order in which they were judged.
    """

    name: str
    results: tuple[Result, ...]

    @property
    def counts(self) -> dict[Verdict, int]:
        """How many gave which verdict; those that nobody gave are left out."""
        return verdict_counts(self.results)


def verdict_counts(results: Iterable[Result]) -> dict[Verdict, int]:
    """Count verdicts, in their own order; those that nobody gave are left out."""
    counts = Counter(result.outcome.verdict for result in results)
    return {verdict: counts[verdict] for verdict in Verdict if counts[verdict]}


def counts_text(counts: dict[Verdict, int]) -> str:
    """Write counts for people.

    >>> counts_text({Verdict.PASS: 3, Verdict.FAIL: 1})
    '3 pass, 1 fail'
    """
    return ", ".join(f"{number} {verdict}" for verdict, number in counts.items()) or "none"


def by_group(report: Report) -> list[Row]:
    """Return the groups, in the order in which they were met."""
    return _rows(report, lambda result: result.check.group)


def by_clause(report: Report) -> list[Row]:
    """Return the clauses, by document and number."""
    rows = _rows(report, lambda result: result.check.source)
    return sorted(rows, key=lambda row: [_number(part) for part in re.split(r"(\d+)", row.name)])


def unwell(report: Report) -> list[Result]:
    """Return what somebody has to look at, the worst first."""
    found = [result for result in report.results if result.outcome.verdict in UNWELL]
    return sorted(found, key=lambda result: UNWELL.index(result.outcome.verdict))


def causes(results: Iterable[Result]) -> list[list[Result]]:
    """Put checks of objects together that fail alike: one of a kind stands for all."""
    found: dict[tuple[str, ...], list[Result]] = {}
    for number, each in enumerate(results):
        kind = OF_OBJECT.fullmatch(each.check.id)
        reason = PLACE.sub("", each.outcome.reason)
        key = (each.outcome.verdict, kind[1], reason) if kind else (str(number),)
        found.setdefault(key, []).append(each)
    return list(found.values())


OF_OBJECT: Final = re.compile(r"OD-.*-(\w+)")
PLACE: Final = re.compile(r"step \d+|\b[0-9A-F]{4}h?:[0-9A-F]{2}\b|\b\d+ bytes")
"""What differs in the reasons of objects that fail alike."""


def repair_commands(report: Report) -> tuple[str, ...]:
    """Return the commands that write back what could not be restored, in their order."""
    head = f"canmon net {shlex.quote(report.source)} write {report.node_id}"
    return tuple(f"{head} {shlex.quote(words)} --yes" for words in report.repairs)


def _rows(report: Report, name_of: Callable[[Result], str]) -> list[Row]:
    rows: dict[str, list[Result]] = {}
    for result in report.results:
        rows.setdefault(name_of(result), []).append(result)
    return [Row(name, tuple(results)) for name, results in rows.items()]


def _number(part: str) -> tuple[int, str]:
    return (int(part), "") if part.isdecimal() and len(part) < 9 else (0, part)
