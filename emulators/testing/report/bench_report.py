"""The content of a report as values.

`thinned` reduces the samples of a signal without losing a spike.

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
"""A sample: a number, a word such as a state, or None if the value is unknown."""


class Outcome(StrEnum):
    """Outcome of a test in a bench report. Tests are listed in the order of these values.

    Attributes:
        FAILED: the device or the host did not behave as expected.
        ERROR: the test itself or its fixtures are wrong.
        BLOCKED: no verdict is possible, because real time was not kept, a port is gone, or an
            operator has refused.
        PASSED: everything was as expected.
        SKIPPED: the test was not run, for example because the bench does not support what the test
            needs.
    """

    FAILED = "failed"
    ERROR = "error"
    BLOCKED = "blocked"
    PASSED = "passed"
    SKIPPED = "skipped"


@dataclass(frozen=True, slots=True)
class RunEnvironment:
    """Environment and settings of a test run, for a bench report.

    All workers of a parallel run have the same environment and settings.

    Attributes:
        date: start of the run, as text.
        mode: `virtual`, `real` or `hardware`.
        seed: seed of all random numbers, or None if there is no seed.
        rig_file: name of the rig file, or empty if there is none.
        rig_text: content of the rig file.
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
        """Return the environment with the versions and the system of the present Python."""
        return replace(
            self,
            tickrig=__version__,
            python=f"{platform.python_implementation()} {platform.python_version()}",
            platform=f"{platform.system()} {platform.release()} {platform.machine()}",
        )


@dataclass(frozen=True, slots=True)
class Requirement:
    """A requirement on the device or host.

    A test of the requirement has the marker `req` with the name of the requirement.

    Attributes:
        name: name of the requirement, such as `SAF-12`.
        text: the requirement as readable text.
    """

    name: str
    text: str = ""


@dataclass(frozen=True, slots=True)
class PlannedFault:
    """A fault in a bench report: one that a test requested, or one that occurred without a request.

    Attributes:
        name: name as in the request, with device and rate: `left_drive/flip=0.01`.
        from_us: time at which the fault began, or None if its trigger did not occur.
        to_us: time at which the fault ended, or None if the fault stayed.
        when: trigger of the fault, such as `the 3rd OK:output`. If a fault did not occur because
            its start time was not reached, this text is the start time. The text is empty if the
            fault began at its time.
        ordered_us: time at which the fault was requested, or None if unknown, as for a manual
            fault.
    """

    name: str
    from_us: int | None = None
    to_us: int | None = None
    when: str = ""
    ordered_us: int | None = None


class JournalLine(NamedTuple):
    """An event in the journal of a bench report: traffic, an action, or a changed output.

    Attributes:
        at_us: time of the event on the bench, in microseconds.
        source: name of the device or wire, or empty if there is only one.
        mark: mark of the event, as in transcripts: `>` traffic to the device, `<` traffic from the
            device, `!` an action, `*` an output, `?` a missed expectation.
        text: the event as readable text, such as a line or a decoded frame. Bytes are escaped as in
            traces.
    """

    at_us: int
    source: str
    mark: str
    text: str


@dataclass(frozen=True, slots=True)
class SignalSeries:
    """Values of a signal over time, for a curve in a bench report.

    Attributes:
        name: name of the signal, with its device if there are several devices: `left_drive/state`.
        unit: unit of the numbers, or empty if they have no unit.
        points: pairs of time in microseconds and value, with times in ascending order. Equal times
            may occur.
        steps: whether a value holds until the next value. If false, a line connects the values. A
            value that is a text always holds until the next value.
    """

    name: str
    unit: str = ""
    points: tuple[tuple[int, Value], ...] = ()
    steps: bool = True

    def __post_init__(self) -> None:
        """Convert booleans to 0 and 1, and NaN to None; raise ValueError if times decrease."""
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
    """A run of a test.

    Attributes:
        nodeid: node ID, as in pytest: `tests/test_stop.py::test_it_stops[fast]`.
        outcome: outcome of the run.
        run: number of its environment in the report, from 0.
        mode: `virtual`, `real` or `hardware`, or empty if the test had no bench.
        virtual_us: time that passed on the bench, or None without a bench.
        wall_us: duration of the test.
        seed: seed of all random numbers, or None if the test used none.
        requirements: names of the requirements that the test shows.
        markers: other markers of the test.
        expected: the statement that failed, in one line: the last wait or check.
        reason: reason why the test failed, is blocked or was skipped, in one line.
        longrepr: pytest's text of the failure.
        command: shell command that repeats the test.
        faults: requested faults.
        journal: the last events, in order of time.
        journal_left_out: number of earlier events that are not in `journal`.
        series: recorded signals.
        trace: trace of the bench, for `tickrig replay`, or empty if no trace was kept.
        artefacts: names of kept files.
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
    """Bench report about a test run, or about several merged test runs.

    Attributes:
        title: title of the report's page.
        runs: environments in which the tests ran, without duplicates.
        tests: tests in the order of the report.
        requirements: all requirements, including requirements that no test names. It is empty if
            there is no list of requirements.
    """

    title: str = "Bench report"
    runs: tuple[RunEnvironment, ...] = ()
    tests: tuple[TestRecord, ...] = ()
    requirements: tuple[Requirement, ...] = ()

    def __post_init__(self) -> None:
        """Raise ValueError if a test belongs to a run that is not in the report."""
        for test in self.tests:
            if not 0 <= test.run < len(self.runs):
                raise ValueError(f"{test.nodeid}: there is no run {test.run}")


def merge_reports(reports: Sequence[BenchReport], title: str = "") -> BenchReport:
    """Merge several bench reports, such as those of parallel workers, or of runs in three modes.

    Equal runs are merged into one, and so are equal requirements. Tests keep the order of the
    reports.

    Args:
        reports: reports to merge. Without any report, the result is empty.
        title: title of the page. The default is the title of the first report.
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
"""A time in microseconds, and the value of the signal at this time."""

_GROUP: Final = 4


def thinned(points: Sequence[Point], most: int) -> list[Point]:
    """Return a curve with at most `most` samples, which keeps the extremes of the curve.

    The first and the last sample are kept. Of each group of four other samples, the smallest and
    the largest are kept. The value of a sample may also be a word. In a group with such a sample,
    the first and the last sample are kept instead. This is repeated while there are too many
    samples.

    Args:
        points: samples in order of time.
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
    """Return two samples of a group, in the order of time."""
    numbers = [value for _, value in group if isinstance(value, int | float)]
    if len(numbers) < len(group) or min(numbers) == max(numbers):
        return [group[0], group[-1]] if len(group) > 1 else group
    low, high = sorted((numbers.index(min(numbers)), numbers.index(max(numbers))))
    return [group[low], group[high]]
