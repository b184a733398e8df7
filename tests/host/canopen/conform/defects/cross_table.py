"""Which checks fail which defects, and the other way round."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Final

from tests.host.canopen.conform.defects.defect import Defect
from tests.host.canopen.conform.defects.table import DEFECTS
from tests.host.canopen.conform.defects.test_found import judge
from tickrig.host.canopen.conform.check import Check
from tickrig.host.canopen.conform.suite import suite_checks
from tickrig.host.canopen.conform.verdict import CheckVerdict

SEEN: Final = (CheckVerdict.FAIL, CheckVerdict.IMPLEMENTATION_DEFINED)

CANNOT_FAIL: Final = {
    "IO-01": "1000h decides whether it is asked at all; OD-1000.00-type compares it with the EDS",
}
"""Checks that no defect can fail, each with its reason."""

Seen = dict[str, list[str]]
"""Checks that failed, or told what was left to the device, by defect."""


def cross(
    defects: Iterable[Defect] = DEFECTS, *, whole: bool = False
) -> Iterator[tuple[Defect, list[str]]]:
    """Give each defect with the checks that saw it.

    Args:
        defects: to be judged.
        whole: by all checks, not only by those that each defect names.
    """
    for defect in defects:
        report = judge(defect, *(() if whole else defect.breaks))
        yield defect, [r.check.id for r in report.results if r.outcome.verdict in SEEN]


def unseen(seen: Iterable[str]) -> list[Check]:
    """Return the checks that saw no defect."""
    known = {*seen, *CANNOT_FAIL}
    return [check for check in suite_checks() if check.id not in known]


def lines(*, whole: bool = False) -> Iterator[str]:
    """Write the table, a line each."""
    seen: set[str] = set()
    found = 0
    for defect, checks in cross(whole=whole):
        seen.update(checks)
        by = [check for check in checks if check in defect.breaks]
        found += bool(by)
        others = len(checks) - len(by)
        more = f" and {others} more" if others else ""
        yield f"{defect.name}: {', '.join(by) or 'NOT FOUND'}{more}"
    yield f"{found} of {len(DEFECTS)} are found"
    for check, reason in CANNOT_FAIL.items():
        yield f"{check} sees none: {reason}"
    for left in unseen(seen):
        yield f"{left.id} sees none"
