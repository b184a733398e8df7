"""What happened in a test on one axis of time: faults, actions, physical values.

Positions are per cent of the axis and so fit any width; curves are paths in a field of
`WIDTH` times `HEIGHT`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, NamedTuple

from tickrig.emulators.testing.report.bench_report import (
    JournalLine,
    PlannedFault,
    SignalSeries,
    TestRecord,
    Value,
)
from tickrig.emulators.testing.report.page_text import DASH
from tickrig.emulators.testing.report.thinning import Point, thinned
from tickrig.host.monitor.graph.chart import ticks, widened

WIDTH: Final = 1000
HEIGHT: Final = 100
WIDE: Final = 25
"""Per cent of the axis on which a text has room, even on a phone."""
MOST_POINTS: Final = 1_200
"""Of a curve; more cannot be seen."""
MOST_WORDS: Final = 200
MOST_EVENTS: Final = 200
ACTION: Final = "!"
MISS: Final = "?"


class Axis(NamedTuple):
    """The span of time that is shown.

    Attributes:
        from_us: its beginning,
        to_us: its end, later.
    """

    from_us: int
    to_us: int

    def part(self, at_us: int) -> float:
        """Return where a time is, in per cent from the left; what is outside is at the edge."""
        part = (at_us - self.from_us) * 100 / (self.to_us - self.from_us)
        return round(min(max(part, 0), 100), 2)

    @property
    def ticks(self) -> list[tuple[float, str]]:
        """Round times: where, and what is written there, in seconds."""
        marks = ticks(self.from_us / 1e6, self.to_us / 1e6, 5)
        return [(self.part(round(second * 1e6)), text) for second, text in marks]


class Span(NamedTuple):
    """Something that lasted.

    Attributes:
        left: where it begins, in per cent.
        width: in per cent.
        text: what it was.
    """

    left: float
    width: float
    text: str

    @property
    def place(self) -> str:
        """Where its text has room: `inside`, `behind` or `before`."""
        if self.width >= WIDE:
            return "inside"
        return "behind" if self.left + self.width <= 100 - WIDE else "before"


class Event(NamedTuple):
    """Something at a moment.

    Attributes:
        left: where, in per cent.
        text: what it was.
        missed: it was an expectation that was missed.
    """

    left: float
    text: str
    missed: bool


@dataclass(frozen=True, slots=True)
class Lane:
    """A signal on the axis.

    Attributes:
        name: of the signal.
        unit: of its numbers.
        path: its curve, empty for words.
        words: its values, if they are words, or its only number.
        low: its least number,
        high: its greatest one.
        zero: how far from the top zero is, in per cent; None if it is at an edge or outside.
        rows: what a table tells: first, least, greatest and last value, number of samples.
    """

    name: str
    unit: str
    path: str
    words: tuple[Span, ...]
    low: str
    high: str
    scale: tuple[float, float]
    zero: float | None
    rows: tuple[str, ...]

    @property
    def constant(self) -> bool:
        """It never changed."""
        return not self.path and len(self.words) == 1


@dataclass(frozen=True, slots=True)
class Timeline:
    """Everything of a test that has a time.

    Attributes:
        axis: the span of time.
        faults: those that came.
        waiting: faults that never came.
        events: actions, and expectations that were missed.
        lanes: the signals.
    """

    axis: Axis
    faults: tuple[Span, ...]
    waiting: tuple[PlannedFault, ...]
    events: tuple[Event, ...]
    lanes: tuple[Lane, ...]

    @property
    def size(self) -> int:
        """About how many characters a page needs for it."""
        lanes = sum(len(lane.path) + 120 * len(lane.words) + 1_200 for lane in self.lanes)
        bands = len(self.faults) * len(self.lanes) * 80
        return lanes + bands + 120 * (len(self.events) + len(self.faults))


def timeline_of(test: TestRecord) -> Timeline | None:
    """Return the time line of a test, None if there is nothing on it."""
    if not (test.series or test.faults):
        return None
    axis = _axis_of(test)
    came = [fault for fault in test.faults if fault.from_us is not None]
    return Timeline(
        axis,
        tuple(_fault_span(fault, axis) for fault in came),
        tuple(fault for fault in test.faults if fault.from_us is None),
        tuple(_events(test.journal, axis)),
        tuple(_lane(series, axis) for series in test.series if series.points),
    )


def _axis_of(test: TestRecord) -> Axis:
    times = [at_us for series in test.series for at_us, _ in series.points]
    for fault in test.faults:
        times += [at_us for at_us in (fault.from_us, fault.to_us) if at_us is not None]
    end_us = test.virtual_us or 0
    to_us = end_us or max(times, default=0)
    from_us = min(times, default=0)
    if from_us < to_us / 2:
        from_us = min(0, from_us)
    return Axis(from_us, max(to_us, from_us + 1))


def _fault_span(fault: PlannedFault, axis: Axis) -> Span:
    left = axis.part(fault.from_us or 0)
    right = 100.0 if fault.to_us is None else axis.part(fault.to_us)
    return Span(left, round(right - left, 2), fault.name)


def _events(journal: Sequence[JournalLine], axis: Axis) -> Iterator[Event]:
    seen = [line for line in journal if line.mark in (ACTION, MISS)][-MOST_EVENTS:]
    for line in seen:
        yield Event(axis.part(line.at_us), line.text, line.mark == MISS)


def _lane(series: SignalSeries, axis: Axis) -> Lane:
    values = [value for _, value in series.points if value is not None]
    numbers = [value for value in values if not isinstance(value, str)]
    if not numbers or len(numbers) < len(values):
        words = tuple(_words(series.points, axis))
        return Lane(series.name, "", "", words, "", "", (0, 0), None, _row(series.points, []))
    if min(numbers) == max(numbers) and len(values) == len(series.points):
        return _constant(series, axis)
    low, high = widened(min(numbers), max(numbers))
    path = _path(series.points, axis, (low, high), series.steps)
    zero = round(high / (high - low) * 100, 2) if low < 0 < high else None
    least, greatest = text_of(min(numbers)), text_of(max(numbers))
    rows = _row(series.points, numbers)
    return Lane(series.name, series.unit, path, (), least, greatest, (low, high), zero, rows)


def _constant(series: SignalSeries, axis: Axis) -> Lane:
    """Return a lane that says a number once."""
    value = series.points[0][1]
    text = f"{text_of(value)} {series.unit}".rstrip()
    left = axis.part(series.points[0][0])
    words = (Span(left, round(100 - left, 2), text),)
    row = _row(series.points, [value] if isinstance(value, int | float) else [])
    return Lane(series.name, series.unit, "", words, "", "", (0, 0), None, row)


def _row(points: Sequence[Point], numbers: Sequence[float]) -> tuple[str, ...]:
    ends = (min(numbers), max(numbers)) if numbers else (None, None)
    cells = points[0][1], *ends, points[-1][1]
    return (*map(text_of, cells), f"{len(points)}")


def text_of(value: Value) -> str:
    """Write a value for people."""
    if isinstance(value, float):
        return f"{value:.6g}"
    return DASH if value is None else str(value)


def _words(points: Sequence[Point], axis: Axis) -> Iterator[Span]:
    """Yield one span for each value that stays for a while."""
    changes = [points[0]]
    changes += [now for before, now in pairwise(points) if now[1] != before[1]]
    changes = thinned(changes, MOST_WORDS)
    for (at_us, value), (until_us, _) in pairwise([*changes, (axis.to_us, None)]):
        left = axis.part(at_us)
        if value is not None:
            yield Span(left, round(axis.part(until_us) - left, 2), text_of(value))


def _path(points: Sequence[Point], axis: Axis, scale: tuple[float, float], steps: bool) -> str:
    low, high = scale
    parts: list[str] = []
    down = False
    for at_us, value in thinned(points, MOST_POINTS):
        x = f"{axis.part(at_us) * WIDTH / 100:g}"
        if steps and down:
            parts.append(f"H{x}")
        if isinstance(value, int | float):
            y = f"{(high - value) / (high - low) * HEIGHT:.4g}"
            parts.append((f"V{y}" if steps else f"L{x} {y}") if down else f"M{x} {y}")
        down = isinstance(value, int | float)
    if steps and down:
        parts.append(f"H{WIDTH}")
    return "".join(_merged(parts))


def _merged(parts: Iterable[str]) -> Iterator[str]:
    """Leave out what draws nothing new."""
    before = ""
    for part in parts:
        if part != before:
            yield part
        before = part
