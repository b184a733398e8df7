"""Tracebacks of tests that called us wrongly end in the line of the caller."""

from __future__ import annotations

from types import TracebackType
from typing import Final

from tickrig.emulators.testing.bench.errors import BenchError

REFUSALS: Final = (ValueError, TypeError, LookupError, BenchError)
"""What our calls raise where a caller is wrong; all else is shown whole."""

OURS: Final = ("tickrig", "contextlib")
"""Packages of our frames, and of what calls them."""


def end_at_caller(error: BaseException) -> None:
    """Cut our frames from the end of a traceback, if a call of ours refused something.

    Args:
        error: what a test raised.
    """
    entry, last = error.__traceback__, None
    while entry is not None:
        if _package_of(entry) not in OURS:
            last = entry
        entry = entry.tb_next
    if isinstance(error, REFUSALS) and last and _package_of(last) not in ("_pytest", "pluggy"):
        last.tb_next = None


def _package_of(entry: TracebackType) -> str:
    """Return the package at the top of a module."""
    return str(entry.tb_frame.f_globals.get("__name__")).partition(".")[0]
