"""The report of a test run as one HTML page that needs nothing else."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from enum import Enum, auto
from functools import cache
from typing import Final

from markupsafe import escape

from tickrig.emulators.testing.report import bench_report, overview
from tickrig.emulators.testing.report.timeline import Timeline, timeline_of
from tickrig.host.canmon.model.graph.plot import widened
from tickrig.host.text import page_text
from tickrig.host.text.html_page import PageTemplate
from tickrig.host.text.values import counted

# Which parts of which tests have room on a page: a browser has to open it in a few seconds.

_PAGE_BYTES: Final = 16_000_000
"""Space for the data of tests, in bytes; the rest of the page is additional."""

_JOURNAL_LINES: Final = 200
_LINE_CHARACTERS: Final = 2_000
_TEXT_BYTES: Final = 64_000
"""Largest size of pytest's text of a failure."""
_TRACE_BYTES: Final = 256_000
_LINE_BYTES: Final = 48
"""Size of a line of a journal in addition to its text."""


class _PagePart(Enum):
    """A part of a test, in the order in which parts get space on the page."""

    TEXT = auto()
    TIMELINE = auto()
    JOURNAL = auto()
    TRACE = auto()


@dataclass(slots=True)
class _PageRoom:
    """Divides the space on the page; for each kind of part, failed tests come first.

    Args:
        tests: all tests.
        timelines: the time lines of these tests.
        room_bytes: the available space.

    Attributes:
        admitted: parts that fit on the page, as number of the test and part.
    """

    tests: Sequence[bench_report.TestRecord]
    timelines: Sequence[Timeline | None]
    room_bytes: int = _PAGE_BYTES
    admitted: set[tuple[int, _PagePart]] = field(init=False, default_factory=set)

    def __post_init__(self) -> None:
        """Divide the space."""
        order = list(bench_report.Outcome)
        first = sorted(range(len(self.tests)), key=lambda n: order.index(self.tests[n].outcome))
        for part in _PagePart:
            for number in first:
                size = self._size(number, part)
                if size <= self.room_bytes:
                    self.admitted.add((number, part))
                    self.room_bytes -= size

    def _size(self, number: int, part: _PagePart) -> int:
        test, timeline = self.tests[number], self.timelines[number]
        match part:
            case _PagePart.TEXT:
                return _size_of(test.longrepr[:_TEXT_BYTES])
            case _PagePart.TIMELINE:
                return timeline.size if timeline else 0
            case _PagePart.JOURNAL:
                return _size_of("".join(_journal_texts(test)))
            case _PagePart.TRACE:
                return _size_of(_cut(test.trace, _TRACE_BYTES)[0])


def _journal_texts(test: bench_report.TestRecord) -> Iterator[str]:
    """Yield the texts of the journal lines, each with room for the markup around the text."""
    for line in test.journal[-_JOURNAL_LINES:]:
        yield line.text[:_LINE_CHARACTERS] + " " * _LINE_BYTES


def _size_of(text: str) -> int:
    """Return how many bytes a text takes on a page."""
    return len(str(escape(text)).encode("utf-8", "replace"))


def _cut(text: str, most: int) -> tuple[str, int]:
    """Return the first lines up to a length, and the number of omitted lines."""
    if len(text) <= most:
        return text, 0
    end = text.rfind("\n", 0, most) + 1 or most
    return text[:end], len(text) - end


_MOST_OPEN: Final = 12
"""Largest number of failed tests that are expanded when the page opens."""


@dataclass(frozen=True, slots=True)
class _TestOnPage:
    """A test with the parts that fit on the page.

    Attributes:
        place: test with its anchor and name on the page.
        timeline: time line of the test, or None if there is none or it does not fit.
        longrepr: pytest's text of the failure.
        journal: last lines of the journal.
        journal_left_out: number of earlier lines of the journal.
        trace: trace of the test.
        left_out: description of the parts that are not on the page.
        opened: whether the test is expanded when the page opens.
    """

    place: overview.ReportedTest
    timeline: Timeline | None
    longrepr: str
    journal: tuple[bench_report.JournalLine, ...]
    journal_left_out: int
    trace: str
    left_out: tuple[str, ...]
    opened: bool


def html_page(report: bench_report.BenchReport, room_bytes: int = _PAGE_BYTES) -> str:
    """Return the HTML page of a bench report.

    Args:
        report: the report to show.
        room_bytes: largest size of the data of tests on the page, in bytes. Data beyond this size
            are left out, and the page says what is left out.
    """
    places = overview.reported(report.tests)
    unwell = [place for place in places if place.record.outcome in overview.UNWELL]
    return _template().render(
        report=report,
        tests=places,
        shown={test.place.anchor: test for test in _on_page(places, room_bytes)},
        counts=overview.counts(report.tests),
        unwell=sorted(unwell, key=lambda place: overview.UNWELL.index(place.record.outcome)),
        requirements=overview.requirement_rows(report, places),
        slowest=overview.slowest(places),
        files=overview.by_file(places),
    )


