"""Curves in a terminal, drawn with braille dots.

>>> canvas = Canvas(2, 1)
>>> for x in range(4):
...     canvas.fill(x, x, x)
>>> [text for text, _ in canvas.row(0)]
['⠑', '⢄']

>>> ticks(0.0, 1.0, 2)
((0.0, '0.0'), (0.5, '0.5'), (1.0, '1.0'))
"""

from __future__ import annotations

import json
import re
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from html import escape
from itertools import groupby
from math import ceil, floor, log10
from pathlib import Path
from typing import Final, NamedTuple, assert_never

from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.frames import Record, Stamp, date_text, seconds_text
from tickrig.host.canmon.model.graph.series import LEAST_US, Collector, CurveSpec, Series, View
from tickrig.host.text.page_text import one_line

# Data for every picture of curves: decimated curves and the ranges of the axes.


_SMALLEST: Final = 1e-200
"""Amount below which a number counts as 0."""

_Tick = tuple[float, str]
"""Position of a tick, and its text."""


def ticks(low: float, high: float, about: int) -> tuple[_Tick, ...]:
    """Return round numbers within a range, each with its text, as labels of an axis.

    Args:
        low: lower limit of the range.
        high: upper limit of the range, greater than `low`.
        about: approximate number of labels. The result has at most 2 * `about` + 1 labels.
    """
    exponent, step = _step(low, high, max(1, about))
    digits = max(0, -exponent)
    numbers = [n * step for n in range(ceil(low / step), floor(high / step) + 1)]
    return tuple((number, _number_text(number, digits)) for number in numbers)


def widened(low: float, high: float) -> tuple[float, float]:
    """Return a range that is wide enough for floats to distinguish its ends."""
    size = max(abs(low), abs(high))
    if high - low > max(size * 1e-12, _SMALLEST):
        return low, high
    margin = size * 0.1 if size > _SMALLEST else 1.0
    return low - margin, high + margin


def _step(low: float, high: float, about: int) -> tuple[int, float]:
    rough = (high - low) / about
    exponent = floor(log10(rough))
    mantissa = rough / 10.0**exponent
    factor = next(factor for factor in (1, 2, 5, 10) if mantissa <= factor * 1.000001)
    if factor == 10:
        factor, exponent = 1, exponent + 1
    return exponent, factor * 10.0**exponent


def _number_text(number: float, digits: int) -> str:
    if digits > 6 or abs(number) >= 1e7:
        return f"{number:.6g}"
    return f"{number:.{digits}f}" if round(number, digits) else f"{0:.{digits}f}"


class _Bar(NamedTuple):
    """The samples of one column of the picture.

    Attributes:
        first: earliest value. The line from the left ends at this value.
        low: least value.
        high: greatest value.
        last: latest value. The line to the right starts at this value.
    """

    first: float
    low: float
    high: float
    last: float


