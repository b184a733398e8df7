"""Events of a test on one time axis: faults, actions, physical values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, NamedTuple

from tickrig.emulators.testing.report import bench_report
from tickrig.host.canmon.model.graph.plot import ticks, widened
from tickrig.host.text.page_text import DASH
from tickrig.host.text.values import counted

# The axis of time that faults, actions and values of a test share.
#
# Positions are per cent of it, and so fit any width.

_WIDE: Final = 25
"""Width that a text needs, in per cent of the axis, even on a phone."""


class TimeAxis(NamedTuple):
    """The span of time on the horizontal axis of a bench report's diagrams.

    Attributes:
        from_us: beginning of the span, in microseconds.
        to_us: end of the span, which is later than its beginning.
    """

    from_us: int
    to_us: int

    def part(self, at_us: int) -> float:
        """Return the position of a time on the axis, in per cent from the left.

        A time outside the axis is at its left or right end.
        """
        part = (at_us - self.from_us) * 100 / (self.to_us - self.from_us)
        return round(min(max(part, 0), 100), 2)

    @property
    def ticks(self) -> list[tuple[float, str]]:
        """Places and labels (in seconds) of round times."""
        marks = ticks(self.from_us / 1e6, self.to_us / 1e6, 5)
        return [(self.part(round(second * 1e6)), text) for second, text in marks]


class TimeSpan(NamedTuple):
    """A bar on the time axis of a bench report: a fault, or a value of a signal.

    Attributes:
        left: position of the left end, in per cent of the axis.
        width: width of the bar, in per cent of the axis.
        text: text of the bar.
    """

    left: float
    width: float
    text: str

    @property
    def place(self) -> str:
        """Place that has room for the text: `inside`, `behind` or `before`."""
        if self.width >= _WIDE:
            return "inside"
        return "behind" if self.left + self.width <= 100 - _WIDE else "before"


# How a signal is drawn: a curve in a field of `_WIDTH` times `_HEIGHT`, or its words.

_WIDTH: Final = 1000
_HEIGHT: Final = 100
_MOST_POINTS: Final = 800
"""Largest number of points of a curve; more points are not visible."""
_MOST_WORDS: Final = 200
_WORD_CHARACTERS: Final = 80
CURVE_PX: Final = 64
SWITCH_PX: Final = 32
_SWITCH: Final[tuple[float, float]] = (0, 1)
"""The scale of a signal that is on or off."""


@dataclass(frozen=True, slots=True)
class Lane:
    """One signal in the timeline of a bench report: a curve of numbers, or a row of words.

    Attributes:
        name: name of the signal.
        unit: unit of the numbers.
        path: curve of the signal as an SVG path, or empty for words.
        words: values of the signal if its values are words. If the signal has the same number all
            the time, this number is the only word.
        low: least number.
        high: greatest number.
        scale: numbers at the lower and the upper edge of the diagram.
        zero: distance of zero from the top, in per cent, or None if zero is at an edge or outside.
        rows: values for a table: first, least, greatest and last value, and number of samples.
    """

    name: str
    unit: str
    path: str
    words: tuple[TimeSpan, ...]
    low: str
    high: str
    scale: tuple[float, float]
    zero: float | None
    rows: tuple[str, ...]

    @property
    def constant(self) -> bool:
        """Whether the signal never changed."""
        return not self.path and len(self.words) == 1

    @property
    def height(self) -> int:
        """Height of the picture in pixels; signals that are on or off need little."""
        return SWITCH_PX if self.scale == _SWITCH else CURVE_PX


def _lane_of(series: bench_report.SignalSeries, axis: TimeAxis) -> Lane:
    """Return the lane of a signal with samples on an axis."""
    values = [value for _, value in series.points if value is not None]
    numbers = [value for value in values if not isinstance(value, str)]
    if not numbers or len(numbers) < len(values):
        words = tuple(_words(series.points, axis))
        return Lane(series.name, "", "", words, "", "", (0, 0), None, _row(series.points, []))
    if min(numbers) == max(numbers) and len(values) == len(series.points):
        return _constant(series, axis)
    low, high = widened(min(numbers), max(numbers))
    path = _path(series.points, axis, (low, high), series.steps)
    zero = round(_height(0, (low, high)), 2) if low < 0 < high else None
    least, greatest = _text_of(min(numbers)), _text_of(max(numbers))
    rows = _row(series.points, numbers)
    return Lane(series.name, series.unit, path, (), least, greatest, (low, high), zero, rows)


def _constant(series: bench_report.SignalSeries, axis: TimeAxis) -> Lane:
    """Return a lane with a number that stays."""
    value = series.points[0][1]
    text = f"{_text_of(value)} {series.unit}".rstrip()
    left = axis.part(series.points[0][0])
    words = (TimeSpan(left, round(100 - left, 2), text),)
    row = _row(series.points, [value] if isinstance(value, int | float) else [])
    return Lane(series.name, series.unit, "", words, "", "", (0, 0), None, row)


def _row(points: Sequence[bench_report.Point], numbers: Sequence[float]) -> tuple[str, ...]:
    ends = (min(numbers), max(numbers)) if numbers else (None, None)
    cells = points[0][1], *ends, points[-1][1]
    return (*map(_text_of, cells), f"{len(points)}")


def _text_of(value: bench_report.Value) -> str:
    """Return a value as readable text."""
    if isinstance(value, float):
        return f"{value:.6g}"
    return DASH if value is None else str(value)[:_WORD_CHARACTERS]


def _words(points: Sequence[bench_report.Point], axis: TimeAxis) -> Iterator[TimeSpan]:
    """Yield one span for each value that stays for a while."""
    changes = [points[0]]
    changes += [now for before, now in pairwise(points) if now[1] != before[1]]
    changes = bench_report.thinned(changes, _MOST_WORDS)
    for (at_us, value), (until_us, _) in pairwise([*changes, (axis.to_us, None)]):
        left = axis.part(at_us)
        if value is not None:
            yield TimeSpan(left, round(axis.part(until_us) - left, 2), _text_of(value))


def _path(
    points: Sequence[bench_report.Point], axis: TimeAxis, scale: tuple[float, float], steps: bool
) -> str:
    parts: list[str] = []
    before = ""
    for at_us, value in bench_report.thinned(points, _MOST_POINTS):
        x = f"{axis.part(at_us) * _WIDTH / 100:g}"
        y = f"{_height(value, scale):.4g}" if isinstance(value, int | float) else ""
        if not before:
            parts += [f"M{x} {y}"] if y else []
        elif not steps:
            parts += [f"L{x} {y}"] if y else []
        elif y != before:
            parts += [f"H{x}", f"V{y}"] if y else [f"H{x}"]
        before = y
    if steps and before:
        parts.append(f"H{_WIDTH}")
    return "".join(parts)


def _height(value: float, scale: tuple[float, float]) -> float:
    """Return the distance of a value from the top; halved values avoid an infinite difference."""
    low, high = scale
    return (high / 2 - value / 2) / (high / 2 - low / 2) * _HEIGHT


_MOST_FAULTS: Final = 40
_MOST_EVENTS: Final = 200
_MOST_LANES: Final = 40
_EVENT_CHARACTERS: Final = 200
_ACTION: Final = "!"
_MISS: Final = "?"


class _TimelineEvent(NamedTuple):
    """An event without a duration.

    Attributes:
        left: place of the event, in per cent.
        text: description of the event.
        missed: whether the event is a missed expectation.
    """

    left: float
    text: str
    missed: bool


@dataclass(frozen=True, slots=True)
class Timeline:
    """Timeline of a test in a bench report: faults, events and signals on a common time axis.

    Attributes:
        axis: the displayed span of time.
        faults: the faults that occurred.
        events: actions, and missed expectations.
        lanes: the signals.
        left_out: texts with the number of faults, or of signals, that are not drawn, such as
            `3 faults`.
    """

    axis: TimeAxis
    faults: tuple[TimeSpan, ...]
    events: tuple[_TimelineEvent, ...]
    lanes: tuple[Lane, ...]
    left_out: tuple[str, ...]

    @property
    def size(self) -> int:
        """Approximate number of characters that the time line needs on a page."""
        lanes = sum(len(lane.path) + 400 * len(lane.words) + 1_200 for lane in self.lanes)
        bands = len(self.faults) * len(self.lanes) * 80
        return lanes + bands + 300 * (len(self.events) + len(self.faults))


def timeline_of(test: bench_report.TestRecord) -> Timeline | None:
    """Return the timeline of a test, or None if the test has neither signals nor faults."""
    if not (test.series or test.faults):
        return None
    axis = _axis_of(test)
    came = [fault for fault in test.faults if fault.from_us is not None]
    drawn = [series for series in test.series if series.points]
    many = ((len(came) - _MOST_FAULTS, "fault"), (len(drawn) - _MOST_LANES, "signal"))
    return Timeline(
        axis,
        tuple(_fault_span(fault, axis) for fault in came[:_MOST_FAULTS]),
        tuple(_events(test.journal, axis)),
        tuple(_lane_of(series, axis) for series in drawn[:_MOST_LANES]),
        tuple(counted(number, noun) for number, noun in many if number > 0),
    )


def _axis_of(test: bench_report.TestRecord) -> TimeAxis:
    times = [at_us for series in test.series for at_us, _ in series.points]
    for fault in test.faults:
        times += [at_us for at_us in (fault.from_us, fault.to_us) if at_us is not None]
    end_us = test.virtual_us or 0
    to_us = end_us or max(times, default=0)
    from_us = min(times, default=0)
    if from_us < to_us / 2:
        from_us = min(0, from_us)
    return TimeAxis(from_us, max(to_us, from_us + 1))


def _fault_span(fault: bench_report.PlannedFault, axis: TimeAxis) -> TimeSpan:
    left = axis.part(fault.from_us or 0)
    right = 100.0 if fault.to_us is None else axis.part(fault.to_us)
    return TimeSpan(left, round(right - left, 2), fault.name[:_WORD_CHARACTERS])


def _events(
    journal: Sequence[bench_report.JournalLine], axis: TimeAxis
) -> Iterator[_TimelineEvent]:
    seen = [line for line in journal if line.mark in (_ACTION, _MISS)][-_MOST_EVENTS:]
    for line in seen:
        yield _TimelineEvent(
            axis.part(line.at_us), line.text[:_EVENT_CHARACTERS], line.mark == _MISS
        )
