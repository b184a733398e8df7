"""A failure on a machine that was too slow is no verdict about the device."""

from __future__ import annotations

import pytest

from tests.hil.rrc.bench import Bench

BENCH = pytest.StashKey[Bench]()
"""The bench of a test, from the moment at which it is there."""


def judge(report: pytest.TestReport, bench: Bench | None) -> None:
    """Make a failure an error with the reason, if the machine was too slow."""
    if bench is None or not report.failed or report.when == "teardown":
        return
    if not (reason := bench.look()):
        return
    report.when = "setup"  # pytest and JUnit call it an error then: the bench failed, no device
    report.sections.append(("the bench", reason))
    crash = getattr(report.longrepr, "reprcrash", None)
    if crash is None:
        report.longrepr = f"{reason}\n{report.longreprtext}"
    else:
        crash.message = f"{reason}: {crash.message}"
