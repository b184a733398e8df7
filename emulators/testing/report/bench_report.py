"""What a test run was, as values: what a report is made of.

Fewer samples of a signal, without losing a spike.

>>> thinned([(0, 0), (1, 1), (2, 9), (3, 1), (4, 0), (5, 0), (6, -7), (7, 0)], 6)
[(0, 0), (2, 9), (4, 0), (5, 0), (6, -7), (7, 0)]
"""

from __future__ import annotations

import platform
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import pairwise
from math import isfinite
from typing import ClassVar, Final, NamedTuple

from tickrig._version import __version__

Value = int | float | str | None
"""A sample: a number, a word such as a state, None where nothing is known."""


class Outcome(StrEnum):
    """How a test ended, in the order in which people want to see them.

    Attributes:
        FAILED: the device, or the host, does not do what was expected.
        ERROR: the test itself is wrong, or its fixtures are.
        BLOCKED: the bench could not judge: too slow, a port gone, an operator who said no.
        PASSED: all was as expected.
        SKIPPED: not run, such as on a bench that cannot do what is needed.
    """

    FAILED = "failed"
    ERROR = "error"
    BLOCKED = "blocked"
    PASSED = "passed"
    SKIPPED = "skipped"


@dataclass(frozen=True, slots=True)
class RunEnvironment:
    """Where and how tests ran; all workers of a parallel run give the same.

    Attributes:
        date: when it began, as text.
        mode: `virtual`, `real` or `hardware`.
        seed: of all randomness, None if there is none.
        rig_file: name of the rig file, empty if there is none.
        rig_text: its content.
        tickrig: version of tickrig.
        python: version of Python.
        platform: system and machine.
    """

    date: str
    mode: str = ""
    seed: int | None = None
    rig_file: str = ""
    rig_text: str = ""
    tickrig: str = ""
    python: str = ""
    platform: str = ""

    def of_this_machine(self) -> RunEnvironment:
        """Return it with the versions and the system of the Python that runs."""
        return replace(
            self,
            tickrig=__version__,
            python=f"{platform.python_implementation()} {platform.python_version()}",
            platform=f"{platform.system()} {platform.release()} {platform.machine()}",
        )


@dataclass(frozen=True, slots=True)
class Requirement:
    """What has to be shown by tests.

    Attributes:
        name: as the marker `req` has it, such as `SAF-12`.
        text: what it demands, for people.
    """

    name: str
    text: str = ""


@dataclass(frozen=True, slots=True)
class PlannedFault:
    """A fault that a test requested, or that came without a request.

    Attributes:
        name: as it was requested, with device and rate: `left_drive/flip=0.01`.
        from_us: when it began; None if its trigger never came.
        to_us: when it ended; None if it stayed.
        when: its trigger, such as `the 3rd OK:output`, or a time that never came; empty if it came
            by time.
        ordered_us: when it was requested; None if unknown, as for a manual one.
    """

    name: str
    from_us: int | None = None
    to_us: int | None = None
    when: str = ""
    ordered_us: int | None = None


class JournalLine(NamedTuple):
    """Something that happened: a line or decoded frame on a wire, an action, a changed output.

    Attributes:
        at_us: when, in the time of the bench.
        source: device or wire, empty where there is one only.
        mark: as transcripts have it: `>` to the device, `<` from it, `!` an action, `*` an
            output, `?` an expectation that was missed.
        text: what, for people; bytes are escaped as in traces.
    """

    at_us: int
    source: str
    mark: str
    text: str


@dataclass(frozen=True, slots=True)
class SignalSeries:
    """The samples of a signal.

    Attributes:
        name: of the signal, with its device where there are several: `left_drive/state`.
        unit: of numbers, empty for plain ones.
        points: time in the time of the bench, value; times do not run backwards.
        steps: a value holds until the next one. Words always do.
    """

    name: str
    unit: str = ""
    points: tuple[tuple[int, Value], ...] = ()
    steps: bool = True

    def __post_init__(self) -> None:
        """Take booleans as 0 and 1, NaN as unknown; ValueError if times run backwards."""
        times = [at_us for at_us, _ in self.points]
        if times != sorted(times):  # it costs a tenth of comparing pair by pair
            before_us, at_us = next(pair for pair in pairwise(times) if pair[1] < pair[0])
            raise ValueError(f"{self.name}: {at_us} us comes after {before_us} us")
        plain = {type(value) for _, value in self.points} <= {int, str, type(None)}
        if not plain and any(_plain(value) is not value for _, value in self.points):
            cleaned = tuple((at_us, _plain(value)) for at_us, value in self.points)
            object.__setattr__(self, "points", cleaned)