def decimate(series: Series, from_us: int, to_us: int, columns: int) -> list[_Bar | None]:
    """Reduce the samples of a signal to one bar for each column of a picture.

    A bar holds the first, least, greatest and last value in the column. A column without samples is
    None.

    Args:
        series: samples of the signal.
        from_us: time at the start of the first column in microseconds.
        to_us: time at the end of the last column in microseconds.
        columns: number of columns, at least 1. Each covers the same time.
    """
    at_us, values = series.at_us, series.values
    span_us = max(1, to_us + 1 - from_us)
    begin = bisect_left(at_us, from_us)
    bars: list[_Bar | None] = []
    for column in range(1, columns + 1):
        end = bisect_left(at_us, from_us - (-span_us * column // columns), begin)
        piece = values[begin:end]
        bars.append(_Bar(piece[0], min(piece), max(piece), piece[-1]) if piece else None)
        begin = end
    return bars


class _Stop(NamedTuple):
    """One stop of a curve, which is a column with its values.

    Attributes:
        x: number of the column. The number is outside the picture for the neighbours of the visible
            columns.
        bar: values in the column.
    """

    x: int
    bar: _Bar


@dataclass(frozen=True, slots=True)
class Curve:
    """The curve of a signal with numeric values, reduced to one entry for each picture column.

    Attributes:
        label: displayed name of the curve.
        axis: number of the vertical axis that the curve belongs to, from 1.
        unit: unit of the values.
        stops: one entry for each column of the picture with samples, from left to right. An entry
            holds the number of the column, and the values of the curve in this column.
    """

    label: str
    axis: int
    unit: str
    stops: tuple[_Stop, ...]


class _StateRun(NamedTuple):
    """A state that lasts for some columns.

    Attributes:
        begin: first column of the state.
        end: column after the last column of the state.
        name: name of the state.
    """

    begin: int
    end: int
    name: str


@dataclass(frozen=True, slots=True)
class Band:
    """A horizontal bar in a picture that shows the states of a signal one after the other.

    A signal such as the NMT state, whose values are states, is drawn as a band and not as a curve.

    Attributes:
        label: displayed name of the signal.
        runs: states with their columns, from left to right.
    """

    label: str
    runs: tuple[_StateRun, ...]


@dataclass(frozen=True, slots=True)
class Chart:
    """All curves and bands of a graph, ready to be drawn in a terminal or as SVG.

    Attributes:
        view: time span and ranges of the axes that are visible.
        columns: width of the picture in columns.
        curves: curves of the signals with numeric values, in the requested order.
        bands: bands of the signals whose values are states, in the requested order.
        ranges: least and greatest value on each vertical axis, by number of the axis.
    """

    view: View
    columns: int
    curves: tuple[Curve, ...]
    bands: tuple[Band, ...]
    ranges: dict[int, tuple[float, float]]


def chart(series: Sequence[Series], view: View, columns: int) -> Chart:
    """Reduce series to columns. A spike stays visible, however short it is."""
    curves = tuple(
        Curve(one.label, one.axis, one.unit, _stops(one, view, columns))
        for one in series
        if one.names is None
    )
    bands = tuple(
        Band(one.label, tuple(_runs(one, view, columns))) for one in series if one.names is not None
    )
    axes = sorted({curve.axis for curve in curves})
    ranges = {axis: view.ranges.get(axis) or _range(curves, axis, columns) for axis in axes}
    return Chart(view, columns, curves, bands, ranges)


def _stops(series: Series, view: View, columns: int) -> tuple[_Stop, ...]:
    bars = decimate(series, view.from_us, view.to_us, columns)
    seen = series.between(view.from_us, view.to_us)
    inside = [_Stop(x, bar) for x, bar in enumerate(bars) if bar is not None]
    left = [_outside(series, seen.start - 1, view, columns)] if seen.start else []
    right = [_outside(series, seen.stop, view, columns)] if seen.stop < len(series) else []
    return (*left, *inside, *right)


def _runs(series: Series, view: View, columns: int) -> Iterator[_StateRun]:
    """Yield the states in a view. Each state lasts until the next one."""
    begin, name = -1, ""
    first = series.before(view.from_us) or 0
    for index in range(first, len(series)):
        at_us, now = series.at_us[index], series.name(series.values[index])
        if at_us > view.to_us:
            break
        column = max(0, (at_us - view.from_us) * columns // (view.span_us + 1))
        if now != name or begin < 0:
            if column > begin >= 0:
                yield _StateRun(begin, column, name)
            begin, name = column, now
    if begin >= 0:
        yield _StateRun(begin, columns, name)


def _outside(series: Series, index: int, view: View, columns: int) -> _Stop:
    value = series.values[index]
    x = (series.at_us[index] - view.from_us) * columns // (view.span_us + 1)
    return _Stop(x, _Bar(value, value, value, value))


def _range(curves: Sequence[Curve], axis: int, columns: int) -> tuple[float, float]:
    stops = [stop for curve in curves if curve.axis == axis for stop in curve.stops]
    seen = [stop.bar for stop in stops if 0 <= stop.x < columns] or [stop.bar for stop in stops]
    low = min((bar.low for bar in seen), default=0.0)
    return widened(low, max((bar.high for bar in seen), default=low))


# Curves as one HTML page: the SVG, and a cursor that reads out the values.

COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Colours of the curves in turn, which also colour-blind people can distinguish (Okabe and Ito)."""

_AXIS_WIDTH: Final = 64
_LEGEND_HEIGHT: Final = 20
_BOTTOM: Final = 28
_BAND_HEIGHT: Final = 22
_TITLE_HEIGHT: Final = 24
_STATE_COLOURS: Final = ("#b9d3f0", "#f3d58f", "#bfe0dc", "#d9c7ee", "#f2cfa8", "#d5d8dc")
_KNOWN_STATES: Final = {
    "operational": "#9fd3b4",
    "operation enabled": "#9fd3b4",
    "no error": "#dfe9e2",
    "stopped": "#f0b3ad",
    "fault": "#f0b3ad",
    "fault reaction active": "#f0b3ad",
}
_STYLE: Final = (
    "text{font:12px sans-serif;fill:#444}.grid{stroke:#ddd}.frame{fill:none;stroke:#888}"
    ".curve{fill:none;stroke-width:1.3;stroke-linejoin:round}.cursor{stroke:#888}"
)


class _Area(NamedTuple):
    """The area of the curves in pixels."""

    left: int
    top: int
    width: int
    height: int


def _area_of(series: Sequence[Series], width: int, height: int, title: str = "") -> _Area:
    """Return the height of the curves without axes, bands and legend, which is at least 50 pixels.

    With bands it is at least 150 pixels, and the picture grows with the bands.
    """
    curves = [one for one in series if one.names is None]
    left = _AXIS_WIDTH
    right = _AXIS_WIDTH * max(0, len({one.axis for one in curves}) - 1) + 16
    top = _LEGEND_HEIGHT * len(curves) + 8 + _TITLE_HEIGHT * bool(title)
    bands = 2 * _BAND_HEIGHT * (len(series) - len(curves))
    least = 150 if bands else 50
    high = max(least, height - top - _BOTTOM - bands) if curves or not bands else 0
    return _Area(left, top, max(50, width - left - right), high)


def svg(
    series: Sequence[Series], view: View, width: int = 960, height: int = 400, title: str = ""
) -> str:
    """Return a graph of signals as the text of an SVG picture.

    The first vertical axis is on the left, all others are on the right.

    Args:
        series: samples of the signals.
        view: time span and ranges of the axes to show.
        width: width of the picture in pixels.
        height: height in pixels. The picture becomes higher if the bands need more space.
        title: text above the graph, empty for no title.
    """
    area = _area_of(series, width, height, title)
    drawn = chart(series, view, area.width)
    height = max(height, area.top + area.height + 2 * _BAND_HEIGHT * len(drawn.bands) + _BOTTOM)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}"'
        f' width="{width}" height="{height}">',
        f"<style>{_STYLE}</style>",
        '<rect width="100%" height="100%" fill="#fff"/>',
        f'<clipPath id="area">{_rect(area)}</clipPath>',
        _text_element(_AXIS_WIDTH, _TITLE_HEIGHT - 6, "start", title) if title else "",
        *_svg_time_axis(view, area, len(drawn.bands)),
        *(_value_axes(drawn, area) if drawn.curves else ()),
        f'<g clip-path="url(#area)">{"".join(_curves(drawn, area))}</g>',
        *_svg_bands(drawn.bands, area),
        *_legend(drawn.curves, _TITLE_HEIGHT * bool(title)),
        _cursor(view, area),
        _rect(area, ' class="frame"'),
        "</svg>",
    ]
    return "\n".join(part for part in parts if part) + "\n"


def _rect(area: _Area, more: str = "") -> str:
    left, top, width, height = area
    return f'<rect x="{left}" y="{top}" width="{width}" height="{height}"{more}/>'


def _text_element(x: float, y: float, anchor: str, text: str, colour: str = "") -> str:
    fill = f' style="fill:{colour}"' if colour else ""
    return f'<text x="{x:g}" y="{y:g}" text-anchor="{anchor}"{fill}>{escape(text)}</text>'


def state_colour(band: Band, name: str) -> str:
    """Return the colour in which a state of a band is drawn.

    Known states such as `operational` have a fixed colour. The other states of the band get further
    colours, in the order in which the states first appear.

    Args:
        band: band that contains the state.
        name: name of the state.
    """
    names = dict.fromkeys(run.name for run in band.runs if run.name not in _KNOWN_STATES)
    if name not in names:
        return _KNOWN_STATES[name]
    return _STATE_COLOURS[list(names).index(name) % len(_STATE_COLOURS)]


def _svg_bands(bands: Sequence[Band], area: _Area) -> Iterator[str]:
    """Draw states below the curves. The row of states is below the name of its signal."""
    for number, band in enumerate(bands):
        y = area.top + area.height + 2 * _BAND_HEIGHT * number
        yield _text_element(area.left, y + _BAND_HEIGHT - 5, "start", f"▬ {band.label}")
        for run in band.runs:
            yield (
                f'<rect x="{area.left + run.begin}" y="{y + _BAND_HEIGHT}"'
                f' width="{run.end - run.begin}" height="{_BAND_HEIGHT - 4}"'
                f' fill="{state_colour(band, run.name)}"><title>{escape(run.name)}</title></rect>'
            )
            if (run.end - run.begin) > 7 * len(run.name) + 6:
                x = area.left + run.begin + 4
                yield _text_element(x, y + 2 * _BAND_HEIGHT - 9, "start", run.name)


def _svg_time_axis(view: View, area: _Area, bands: int) -> Iterator[str]:
    low, high = view.seconds(view.from_us), view.seconds(view.to_us)
    bottom = area.top + area.height + 2 * _BAND_HEIGHT * bands
    for second, label in ticks(low, high, max(2, area.width // 100)):
        x = round(area.left + (second - low) / (high - low) * area.width, 1)
        yield f'<path class="grid" d="M{x:g} {area.top}V{bottom}"/>'
        yield _text_element(x, bottom + 18, "middle", f"{label} s")


def _value_axes(drawn: Chart, area: _Area) -> Iterator[str]:
    for number, (axis, (low, high)) in enumerate(drawn.ranges.items()):
        owners = [n for n, curve in enumerate(drawn.curves) if curve.axis == axis]
        colour = COLOURS[owners[0] % len(COLOURS)] if len(drawn.ranges) > 1 else ""
        right = area.left + area.width + _AXIS_WIDTH * (number - 1)
        x, anchor = (area.left - 6, "end") if number == 0 else (right + 6, "start")
        for value, label in ticks(low, high, max(2, area.height // 50)):
            y = round(area.top + (high - value) / (high - low) * area.height, 1)
            if number == 0:
                yield f'<path class="grid" d="M{area.left} {y:g}h{area.width}"/>'
            yield _text_element(x, y + 4, anchor, label, colour)


def _curves(drawn: Chart, area: _Area) -> Iterator[str]:
    for number, curve in enumerate(drawn.curves):
        colour = COLOURS[number % len(COLOURS)]
        path = "L".join(_points(curve, drawn.ranges[curve.axis], area))
        title = f"<title>{escape(curve.label)}</title>"
        yield f'<path class="curve" stroke="{colour}" d="{path and "M"}{path}">{title}</path>'


def _points(curve: Curve, shown: tuple[float, float], area: _Area) -> list[str]:
    low, high = shown
    points: list[str] = []
    for x, bar in curve.stops:
        for value in bar:
            y = round(area.top + (high - value) / (high - low) * area.height, 1)
            point = f"{area.left + x} {y:g}"
            if not points or points[-1] != point:
                points.append(point)
    return points


def _legend(curves: Sequence[Curve], top: int = 0) -> Iterator[str]:
    for number, curve in enumerate(curves):
        unit = f" [{curve.unit}]" if curve.unit else ""
        axis = f" (axis {curve.axis})" if curve.axis > 1 else ""
        y = top + _LEGEND_HEIGHT * (number + 1) - 3
        yield _text_element(
            _AXIS_WIDTH, y, "start", f"━ {curve.label}{unit}{axis}", COLOURS[number % len(COLOURS)]
        )


def _cursor(view: View, area: _Area) -> str:
    if view.cursor_us is None:
        return ""
    x = area.left + (view.cursor_us - view.from_us) / view.span_us * area.width
    return f'<path class="cursor" d="M{x:.1f} {area.top}v{area.height}"/>'


_PAGE: Final = Path(__file__).with_name("page.html")
"""Template of a page, in which `@title@`, `@svg@` and `@data@` are replaced."""


def html_page(
    series: Sequence[Series], view: View, width: int = 960, height: int = 400, title: str = "canmon"
) -> str:
    """Return the picture as a self-contained HTML page that also shows values as numbers."""
    area = _area_of(series, width, height, title)
    drawn = chart(series, view, area.width)
    curves: list[dict[str, object]] = [
        {
            "label": curve.label,
            "unit": curve.unit,
            "stops": [(x, float(f"{bar.last:.7g}")) for x, bar in curve.stops],
        }
        for curve in drawn.curves
    ]
    curves += [
        {"label": band.label, "unit": "", "stops": [(run.begin, run.name) for run in band.runs]}
        for band in drawn.bands
    ]
    data = {
        "left": area.left,
        "top": area.top,
        "height": area.height + 2 * _BAND_HEIGHT * len(drawn.bands),
        "columns": area.width,
        "from": view.seconds(view.from_us),
        "span": view.span_us / 1e6,
        "curves": curves,
    }
    text = json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")
    parts = {"title": escape(title), "svg": svg(series, view, width, height, title), "data": text}
    return re.sub("@(title|svg|data)@", lambda place: parts[place[1]], _PAGE.read_text("utf-8"))


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
"""Letters by the dots of the left column and then of the right column, from the top."""


class Canvas:
    """A drawing area for a terminal, in which each character cell consists of braille dots.

    Dots are set in layers, one for each curve. A cell gets the colour of the highest layer that has
    dots in it.

    Args:
        width: width in character cells.
        height: height in character cells.
        layers: number of layers.
    """

    def __init__(self, width: int, height: int, layers: int = 1) -> None:
        self.width, self.height = width, height
        self._layers = [[0] * (width * DOTS_X) for _ in range(layers)]

    def fill(self, x: int, top: int, bottom: int, layer: int = 0) -> None:
        """Draw a vertical line: set the dots of a column from row `top` to row `bottom`.

        Rows outside of the canvas are ignored.

        Args:
            x: number of the column of dots, from 0, within the canvas.
            top: first row of dots to set. Row 0 is at the top.
            bottom: last row of dots to set, not less than `top`.
            layer: number of the layer in which the dots are set.
        """
        top, bottom = max(0, top), min(self.height * DOTS_Y - 1, bottom)
        if top <= bottom:
            self._layers[layer][x] |= (1 << bottom + 1) - (1 << top)

    def row(self, row: int) -> list[tuple[str, int]]:
        """Return a line of the canvas as braille characters, each with the layer that colours it.

        The layer is -1 for a cell without dots.

        Args:
            row: number of the line in the canvas. Line 0 is at the top.
        """
        shift, cells = row * DOTS_Y, []
        for x in range(0, self.width * DOTS_X, DOTS_X):
            dots, top = 0, -1
            for number, layer in enumerate(self._layers):
                if here := layer[x] >> shift & 0xF | (layer[x + 1] >> shift & 0xF) << DOTS_Y:
                    dots, top = dots | here, number
            cells.append((_LETTERS[dots], top))
        return cells


class _Reading(NamedTuple):
    """The value of a curve at a moment.

    Attributes:
        label: name of the curve.
        value: value of the latest sample at or before the moment, or None before the first sample.
        age_us: age of that sample.
        unit: unit of the value.
        state: name of the value if the value is a state.
    """

    label: str
    value: float | None
    age_us: int
    unit: str
    state: str = ""

    def __str__(self) -> str:
        """Return the value as text for the user."""
        value = self.state or ("-" if self.value is None else f"{self.value:.6g}")
        return f"{self.label} {value} {self.unit}".rstrip()


def read_out(series: Iterable[Series], at_us: int) -> tuple[_Reading, ...]:
    """Return the value of each signal at a moment, as shown at the cursor of a graph.

    This is the last value at or before that moment.

    Args:
        series: samples of the signals.
        at_us: moment in microseconds.
    """
    return tuple(_reading(one, at_us) for one in series)


def _reading(series: Series, at_us: int) -> _Reading:
    index = series.before(at_us)
    if index is None:
        return _Reading(series.label, None, 0, series.unit)
    age_us = at_us - series.at_us[index]
    value = series.values[index]
    return _Reading(series.label, value, age_us, series.unit, series.name(value))


_COLOURS: Final = (36, 33, 35, 32, 34, 31)
"""ANSI codes of the curves, in turn."""

LABEL_WIDTH: Final = 9
"""Number of letters left of the first axis and right of the second axis."""

_LEAST_WIDTH: Final = 2 * LABEL_WIDTH + 12
_LEAST_HEIGHT: Final = 6


def render(
    series: Sequence[Series], view: View, width: int, height: int, *, colour: bool = False
) -> list[str]:
    """Return a graph of signals as lines of text for a terminal.

    There are `height` lines, each at most `width` characters long. The first lines are the names of
    the curves. The second vertical axis is on the right. A size below 30 by 6 is increased to 30 by
    6.

    Args:
        series: samples of the signals.
        view: time span and ranges of the axes to show. If it has a cursor, the first lines also
            contain the values at the cursor.
        width: width in characters.
        height: height in lines.
        colour: whether to colour the curves with ANSI escape sequences.
    """
    width, height = max(width, _LEAST_WIDTH), max(height, _LEAST_HEIGHT)
    names = _names(series, view.cursor_us, width, colour)[: height - 5]
    curves = [one for one in series if one.names is None]
    two_axes = len({one.axis for one in curves}) > 1
    inner = width - LABEL_WIDTH * (1 + two_axes) - 1
    drawn = chart(series, view, inner * DOTS_X)
    bands = [_band_line(band, inner, colour) for band in drawn.bands][: height - len(names) - 3]
    rows = height - len(names) - 2 - len(bands)
    canvas = _drawn(drawn, inner, rows)
    marked = None if view.cursor_us is None else _cell(view.cursor_us, view, inner)
    left, right = (_labels(drawn, number, rows) for number in (0, 1))
    lines = [
        f"{left.get(row, ''):>{LABEL_WIDTH}}{'┤' if row in left else '│'}"
        f"{_painted(canvas.row(row), marked, colour)}{right.get(row, '')}"
        for row in range(rows)
    ]
    lines = lines if curves or not bands else []
    return [*names, *lines, *bands, *_time_axis(view, inner)]


def _band_line(band: Band, inner: int, colour: bool) -> str:
    """Return states as a line. Each state begins with a bar, and its name if there is room."""
    cells = [" "] * inner
    for run in band.runs:
        begin, end = run.begin // DOTS_X, max(run.end // DOTS_X, run.begin // DOTS_X + 1)
        text = f"▏{one_line(run.name)}"[: end - begin].ljust(end - begin)
        cells[begin:end] = text[: max(0, inner - begin)]
    line = "".join(cells[:inner])
    label = one_line(band.label)[-LABEL_WIDTH:]
    return f"{label:>{LABEL_WIDTH}}│{_coloured(line, 3) if colour else line}"


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
        _draw(canvas, layer, curve, drawn.ranges[curve.axis])
    return canvas


def _draw(canvas: Canvas, layer: int, curve: Curve, shown: tuple[float, float]) -> None:
    low, high = shown
    columns, per_value = canvas.width * DOTS_X, (canvas.height * DOTS_Y - 1) / (high - low)

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
    """Draw a line. The dots of a column reach to the dots of the previous column."""
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
    """Return the labels of the first or the second axis, by row."""
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
    dated = view.stamp in (Stamp.ABSOLUTE, Stamp.DATE)
    # whole minutes, so that dates have round seconds
    base_us = view.from_us - view.from_us % 60_000_000 if dated else view.origin_us
    low, high = ((at_us - base_us) / 1e6 for at_us in (view.from_us, view.to_us))
    rule, text = ["─"] * inner, ""
    for second, number in ticks(low, high, max(2, inner // (22 if dated else 14))):
        at_us = base_us + round(second * 1e6)
        cell = _cell(at_us, view, inner)
        label = _moment(at_us, view.stamp, len(number.partition(".")[2])) if dated else number
        start = LABEL_WIDTH + 1 + cell - len(label) // 2
        if len(text) < start and start + len(label) < inner + LABEL_WIDTH:
            rule[cell] = "┬"
            text = text.ljust(start) + label
    unit = date_text(view.from_us)[:10] if view.stamp is Stamp.DATE else "s"
    return [" " * LABEL_WIDTH + "└" + "".join(rule), f"{text} {unit}"]


def _moment(at_us: int, stamp: Stamp, digits: int) -> str:
    """Return a moment as text, in seconds of the epoch or as time of day.

    >>> _moment(1_700_000_000_250_000, Stamp.ABSOLUTE, 2)
    '1700000000.25'
    """
    whole, _, fraction = (
        seconds_text(at_us, 1) if stamp is Stamp.ABSOLUTE else date_text(at_us)[11:]
    ).partition(".")
    return f"{whole}.{fraction[:digits]}" if digits else whole


def _cell(at_us: int, view: View, inner: int) -> int:
    """Return the column of cells that is nearest to a moment."""
    cell = (at_us - view.from_us) * inner // (view.span_us + 1)
    return min(max(cell, 0), inner - 1)


# Curves that go on, and which part of them is seen: driven by frames, keys and the time.


MOST: Final = 200_000
"""Number of samples that are kept of a signal."""

_WINDOW_US: Final = 10_000_000
_COLUMNS: Final = 200
"""Number of columns from which the range of an axis is computed."""


class ViewMode(StrEnum):
    """Part of the traffic that is visible."""

    LIVE = "live"  # a window that ends now
    ALL = "all"  # all samples
    HELD = "held"  # a span of time that stands still


class LiveGraph:
    """Graph of signals in a terminal, which the user can zoom and move, as in `canmon tui`.

    Args:
        mode: initial mode of the view: live, all samples, or held.

    Attributes:
        words: signals in the graph.
        mode: current mode of the view.
        window_us: length in microseconds of the time window that a live view shows.
        cursor_us: time of the cursor in microseconds, or None if there is no cursor.
        axis: number of the vertical axis that zooming and moving act on.
        now_us: time of the latest frame in microseconds.
        first_us: time of the first frame in microseconds, or None to count times from the first
            sample.
        stamp: format in which times are written.
    """

    def __init__(self, mode: ViewMode = ViewMode.LIVE) -> None:
        self.words: list[CurveSpec] = []
        self.mode, self.window_us, self.axis = mode, _WINDOW_US, 1
        self.cursor_us: int | None = None
        self.now_us = 0
        self.first_us: int | None = None
        self.stamp = Stamp.ZERO
        self._collector = Collector((), None)
        self._ranges: dict[int, tuple[float, float]] = {}
        self._held, self._origin_us = View(0, _WINDOW_US), 0

    @property
    def series(self) -> list[Series]:
        """The samples of each signal."""
        return self._collector.series

    def add(self, word: CurveSpec, past: Iterable[tuple[Record, Decoded | None]] = ()) -> None:
        """Show one more signal, including its values in the given past frames."""
        fresh = Collector([word], None, MOST)
        for record, decoded in past:
            fresh.take_decoded(record, decoded)
        self._collector.join(fresh)
        self.words.append(word)

    def remove(self, number: int) -> None:
        """Stop showing a signal."""
        self._collector.remove(number)
        del self.words[number]

    def take(self, record: Record, decoded: Decoded | None) -> None:
        """Add the values in a frame."""
        self._collector.take_decoded(record, decoded)

    def clear(self) -> None:
        """Delete all samples."""
        for series in self.series:
            series.clear()

    def view(self) -> View:
        """Return the visible part."""
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
            view,
            ranges=self._ranges,
            cursor_us=self.cursor_us,
            origin_us=self._origin_us if self.first_us is None else self.first_us,
            stamp=self.stamp,
        )

    def render(self, width: int, height: int) -> list[str]:
        """Return the picture as lines with ANSI colours."""
        return render(self.series, self.view(), width, height, colour=True)

    def show(self, mode: str) -> None:
        """Change the mode of the view, and remove the cursor.

        In the mode `HELD`, the view stops at the time span that is visible now.

        Args:
            mode: new mode, a value of `ViewMode`.
        """
        self._held = self.view()
        self.mode, self.cursor_us = ViewMode(mode), None

    def zoom(self, factor: float) -> None:
        """Zoom the time axis.

        In the mode `LIVE`, the length of the window changes, and the window still ends now. In any
        other mode, the view is zoomed around the cursor, or around its middle if there is no
        cursor, and the mode becomes `HELD`.

        Args:
            factor: zoom factor. A factor above 1 zooms in, a factor below 1 zooms out.
        """
        if self.mode is ViewMode.LIVE:
            self.window_us = max(LEAST_US, round(self.window_us / factor))
            return
        self._hold(self.view().zoomed(factor, self.cursor_us))

    def move(self, fraction: float) -> None:
        """Move the view along the time axis. The mode becomes `HELD`, so that a live view stops.

        Args:
            fraction: distance as a fraction of the visible time span. A positive fraction moves to
                later times.
        """
        self._hold(self.view().moved(fraction))

    def move_cursor(self, fraction: float) -> None:
        """Move the cursor along the time axis. The mode becomes `HELD`, so that a live view stops.

        If there is no cursor, a new one starts in the middle of the view.

        Args:
            fraction: distance as a fraction of the visible time span. A positive fraction moves to
                later times.
        """
        view = self.view()
        middle_us = (view.from_us + view.to_us) // 2
        at_us = middle_us if self.cursor_us is None else self.cursor_us
        at_us += round(view.span_us * fraction)
        self.cursor_us = min(max(at_us, view.from_us), view.to_us)
        self._hold(view)

    def next_axis(self) -> None:
        """Select the next vertical axis that has a signal."""
        axes = sorted({word.axis for word in self.words}) or [1]
        self.axis = next((axis for axis in axes if axis > self.axis), axes[0])

    def stretch(self, factor: float) -> None:
        """Zoom the selected vertical axis around its middle value.

        Args:
            factor: zoom factor. A factor above 1 zooms in, a factor below 1 zooms out.
        """
        low, high = self._range()
        middle, half = (low + high) / 2, (high - low) / 2 / factor
        self._set_range(middle - half, middle + half)

    def lift(self, fraction: float) -> None:
        """Move the axis by a fraction of its range. A positive fraction moves to higher values."""
        low, high = self._range()
        by = (high - low) * fraction
        self._set_range(low + by, high + by)

    def fit(self) -> None:
        """Fit the range of the axis to the visible values."""
        self._ranges.pop(self.axis, None)

    def _hold(self, view: View) -> None:
        self._held, self.mode = view, ViewMode.HELD

    def _range(self) -> tuple[float, float]:
        return chart(self.series, self.view(), _COLUMNS).ranges.get(self.axis, (0.0, 1.0))

    def _set_range(self, low: float, high: float) -> None:
        if low < high:  # floats have an end
            self._ranges = {**self._ranges, self.axis: (low, high)}