@cache
def _template(page: str = "page.html") -> PageTemplate:
    """Return a template; each template is compiled once."""
    return PageTemplate(__package__, {"Outcome": bench_report.Outcome}, script="page.js", page=page)


# The page of one run without tests, as of `tickrig run --report`.

_PATH_SIZE: Final = 400
"""Length of the longer side of the picture of a path."""
_PATH_POINTS: Final = 4_000


@dataclass(frozen=True, slots=True)
class PagePath:
    """A diagram on the page of a run, in which one signal is drawn over another.

    Attributes:
        x: name and unit of the signal on the x axis.
        y: name and unit of the signal on the y axis.
        points: pairs of values of the two signals.
    """

    x: tuple[str, str]
    y: tuple[str, str]
    points: tuple[tuple[float, float], ...]

    @property
    def texts(self) -> list[str]:
        """Labels of both axes, each with name, least and greatest value, and unit."""
        return [
            f"{name} {min(column):.6g} to {max(column):.6g} {unit}".rstrip()
            for (name, unit), column in zip((self.x, self.y), self._columns, strict=True)
        ]

    @property
    def _columns(self) -> list[tuple[float, ...]]:
        return list(zip(*self.points, strict=True))

    @property
    def drawn(self) -> tuple[float, float, str]:
        """Width and height of the diagram, followed by the curve as an SVG path.

        If both signals have the same unit, both axes have the same scale.
        """
        (left, right), (low, high) = (widened(min(c), max(c)) for c in self._columns)
        x_scale, y_scale = _PATH_SIZE / (right - left), _PATH_SIZE / (high - low)
        if self.x[1] == self.y[1]:
            x_scale = y_scale = min(x_scale, y_scale)
        step = -(-len(self.points) // _PATH_POINTS)
        kept = (*self.points[:-1:step], self.points[-1])
        places = (f"{(x - left) * x_scale:.4g} {(high - y) * y_scale:.4g}" for x, y in kept)
        size = (right - left) * x_scale, (high - low) * y_scale
        return max(size[0], 8), max(size[1], 8), f"M{'L'.join(places)}"


def run_page(
    record: bench_report.TestRecord,
    run: bench_report.RunEnvironment,
    wires: Sequence[Sequence[str]],
    paths: Sequence[PagePath] = (),
) -> str:
    """Return the HTML page about one run of a bench.

    Args:
        record: the run, in the form of a test record. `record.nodeid` is the title of the page, and
            `record.reason` is the result of the run.
        run: environment and settings of the run.
        wires: table of the wires: the name of a wire, its address for hosts, its rate, and its
            devices.
        paths: diagrams with one signal on the x axis and another signal on the y axis.
    """
    (place,) = overview.reported([record])
    (shown,) = _on_page([place], _PAGE_BYTES)
    return _template("run.html").render(
        record=record, test=shown, run=run, wires=wires, paths=[one for one in paths if one.points]
    )


def _on_page(places: Sequence[overview.ReportedTest], room_bytes: int) -> Iterator[_TestOnPage]:
    tests = [place.record for place in places]
    timelines = [timeline_of(test) for test in tests]
    admitted = _PageRoom(tests, timelines, room_bytes).admitted
    unwell = sum(test.outcome in overview.UNWELL for test in tests)
    for number, place in enumerate(places):
        parts = {part for part in _PagePart if (number, part) in admitted}
        opened = place.record.outcome in overview.UNWELL and unwell <= _MOST_OPEN
        yield _test_on_page(place, timelines[number], parts, opened)


def _test_on_page(
    place: overview.ReportedTest, timeline: Timeline | None, parts: set[_PagePart], opened: bool
) -> _TestOnPage:
    test = place.record
    lines = test.journal[-_JOURNAL_LINES:]
    return _TestOnPage(
        place,
        timeline if _PagePart.TIMELINE in parts else None,
        _cut(test.longrepr, _TEXT_BYTES)[0] if _PagePart.TEXT in parts else "",
        lines if _PagePart.JOURNAL in parts else (),
        test.journal_left_out + len(test.journal) - len(lines),
        _cut(test.trace, _TRACE_BYTES)[0] if _PagePart.TRACE in parts else "",
        tuple(_left_out(test, timeline, parts)),
        opened,
    )


def _left_out(
    test: bench_report.TestRecord, timeline: Timeline | None, parts: set[_PagePart]
) -> Iterator[str]:
    """Yield descriptions of the parts of a test that are not on the page."""
    texts = (
        (_PagePart.TEXT, "the text", test.longrepr, _TEXT_BYTES),
        (_PagePart.TRACE, "the trace", test.trace, _TRACE_BYTES),
    )
    for part, name, text, most in texts:
        if text and part not in parts:
            yield f"{name}, {page_text.size(len(text))}"
        elif missing := _cut(text, most)[1]:
            yield f"the last {page_text.size(missing)} of {name}"
    if timeline and _PagePart.TIMELINE not in parts:
        yield "the plots"
    if test.journal and _PagePart.JOURNAL not in parts:
        yield counted(len(test.journal), "journal line")
