"""What the program of a slave, or the hands at it, have raised, in a line, and where."""

from __future__ import annotations

import linecache
from collections.abc import Iterator
from pathlib import Path
from traceback import walk_tb
from typing import Final

from tickrig.emulators.testing.conformance.called_slave import NoFrames
from tickrig.host.canopen.conform.bus.step_failed import Disturbed, NotAllowed, StepFailed
from tickrig.host.canopen.conform.conform_run import Crash
from tickrig.host.canopen.conform.plan import Stimulus

OURS: Final = "tickrig."


class Crashes:
    """What a program raises: kept until somebody wants to be told.

    Args:
        who: whose program it is, for people.
    """

    def __init__(self, who: str) -> None:
        self._who, self._kept = who, list[tuple[str, list[str]]]()
        self._report: Crash = lambda reason, where: self._kept.append((reason, where))

    def __call__(self, error: Exception) -> None:
        """Take what it has raised."""
        self._report(crash_text(error, self._who), crash_lines(error))

    def watch(self, report: Crash) -> None:
        """Tell of them from now on, and of those before."""
        self._report = report
        for reason, where in self._kept:
            report(reason, where)


def guarded(stimulus: Stimulus) -> Stimulus:
    """Let a check be inconclusive when the hands at the inputs raise what they should not."""

    def act(*words: str) -> str:
        try:
            return stimulus(*words)
        except (ValueError, NotAllowed, StepFailed, Disturbed):
            raise
        except Exception as error:
            raise Disturbed(crash_text(error, "the stimulus")) from error

    return act


def crash_text(error: Exception, who: str) -> str:
    """Return what was raised, in a line.

    >>> crash_text(KeyError("x"), "your slave")
    "your slave raised KeyError: 'x'"
    """
    if isinstance(error, NoFrames):
        return f"{who} {error}"
    kind = type(error)
    name = kind.__name__ if kind.__module__ == "builtins" else f"{kind.__module__}.{kind.__name__}"
    text = " ".join(str(error).split())
    return f"{who} raised {name}: {text}" if text else f"{who} raised {name}"


def crash_lines(error: Exception) -> list[str]:
    """Return the lines at which it was raised, outermost first, but for ours before its own."""
    if isinstance(error, NoFrames):
        return []
    return list(_lines(error, OURS)) or list(_lines(error, "no module"))


def _lines(error: Exception, but_for: str) -> Iterator[str]:
    for frame, line in walk_tb(error.__traceback__):
        if not str(frame.f_globals.get("__name__", "")).startswith(but_for):
            code = frame.f_code
            text = linecache.getline(code.co_filename, line, frame.f_globals).strip()
            yield f"{Path(code.co_filename).name}:{line} in {code.co_name}: {text}"
