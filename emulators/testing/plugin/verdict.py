"""Separates errors of the bench, failures of the device, and mistakes in a test."""

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path
from traceback import walk_tb
from types import TracebackType
from typing import Final

import pytest

import tickrig
from tickrig.emulators.testing.bench.bench import Bench
from tickrig.emulators.testing.bench.errors import BenchBlocked, BenchError
from tickrig.emulators.testing.host_clock.host_code import HostHangsError, is_installed

_PACKAGE: Final = Path(tickrig.__file__).parent

_MISTAKES: Final = (TypeError, AttributeError, NameError, ImportError, SyntaxError)
"""Exceptions that mean an error in the program, however slow the machine is."""

_REFUSALS: Final = (ValueError, LookupError, BenchError)
"""Exceptions by which the bench refuses a request."""

_OF_STATE: Final = ("WireError", "RtcRefused", "ServerRefused")
"""Refusals that depend on received data, or on the state of a component."""

_CHECKS: Final = tuple(
    f"tickrig.emulators.testing.{room}" for room in ("properties", "machine", "fuzz", "conformance")
)
"""Packages that report errors of devices and hosts by AssertionError."""

_LIBRARIES: Final = sys.stdlib_module_names | {"can", "canopen", "serial"}
"""Modules whose errors mean a mistake of the caller."""


class MisusedError(pytest.fail.Exception):  # type: ignore[name-defined,misc]  # pytest has it
    """A test uses its bench wrongly: it calls an async function without `await`."""


def blocked(
    report: pytest.TestReport,
    call: pytest.CallInfo[None],
    bench: Bench | None,
    *,
    mistaken: bool = False,
) -> str:
    """Return why the bench could not judge the device in a phase of a test, or "" if it could.

    One possible reason is that the machine was too slow.

    Args:
        report: pytest's report of the phase, with the outcome.
        call: pytest's `CallInfo` of the phase, with the exception that the phase raised.
        bench: bench of the test, or None if the bench was not opened.
        mistaken: whether the test itself is wrong; see `is_mistake`.
    """
    error = None if call.excinfo is None else call.excinfo.value
    if isinstance(error, BenchBlocked):
        return str(error) or type(error).__name__
    if bench is None or not report.failed or report.when == "teardown" or mistaken:
        return ""
    return bench._mode.too_slow()


def is_mistake(error: BaseException) -> bool:
    """Return whether an error is a mistake in the test, so that a faster machine would not help.

    Examples are a misspelt name, and a call that the bench refuses. The result is false for an
    error that arises because a value is None: on a slow machine, the message with the value may
    have arrived too late. The result is also false for an exception that the host itself raises.
    """
    if isinstance(error, BaseExceptionGroup):
        return any(map(is_mistake, error.exceptions))
    raiser = _raiser(error)
    ours, of_pytest = (raiser.partition(".")[0] == name for name in ("tickrig", "_pytest"))
    if isinstance(error, _MISTAKES):
        return ours or "NoneType" not in str(error)
    if isinstance(error, (RuntimeError, *_REFUSALS)) and ours:
        return not any(kind.__name__ in _OF_STATE for kind in type(error).__mro__)
    if type(error) is AssertionError and ours:
        return not raiser.startswith(_CHECKS)
    return isinstance(error, MisusedError | pytest.FixtureLookupError) or of_pytest


def _raiser(error: BaseException) -> str:
    """Return the module that has raised an error, or that has called the library with the error."""
    names = [frame.f_globals.get("__name__") or "" for frame, _ in walk_tb(error.__traceback__)]
    named = [name for name in names if name != "_pytest.outcomes"]
    own = (name for name in reversed(named) if name.partition(".")[0] not in _LIBRARIES)
    return next(own, "")


def end_at_caller(error: BaseException) -> None:
    """Remove stack frames of tickrig from a traceback, so that users see their own line last.

    If tickrig refused a call, or a host waits endlessly, the last line is the line of the test or
    host that called tickrig. If tickrig called a function of the test, such as a condition, and
    this function raised the exception, the last line is in this function.

    Args:
        error: the exception of the test.
    """
    # From the outermost frame inwards: the last one that is not ours becomes the end of the
    # traceback.
    entry, last = error.__traceback__, None
    while entry is not None:
        if _package_of(entry) not in ("tickrig", "contextlib"):
            last = entry
        entry = entry.tb_next
    refused = isinstance(error, (TypeError, HostHangsError, *_REFUSALS))
    if refused and last and _package_of(last) not in ("_pytest", "pluggy"):
        last.tb_next = None
    _leave_out_ours(error.__traceback__)


def _leave_out_ours(entry: TracebackType | None) -> None:
    """Remove tickrig's frames before the innermost frame of the user's code."""
    entries = []
    while entry is not None:
        entries.append(entry)
        entry = entry.tb_next
    theirs = [number for number, entry in enumerate(entries) if _is_of_user(entry)]
    if not theirs:
        return
    kept = [entry for entry in entries[: theirs[-1]] if _package_of(entry) != "tickrig"]
    rest = entries[theirs[-1] :]
    for entry, following in pairwise([*kept, rest[0]]):
        entry.tb_next = following


def _is_of_user(entry: TracebackType) -> bool:
    file, package = entry.tb_frame.f_code.co_filename, _package_of(entry)
    known = package in _LIBRARIES or package in ("tickrig", "_pytest", "pluggy")
    return not known and not is_installed(file)


def _package_of(entry: TracebackType) -> str:
    """Return the package at the top of a module."""
    return str(entry.tb_frame.f_globals.get("__name__")).partition(".")[0]


def make_error(report: pytest.TestReport, reason: str) -> None:
    """Change the report of a failed test to an error, whose reason is a problem of the bench.

    A test that was expected to fail (`xfail`) becomes an error, too.

    Args:
        report: report of the test.
        reason: description of the problem.
    """
    report.outcome = "failed"
    report.__dict__.pop("wasxfail", None)  # a fault of the bench is unexpected
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
    """Remove tickrig's own entries from a traceback, because they do not explain the error.

    Args:
        report: the report of the test.
        shown: whether the reason is already shown. If it is, all entries may be removed.
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
    return path.is_relative_to(_PACKAGE) or path.name == "contextlib.py"
