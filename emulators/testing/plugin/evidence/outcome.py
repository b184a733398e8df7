"""How a test ended, and why, of the reports of its phases."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from tickrig.emulators.testing.plugin.stash import BENCHED
from tickrig.emulators.testing.report.bench_report import Outcome


def outcome_of(item: pytest.Item, reports: Sequence[pytest.TestReport]) -> tuple[Outcome, str, str]:
    """Return how a test ended, why in a line, and what pytest says of it.

    Args:
        item: the test.
        reports: of all its phases.
    """
    test = item.stash.get(BENCHED, None)
    for report in reports:
        if report.failed:
            crash = getattr(report.longrepr, "reprcrash", None)
            reason = crash.message if crash else report.longreprtext
            if test is not None and test.blocked:
                return Outcome.BLOCKED, test.blocked, report.longreprtext
            outcome = Outcome.FAILED if report.when == "call" else Outcome.ERROR
            return outcome, reason.partition("\n")[0], report.longreprtext
        if report.skipped:
            return Outcome.SKIPPED, _why_skipped(report), ""
    return Outcome.PASSED, "", ""


def _why_skipped(report: pytest.TestReport) -> str:
    if hasattr(report, "wasxfail"):
        return f"expected to fail: {report.wasxfail}".rstrip(": ")
    if isinstance(report.longrepr, tuple):
        return report.longrepr[2].removeprefix("Skipped: ")
    return report.longreprtext
