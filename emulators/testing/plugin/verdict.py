"""No failure of a device is what the bench is to blame for."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import pytest

import tickrig
from tickrig.emulators.testing.bench.bench import Bench
from tickrig.emulators.testing.bench.errors import BenchBlocked

PACKAGE: Final = Path(tickrig.__file__).parent


def blocked(report: pytest.TestReport, call: pytest.CallInfo[None], bench: Bench | None) -> str:
    """Say why a phase of a test came to no verdict about the device; empty if it did."""
    if call.excinfo is not None and isinstance(call.excinfo.value, BenchBlocked):
        return str(call.excinfo.value) or type(call.excinfo.value).__name__
    if bench is None or not report.failed or report.when == "teardown":
        return ""
    return bench._mode.too_slow()


def make_error(report: pytest.TestReport, reason: str) -> None:
    """Make an error of the bench out of what would be a failure of the device, or expected."""
    report.outcome = "failed"
    report.__dict__.pop("wasxfail", None)  # nobody expects the bench to be at fault
    if report.when == "call":
        report.when = "setup"  # pytest and JUnit call it an error then
    report.sections.append(("bench: blocked", reason))
    crash = getattr(report.longrepr, "reprcrash", None)
    _cut(report, shown=crash is not None and reason in crash.message)
    if crash is None:
        report.longrepr = f"blocked: {reason}\n{report.longreprtext}".rstrip()
    elif reason in crash.message:
        crash.message = f"blocked: {reason}"
    else:
        crash.message = f"blocked: {reason}: {crash.message}"


def _cut(report: pytest.TestReport, *, shown: bool) -> None:
    """Leave those parts of a traceback away that are ours: they tell nothing of the reason.

    Args:
        report: of the test.
        shown: whether the reason is all there is to tell, so that nothing else need be left.
    """
    traceback = getattr(report.longrepr, "reprtraceback", None)
    entries = getattr(traceback, "reprentries", [])
    theirs = [entry for entry in entries if not _is_ours(entry)]
    if traceback is not None and (theirs or shown):
        traceback.reprentries = theirs


def _is_ours(entry: object) -> bool:
    place = getattr(entry, "reprfileloc", None)
    if place is None:
        return False
    path = Path(place.path).absolute()
    return path.is_relative_to(PACKAGE) or path.name == "contextlib.py"
