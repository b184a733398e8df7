"""Verdicts of two foreign stacks with the public checks, and how those of the tester compare."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple

from tests.environment import ROOT
from tickrig.host.canopen.conform.verdict import CheckVerdict, Report

FILE: Final = ROOT / "tests" / "golden" / "canopen" / "foreign_verdicts.txt"
COLUMNS: Final = ("LocalNode", "durand")
WORDS: Final = {
    CheckVerdict.PASS: "ok",
    CheckVerdict.FAIL: "FAIL",
    CheckVerdict.IMPLEMENTATION_DEFINED: "FAIL",
}
"""What the public checks call a verdict; where the device decides they said FAIL, and (impl)."""

REASONS: Final[Mapping[tuple[str, str], str]] = {
    ("LocalNode", "SG-01"): "an abort contains the index of an object. LocalNode takes this index"
    " from an earlier request, so without an earlier request it cannot abort. Before this check,"
    " our tester had already sent requests to LocalNode, and the other tester had not",
    ("LocalNode", "DS-08"): "LocalNode refuses a download in segments only after the last segment."
    " CiA 301 allows this",
}
"""Why a verdict differs."""


class Difference(NamedTuple):
    """A check of which the two say different things."""

    check_id: str
    public: str
    here: str
    reason: str


class Comparison(NamedTuple):
    """How a report compares.

    Attributes:
        both: checks that both judged.
        differences: those of which they say different things.
        explained: ids for which there is a reason.
    """

    both: int
    differences: tuple[Difference, ...]
    explained: frozenset[str]

    @property
    def same(self) -> int:
        """Checks of which both say the same."""
        return self.both - len(self.differences)


def read_table(stack: str) -> dict[str, str]:
    """Return the public verdicts on a stack: `ok`, `FAIL`, or `-` where it lacks the feature."""
    column = 1 + COLUMNS.index(stack)
    lines = FILE.read_text("ascii").splitlines()
    rows = (line.split() for line in lines if not line.startswith("#"))
    return {row[0]: row[column] for row in rows} | {"": stack}


def compare(report: Report, table: Mapping[str, str]) -> Comparison:
    """Compare a report with the public verdicts."""
    stack = table[""]
    both, differences = 0, list[Difference]()
    for result in report.results:
        name, word = result.check.id, WORDS.get(result.outcome.verdict, "-")
        public = table.get(name, "-")
        if "-" in (public, word):
            continue
        both += 1
        if public != word:
            reason = REASONS.get((stack, name), "")
            differences.append(Difference(name, public, word, reason))
    explained = frozenset(name for of, name in REASONS if of == stack)
    return Comparison(both, tuple(differences), explained)
