"""The text after a failure: what was requested, what happened last, and how to repeat it."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Sequence
from hashlib import sha256
from os.path import relpath
from pathlib import Path
from typing import Final

import pytest

from tickrig.emulators.testing.bench.bench import Bench
from tickrig.emulators.testing.bench.bench_rig import missing_of
from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.emulators.testing.plugin.journal_text import buses_of, frame_of, last_lines
from tickrig.emulators.testing.plugin.parameters import words_of
from tickrig.emulators.testing.plugin.settings import SETTINGS
from tickrig.emulators.testing.plugin.stash import BENCHED, TestWithBench
from tickrig.emulators.testing.report.bench_report import Outcome
from tickrig.host.text.values import format_time, list_item
from tickrig.host.text.whole_file import write_whole
from tickrig.wire.can import LogLine

# What is kept of a test: its trace, the frames of its buses, its transcript.

_TRACE: Final = ".trace"
_MOST: Final = 80
"""Largest number of characters of a file name that come from the name of the test."""


def stem_of(nodeid: str) -> str:
    """Return a unique base name for the files of a test, made from the test's node ID in pytest.

    >>> stem_of("tests/test_stop.py::test_it_stops[../fast]")
    'tests_test_stop.py_test_it_stops_fast-24cfca'
    """
    words = re.sub(r"[^A-Za-z0-9.-]+", "_", nodeid.replace("..", "")).strip("._-")
    return f"{words[-_MOST:].lstrip('._-') or 'test'}-{sha256(nodeid.encode()).hexdigest()[:6]}"


def keep(bench: Bench, folder: Path, nodeid: str) -> tuple[list[Path], list[str]]:
    """Write the files about a failed test, such as the trace of its bench.

    Args:
        bench: bench of the test, which is still open.
        folder: folder of the files, which is created.
        nodeid: node ID of the test.

    Returns:
        The written files, and the reasons for missing or incomplete files, one per line.
    """
    kept: list[Path] = []
    failed: list[str] = []
    for suffix, write in _WRITERS.items():
        path = folder / f"{stem_of(nodeid)}{suffix}"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if write(bench, path):
                kept.append(path)
                failed += _cut(bench, path)
        except NotOnThisBench:
            continue
        except OSError as error:
            failed.append(f"{path} was not written: {error.strerror or error}")
    return kept, failed


def _cut(bench: Bench, path: Path) -> list[str]:
    """Add a note that a file has only the last lines; a trace has all lines."""
    missing = "" if path.suffix == _TRACE else missing_of(bench._mode.journal())
    return [f"{path} is not whole: {missing}"] if missing else []


def _trace(bench: Bench, path: Path) -> bool:
    bench.save_trace(path)
    return True


def _candump(bench: Bench, path: Path) -> bool:
    buses = buses_of(bench)
    frames = [
        f"{LogLine(line.at_us, line.source, frame)}\n"
        for line in bench._mode.journal()
        if line.source in buses and (frame := frame_of(line)) is not None
    ]
    if frames:
        write_whole(path, "".join(frames))
    return bool(frames)


def _transcript(bench: Bench, path: Path) -> bool:
    write_whole(path, f"{bench.transcript()}\n")
    return True


_WRITERS: Final[dict[str, Callable[[Bench, Path], bool]]] = {
    _TRACE: _trace,
    ".log": _candump,
    ".txt": _transcript,
}
"""Writers by suffix; each writer returns whether it has written a file."""


# How a test ended, and why, of the reports of its phases.


def outcome_of(item: pytest.Item, reports: Sequence[pytest.TestReport]) -> tuple[Outcome, str, str]:
    """Return the outcome of a test, its reason in one line, and pytest's text about the failure.

    Args:
        item: the test.
        reports: reports of all phases of the test.
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


_LINES: Final = 20
"""Number of lines and frames that are shown."""


def sections_of(test: TestWithBench) -> list[tuple[str, str]]:
    """Return the sections of a report, each with its title."""
    command = ("bench: repeat it with", repeat_command(test.item))
    if test.bench is None:
        return [("bench", f"none was opened; {test.wanted.mode}"), command]
    last = last_lines(test.bench, _LINES) or "nothing happened"
    sections = [("bench", _wanted(test)), ("bench: what happened last", last), command]
    if unheard := test.take_unheard():
        sections.insert(1, ("bench: beside the test", "\n".join(unheard)))
    if waiting := test.bench._mode.never_begun:
        sections.insert(1, ("bench: faults that never began", "\n".join(waiting)))
    if test.kept or test.not_kept:
        sections.append(("bench: what was kept", _kept(test)))
    return sections


def repeat_command(item: pytest.Item) -> str:
    """Return the command that runs a test again, for a shell."""
    config = item.config
    file, *names = str(item.nodeid).split("::")
    seed = config.stash[SETTINGS].seed
    words = [
        "pytest",
        "::".join([relpath(config.rootpath / file, config.invocation_params.dir), *names]),
    ]
    for flag, value in (
        ("--bench", config.getoption("bench")),
        ("--bench-mode", config.getoption("bench_mode")),
        ("--bench-seed", None if seed is None else str(seed)),
    ):
        words += [] if value is None else [flag, value]
    for name, word in words_of(item).items():
        words += ["--bench-param", f"{name}={list_item(word)}"]
    return shlex.join(words)


def _wanted(test: TestWithBench) -> str:
    bench = test.bench
    assert bench is not None
    what = test.wanted.text
    devices = ", ".join(bench.devices)
    named = what if what == devices else f"{what} with {devices}"
    return f"{named}; {bench.mode}, seed {test.wanted.seed_used}, {format_time(bench.now_us)} s old"


def _kept(test: TestWithBench) -> str:
    """Return the kept files; a trace is shown as the command that replays it."""
    paths = [shlex.quote(relpath(path)) for path in test.kept]
    lines = [f"tickrig replay {path}" if path.endswith(_TRACE) else path for path in paths]
    return "\n".join([*lines, *test.not_kept])
