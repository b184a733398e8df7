r"""Summary of all tests of a report: counts, requirements, the slowest tests.

Requirements are read from a text file with one requirement per line.

>>> parse_requirements("# Wheelchair\nSAF-12  A pulled bus stops the chair\n", "req.txt")
(Requirement(name='SAF-12', text='A pulled bus stops the chair'),)
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import groupby
from pathlib import Path
from typing import Final

from tickrig.emulators.testing.report.bench_report import (
    BenchReport,
    Outcome,
    Requirement,
    TestRecord,
)

_SLOWEST: Final = 10
_LONGEST_ANCHOR: Final = 120
UNWELL: Final = (Outcome.FAILED, Outcome.ERROR, Outcome.BLOCKED)
"""Verdicts that need attention."""

_NO_ANCHOR: Final = re.compile(r"[\W_]+")


@dataclass(frozen=True, slots=True)
class ReportedTest:
    """A test as the page of a bench report lists it.

    Attributes:
        record: record of the test.
        anchor: link target on the page, which is the same in each report with these tests.
        file: part of the node ID before the name of the test.
        name: rest of the node ID.
    """

    record: TestRecord
    anchor: str
    file: str
    name: str


class OverallVerdict(StrEnum):
    """Verdict about a requirement, from the outcomes of all tests that name it.

    Attributes:
        FAILED: at least one test failed or could not be completed.
        NOT_SHOWN: no test failed, and no test passed.
        SHOWN: at least one test passed, and no test failed.
    """

    FAILED = "failed"
    NOT_SHOWN = "not shown"
    SHOWN = "shown"


@dataclass(frozen=True, slots=True)
class _RequirementRow:
    """A requirement and its tests.

    Attributes:
        name: name of the requirement.
        text: the requirement as readable text.
        tests: the tests that name the requirement.
        listed: whether the requirement is in the list of requirements, or there is no list.
    """

    name: str
    text: str
    tests: tuple[ReportedTest, ...]
    listed: bool = True

    @property
    def passed(self) -> int:
        """Number of passed tests of the requirement."""
        return sum(test.record.outcome is Outcome.PASSED for test in self.tests)

    @property
    def verdict(self) -> OverallVerdict:
        """Verdict of all tests of the requirement; blocked tests are not counted."""
        outcomes = {test.record.outcome for test in self.tests}
        if outcomes & {Outcome.FAILED, Outcome.ERROR}:
            return OverallVerdict.FAILED
        return OverallVerdict.SHOWN if Outcome.PASSED in outcomes else OverallVerdict.NOT_SHOWN


def reported(tests: Iterable[TestRecord]) -> tuple[ReportedTest, ...]:
    """Return the tests with their places on the page."""
    used: Counter[str] = Counter()
    places = []
    for test in tests:
        file, _, name = test.nodeid.partition("::")
        anchor = "t-" + _NO_ANCHOR.sub("-", test.nodeid).strip("-")[:_LONGEST_ANCHOR]
        used[anchor] += 1
        while used[anchor] > 1:
            anchor = f"{anchor}-{used[anchor]}"
            used[anchor] += 1
        places.append(ReportedTest(test, anchor, file, name or file))
    return tuple(places)


def by_file(tests: Sequence[ReportedTest]) -> list[tuple[str, list[ReportedTest]]]:
    """Return the tests grouped by file, in order of appearance; equal names stay together."""
    files: dict[str, int] = {}
    names: dict[str, int] = {}
    for number, test in enumerate(tests):
        files.setdefault(test.file, number)
        names.setdefault(test.record.nodeid, number)
    ordered = sorted(tests, key=lambda test: (files[test.file], names[test.record.nodeid]))
    return [(file, list(group)) for file, group in groupby(ordered, key=lambda test: test.file)]


def counts(tests: Iterable[TestRecord]) -> dict[Outcome, int]:
    """Count the tests by outcome, in the order of the outcomes."""
    found = Counter(test.outcome for test in tests)
    return {outcome: found[outcome] for outcome in Outcome}


def requirement_rows(report: BenchReport, tests: Iterable[ReportedTest]) -> list[_RequirementRow]:
    """Return the requirements sorted by verdict, then by name with numbers in numeric order."""
    texts = {requirement.name: requirement.text for requirement in report.requirements}
    shown_by: dict[str, list[ReportedTest]] = {name: [] for name in texts}
    for test in tests:
        for name in dict.fromkeys(test.record.requirements):
            shown_by.setdefault(name, []).append(test)
    rows = [
        _RequirementRow(name, texts.get(name, ""), tuple(shown), name in texts or not texts)
        for name, shown in shown_by.items()
    ]
    order = list(OverallVerdict)
    return sorted(rows, key=lambda row: (order.index(row.verdict), natural(row.name)))


def natural(name: str) -> list[tuple[int, str]]:
    """Return a key by which SAF-9 comes before SAF-10."""
    return [
        (int(piece), "") if piece.isdecimal() else (-1, piece)
        for piece in re.split(r"([0-9]{1,18})", name)
    ]


def slowest(tests: Iterable[ReportedTest]) -> list[ReportedTest]:
    """Return the slowest tests, the slowest test first."""
    return sorted(tests, key=lambda test: -test.record.wall_us)[:_SLOWEST]


_COMMENT: Final = "#"


def read_requirements(path: Path) -> tuple[Requirement, ...]:
    """Read the file with the list of requirements for a bench report.

    Raises:
        OSError: the file cannot be read.
        ValueError: the file has errors. The message has all errors, one per line.
    """
    try:
        return parse_requirements(path.read_text("utf-8"), str(path))
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: not UTF-8 at byte {error.start}") from None


def parse_requirements(text: str, file: str) -> tuple[Requirement, ...]:
    """Parse the list of requirements for a bench report.

    Args:
        text: text with a requirement per line: the name, as in the marker `req`, then blanks, then
            the text of the requirement. A line that begins with `#` is a comment.
        file: name of the file, for messages.

    Raises:
        ValueError: a name occurs twice, or there are no requirements.
    """
    found: dict[str, Requirement] = {}
    lines: dict[str, int] = {}
    mistakes: list[str] = []
    for number, line in enumerate(text.removeprefix("\ufeff").splitlines(), 1):
        name, *demand = line.split(maxsplit=1) or [_COMMENT]
        if name.startswith(_COMMENT):
            continue
        if name in found:
            mistakes.append(f"{file}:{number}: {name} stands in line {lines[name]} already")
            continue
        found[name] = Requirement(name, "".join(demand).rstrip())
        lines[name] = number
    if mistakes:
        raise ValueError("\n".join(mistakes))
    if not found:
        raise ValueError(f"{file}: no requirement: write one a line, as SAF-12 It stops")
    return tuple(found.values())