def _plain(value: Value) -> Value:
    if isinstance(value, bool):
        return int(value)
    return None if isinstance(value, float) and not isfinite(value) else value


@dataclass(frozen=True, slots=True)
class TestRecord:
    """One test, once.

    Attributes:
        nodeid: as pytest writes it: `tests/test_stop.py::test_it_stops[fast]`.
        outcome: how it ended.
        run: number of its environment in the report, from 0.
        mode: `virtual`, `real` or `hardware`; empty if it had no bench.
        virtual_us: how much time passed on the bench, None without one.
        wall_us: how long it took.
        seed: of what was left to chance, None if nothing was.
        requirements: names of what it shows.
        markers: its other markers.
        expected: what was waited for or checked last, in a line: the statement that failed.
        reason: why it failed, is blocked or was skipped, in a line.
        longrepr: what pytest tells about a failure.
        command: what repeats it, for a shell.
        faults: what was ordered.
        journal: the last that happened, in the order of time.
        journal_left_out: how many earlier lines are not in `journal`.
        series: physical values.
        trace: of the bench, as `tickrig replay` reads it; empty if none was kept.
        artefacts: names of files that were kept.
    """

    __test__: ClassVar[bool] = False  # pytest: no test class

    nodeid: str
    outcome: Outcome
    run: int = 0
    mode: str = ""
    virtual_us: int | None = None
    wall_us: int = 0
    seed: int | None = None
    requirements: tuple[str, ...] = ()
    markers: tuple[str, ...] = ()
    expected: str = ""
    reason: str = ""
    longrepr: str = ""
    command: str = ""
    faults: tuple[PlannedFault, ...] = ()
    journal: tuple[JournalLine, ...] = ()
    journal_left_out: int = 0
    series: tuple[SignalSeries, ...] = ()
    trace: str = ""
    artefacts: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class BenchReport:
    """A test run, or several that were merged.

    Attributes:
        title: title of the page.
        runs: where and how, without duplicates.
        tests: in the order in which they are shown.
        requirements: all requirements, including those that no test names; empty if there is no
            list.
    """

    title: str = "Bench report"
    runs: tuple[RunEnvironment, ...] = ()
    tests: tuple[TestRecord, ...] = ()
    requirements: tuple[Requirement, ...] = ()

    def __post_init__(self) -> None:
        """Raise ValueError if a test belongs to a run that is not there."""
        for test in self.tests:
            if not 0 <= test.run < len(self.runs):
                raise ValueError(f"{test.nodeid}: there is no run {test.run}")


def merge_reports(reports: Sequence[BenchReport], title: str = "") -> BenchReport:
    """Return one report of several, such as of the workers of a run, or of runs in three modes.

    Equal runs become one, and so do requirements; tests stand in the order in which they come.

    Args:
        reports: at least one, else the report is empty.
        title: of the page; that of the first unless given.
    """
    runs = tuple(dict.fromkeys(run for report in reports for run in report.runs))
    tests = tuple(
        replace(test, run=runs.index(report.runs[test.run]))
        for report in reports
        for test in report.tests
    )
    texts: dict[str, str] = {}
    for requirement in (one for report in reports for one in report.requirements):
        texts[requirement.name] = texts.get(requirement.name) or requirement.text
    return BenchReport(
        title or next((report.title for report in reports), BenchReport().title),
        runs,
        tests,
        tuple(Requirement(name, text) for name, text in texts.items()),
    )


Point = tuple[int, Value]
"""A time in microseconds, and what the signal was then."""

_GROUP: Final = 4


def thinned(points: Sequence[Point], most: int) -> list[Point]:
    """Return at most `most` samples: the first, the last, and the extremes of every four.

    Of four that include words, the first and the last stay; this is repeated while there are too
    many samples.

    Args:
        points: in the order of time.
        most: largest number of samples, at least 4.
    """
    if len(points) <= most:
        return list(points)
    kept = list(points[1:-1])
    while len(kept) > most - 2:
        groups = (kept[at : at + _GROUP] for at in range(0, len(kept), _GROUP))
        kept = [point for group in groups for point in _ends(group)]
    return [points[0], *kept, points[-1]]


def _ends(group: list[Point]) -> list[Point]:
    """Return two of some samples, in the order of time."""
    numbers = [value for _, value in group if isinstance(value, int | float)]
    if len(numbers) < len(group) or min(numbers) == max(numbers):
        return [group[0], group[-1]] if len(group) > 1 else group
    low, high = sorted((numbers.index(min(numbers)), numbers.index(max(numbers))))
    return [group[low], group[high]]
