"""Curves in a terminal, drawn with braille dots.

>>> canvas = Canvas(2, 1)
>>> for x in range(4):
...     canvas.fill(x, x, x)
>>> [text for text, _ in canvas.row(0)]
['⠑', '⢄']
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from enum import StrEnum
from itertools import groupby
from typing import Final, NamedTuple, assert_never

from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.graph.chart import Chart, Curve, chart, ticks
from tickrig.host.canmon.model.graph.series import LEAST_US, Collector, Series, View
from tickrig.host.canmon.model.graph.signal_spec import CurveSpec
from tickrig.host.text.page_text import one_line

DOTS_X: Final = 2
DOTS_Y: Final = 4

_BLANK: Final = 0x2800
_LEFT: Final = (0x01, 0x02, 0x04, 0x40)
_RIGHT: Final = (0x08, 0x10, 0x20, 0x80)


def _letter(dots: int) -> str:
    rows = range(DOTS_Y)
    left = sum(_LEFT[row] for row in rows if dots >> row & 1)
    right = sum(_RIGHT[row] for row in rows if dots >> row + DOTS_Y & 1)
    return chr(_BLANK + left + right) if dots else " "


_LETTERS: Final = tuple(_letter(dots) for dots in range(256))
"""By the dots of the left column, then those of the right one, from the top."""


class Canvas:
    """A field of dots in layers; a cell takes the colour of the topmost layer with dots in it.

    Args:
        width: in cells.
        height: in cells.
        layers: how many.
    """

    def __init__(self, width: int, height: int, layers: int = 1) -> None:
        self.width, self.height = width, height
        self._layers = [[0] * (width * DOTS_X) for _ in range(layers)]

    def fill(self, x: int, top: int, bottom: int, layer: int = 0) -> None:
        """Set the dots of a column from one row to another, both included; what is outside is cut.

        Args:
            x: column of dots, within the canvas.
            top: row of dots, 0 at the top.
            bottom: row of dots, not above `top`.
            layer: on which layer.
        """
        top, bottom = max(0, top), min(self.height * DOTS_Y - 1, bottom)
        if top <= bottom:
            self._layers[layer][x] |= (1 << bottom + 1) - (1 << top)

    def row(self, row: int) -> list[tuple[str, int]]:
        """Return the letters of a row of cells, each with its layer, -1 where there is none."""
        shift, cells = row * DOTS_Y, []
        for x in range(0, self.width * DOTS_X, DOTS_X):
            dots, top = 0, -1
            for number, layer in enumerate(self._layers):
                if here := layer[x] >> shift & 0xF | (layer[x + 1] >> shift & 0xF) << DOTS_Y:
                    dots, top = dots | here, number
            cells.append((_LETTERS[dots], top))
        return cells


class Reading(NamedTuple):
    """A curve at a moment.

    Attributes:
        label: of the curve.
        value: of the latest sample at or before the moment; None before the first.
        age_us: how old that sample is.
        unit: of the value.
    """

    label: str
    value: float | None
    age_us: int
    unit: str

    def __str__(self) -> str:
        """Write it for people."""
        value = "-" if self.value is None else f"{self.value:.6g}"
        return f"{self.label} {value} {self.unit}".rstrip()


def read_out(series: Iterable[Series], at_us: int) -> tuple[Reading, ...]:
    """Return what each series last said at a moment: a signal holds until its next frame."""
    return tuple(_reading(one, at_us) for one in series)


def _reading(series: Series, at_us: int) -> Reading:
    index = series.before(at_us)
    if index is None:
        return Reading(series.label, None, 0, series.unit)
    age_us = at_us - series.at_us[index]
    return Reading(series.label, series.values[index], age_us, series.unit)


_COLOURS: Final = (36, 33, 35, 32, 34, 31)
"""ANSI codes of the curves, in turn."""

LABEL_WIDTH: Final = 9
"""Letters left of the first axis and right of the second."""

_LEAST_WIDTH: Final = 2 * LABEL_WIDTH + 12
_LEAST_HEIGHT: Final = 6


def render(
    series: Sequence[Series], view: View, width: int, height: int, *, colour: bool = False
) -> list[str]:
    """Return the picture as lines, as many as it is high and none longer than it is wide.

    The first lines name the curves; the second axis is written on the right. A smaller size than
    30 by 6 is taken as that.

    Args:
        series: the curves.
        view: what is seen; with a cursor, the first lines say the values there.
        width: in cells.
        height: in lines.
        colour: colour the curves with ANSI codes.
    """
    width, height = max(width, _LEAST_WIDTH), max(height, _LEAST_HEIGHT)
    names = _names(series, view.cursor_us, width, colour)[: height - 5]
    two_axes = len({one.axis for one in series}) > 1
    inner = width - LABEL_WIDTH * (1 + two_axes) - 1
    rows = height - len(names) - 2
    drawn = chart(series, view, inner * DOTS_X)
    canvas = _drawn(drawn, inner, rows)
    marked = None if view.cursor_us is None else _cell(view.cursor_us, view, inner)
    left, right = (_labels(drawn, number, rows) for number in (0, 1))
    lines = [
        f"{left.get(row, ''):>{LABEL_WIDTH}}{'┤' if row in left else '│'}"
        f"{_painted(canvas.row(row), marked, colour)}{right.get(row, '')}"
        for row in range(rows)
    ]
    return [*names, *lines, *_time_axis(view, inner)]


def _names(series: Sequence[Series], cursor_us: int | None, width: int, colour: bool) -> list[str]:
    at_us = max((one.at_us[-1] for one in series if one.at_us), default=0)
    readings = read_out(series, at_us if cursor_us is None else cursor_us)
    lines = []
    for number, (one, reading) in enumerate(zip(series, readings, strict=True)):
        axis = f"  (axis {one.axis})" if one.axis > 1 else ""
        text = one_line(f"━ {reading}{axis}")[:width]
        lines.append(_coloured(text, number) if colour else text)
    return lines


def _drawn(drawn: Chart, width: int, height: int) -> Canvas:
    canvas = Canvas(width, height, max(1, len(drawn.curves)))
    for layer, curve in enumerate(drawn.curves):
        low, high = drawn.ranges[curve.axis]
        per_value = (height * DOTS_Y - 1) / (high - low)
        _draw(canvas, layer, curve, high, per_value)
    return canvas


def _draw(canvas: Canvas, layer: int, curve: Curve, high: float, per_value: float) -> None:
    columns = canvas.width * DOTS_X

    def row(value: float) -> int:
        return round((high - value) * per_value)

    before: tuple[int, int] | None = None
    for x, bar in curve.stops:
        first = row(bar.first)
        if before is not None:
            _join(canvas, layer, before, (x, first))
        if 0 <= x < columns:
            canvas.fill(x, row(bar.high), row(bar.low), layer)
        before = x, row(bar.last)


def _join(canvas: Canvas, layer: int, start: tuple[int, int], end: tuple[int, int]) -> None:
    """Draw a line; the dots of a column reach to those of the column before."""
    (x0, y0), (x1, y1) = start, end
    for x in range(max(0, x0 + 1), min(x1 + 1, canvas.width * DOTS_X)):
        above, here = (y0 + (y1 - y0) * (column - x0) // (x1 - x0) for column in (x - 1, x))
        step = 0 if above == here else 1 if here > above else -1
        top, bottom = sorted((above + step, here))
        canvas.fill(x, top, bottom, layer)


def _painted(cells: list[tuple[str, int]], marked: int | None, colour: bool) -> str:
    if marked is not None and cells[marked][0] == " ":
        cells[marked] = ("│", -1)
    if not colour:
        return "".join(letter for letter, _ in cells)
    runs = groupby(cells, key=lambda cell: cell[1])
    texts = ((layer, "".join(letter for letter, _ in run)) for layer, run in runs)
    return "".join(_coloured(text, layer) if layer >= 0 else text for layer, text in texts)


def _coloured(text: str, number: int) -> str:
    return f"\x1b[{_COLOURS[number % len(_COLOURS)]}m{text}\x1b[0m"


def _labels(drawn: Chart, number: int, rows: int) -> dict[int, str]:
    """Return what is written beside which row for the first or the second axis."""
    ranges = list(drawn.ranges.values())
    if number >= len(ranges):
        return {}
    low, high = ranges[number]
    per_value = (rows * DOTS_Y - 1) / (high - low)
    places = (
        (round((high - value) * per_value) // DOTS_Y, text)
        for value, text in ticks(low, high, max(2, rows // 3))
    )
    return {row: text[:LABEL_WIDTH] for row, text in places}


def _time_axis(view: View, inner: int) -> list[str]:
    low, high = (view.seconds(at_us) for at_us in (view.from_us, view.to_us))
    rule, text = ["─"] * inner, ""
    for second, label in ticks(low, high, max(2, inner // 14)):
        cell = _cell(view.origin_us + round(second * 1e6), view, inner)
        start = LABEL_WIDTH + 1 + cell - len(label) // 2
        if len(text) < start and start + len(label) < inner + LABEL_WIDTH:
            rule[cell] = "┬"
            text = text.ljust(start) + label
    return [" " * LABEL_WIDTH + "└" + "".join(rule), text + " s"]


def _cell(at_us: int, view: View, inner: int) -> int:
    """Return the column of cells of a moment, the nearest that there is."""
    cell = (at_us - view.from_us) * inner // (view.span_us + 1)
    return min(max(cell, 0), inner - 1)


# Curves that go on, and which part of them is seen: driven by frames, keys and the time.


MOST: Final = 200_000
"""Samples of a signal that are kept."""

_WINDOW_US: Final = 10_000_000
_COLUMNS: Final = 200
"""In how many columns the range of an axis is looked for."""


class ViewMode(StrEnum):
    """What is seen."""

    LIVE = "live"  # a window that ends now
    ALL = "all"  # all samples
    HELD = "held"  # a span of time that stands still


class LiveGraph:
    """Takes the values of signals, and shows them.

    Args:
        mode: what is seen at first.

    Attributes:
        words: the signals.
        mode: what is seen.
        window_us: how long the window is that ends now.
        cursor_us: a moment that is read out, None for none.
        axis: the vertical axis that is stretched and moved.
        now_us: the time of the frames, as it was told last.
    """

    def __init__(self, mode: ViewMode = ViewMode.LIVE) -> None:
        self.words: list[CurveSpec] = []
        self.mode, self.window_us, self.axis = mode, _WINDOW_US, 1
        self.cursor_us: int | None = None
        self.now_us = 0
        self._collector = Collector((), None)
        self._ranges: dict[int, tuple[float, float]] = {}
        self._held, self._origin_us = View(0, _WINDOW_US), 0

    @property
    def series(self) -> list[Series]:
        """The samples of each signal."""
        return self._collector.series

    def add(self, word: CurveSpec, past: Iterable[tuple[Record, Decoded | None]] = ()) -> None:
        """Show one more signal; its values in frames of the past are taken, too."""
        fresh = Collector([word], None, MOST)
        for record, decoded in past:
            fresh.take_decoded(record, decoded)
        self._collector.join(fresh)
        self.words.append(word)

    def remove(self, number: int) -> None:
        """Show a signal no more."""
        self._collector.remove(number)
        del self.words[number]

    def take(self, record: Record, decoded: Decoded | None) -> None:
        """Take the values in a frame."""
        self._collector.take_decoded(record, decoded)

    def clear(self) -> None:
        """Forget all samples."""
        for series in self.series:
            series.clear()

    def view(self) -> View:
        """Return what is seen now."""
        whole = View.of(self.series)
        if not self._origin_us or whole.to_us < self._origin_us:
            self._origin_us = whole.origin_us
        match self.mode:
            case ViewMode.LIVE:
                view = View(self.now_us - self.window_us, self.now_us)
            case ViewMode.ALL:
                view = whole
            case ViewMode.HELD:
                view = self._held
            case _ as never:
                assert_never(never)
        return replace(
            view, ranges=self._ranges, cursor_us=self.cursor_us, origin_us=self._origin_us
        )

    def render(self, width: int, height: int) -> list[str]:
        """Return the picture as lines with ANSI colours."""
        return render(self.series, self.view(), width, height, colour=True)

    def show(self, mode: str) -> None:
        """See something else, without the cursor; `HELD` stops what is seen now."""
        self._held = self.view()
        self.mode, self.cursor_us = ViewMode(mode), None

    def zoom(self, factor: float) -> None:
        """Come closer by a factor: to the end of a live window, else to the cursor or middle."""
        if self.mode is ViewMode.LIVE:
            self.window_us = max(LEAST_US, round(self.window_us / factor))
            return
        self._hold(self.view().zoomed(factor, self.cursor_us))

    def move(self, fraction: float) -> None:
        """Move what is seen by a fraction of it, later for a positive one."""
        self._hold(self.view().moved(fraction))

    def move_cursor(self, fraction: float) -> None:
        """Move the cursor by a fraction of what is seen, which stops; it begins in the middle."""
        view = self.view()
        middle_us = (view.from_us + view.to_us) // 2
        at_us = middle_us if self.cursor_us is None else self.cursor_us
        at_us += round(view.span_us * fraction)
        self.cursor_us = min(max(at_us, view.from_us), view.to_us)
        self._hold(view)

    def next_axis(self) -> None:
        """Choose the next vertical axis that a signal has."""
        axes = sorted({word.axis for word in self.words}) or [1]
        self.axis = next((axis for axis in axes if axis > self.axis), axes[0])

    def stretch(self, factor: float) -> None:
        """Come closer to the middle of the axis by a factor."""
        low, high = self._range()
        middle, half = (low + high) / 2, (high - low) / 2 / factor
        self._set_range(middle - half, middle + half)

    def lift(self, fraction: float) -> None:
        """Move the axis by a fraction of its range, higher for a positive one."""
        low, high = self._range()
        by = (high - low) * fraction
        self._set_range(low + by, high + by)

    def fit(self) -> None:
        """Let the range of the axis be that of what is seen."""
        self._ranges.pop(self.axis, None)

    def _hold(self, view: View) -> None:
        self._held, self.mode = view, ViewMode.HELD

    def _range(self) -> tuple[float, float]:
        return chart(self.series, self.view(), _COLUMNS).ranges.get(self.axis, (0.0, 1.0))

    def _set_range(self, low: float, high: float) -> None:
        if low < high:  # floats have an end
            self._ranges = {**self._ranges, self.axis: (low, high)}
