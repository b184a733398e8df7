"""How a signal is drawn: a curve in a field of `WIDTH` times `HEIGHT`, or its words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from tickrig.emulators.testing.report.axis import Axis, Span
from tickrig.emulators.testing.report.bench_report import SignalSeries, Value
from tickrig.emulators.testing.report.thinning import Point, thinned
from tickrig.host.canmon.model.graph.chart import widened
from tickrig.host.text.page_text import DASH

WIDTH: Final = 1000
HEIGHT: Final = 100
MOST_POINTS: Final = 800
"""Of a curve; more cannot be seen."""
MOST_WORDS: Final = 200
WORD_CHARACTERS: Final = 80
CURVE_PX: Final = 64
SWITCH_PX: Final = 32
SWITCH: Final[tuple[float, float]] = (0, 1)
"""The scale of what is on or off."""


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
        scale: the numbers at the lower and the upper edge of the field.
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

    @property
    def height(self) -> int:
        """How high its picture is, in pixels; switches need little."""
        return SWITCH_PX if self.scale == SWITCH else CURVE_PX


def lane_of(series: SignalSeries, axis: Axis) -> Lane:
    """Return how a signal with samples is drawn on an axis."""
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
    return DASH if value is None else str(value)[:WORD_CHARACTERS]


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
    parts: list[str] = []
    before = ""
    for at_us, value in thinned(points, MOST_POINTS):
        x = f"{axis.part(at_us) * WIDTH / 100:g}"
        y = f"{_height(value, scale):.4g}" if isinstance(value, int | float) else ""
        if not before:
            parts += [f"M{x} {y}"] if y else []
        elif not steps:
            parts += [f"L{x} {y}"] if y else []
        elif y != before:
            parts += [f"H{x}", f"V{y}"] if y else [f"H{x}"]
        before = y
    if steps and before:
        parts.append(f"H{WIDTH}")
    return "".join(parts)


def _height(value: float, scale: tuple[float, float]) -> float:
    """Return how far a value is from the top; halves, for their difference is never infinite."""
    low, high = scale
    return (high / 2 - value / 2) / (high / 2 - low / 2) * HEIGHT
