"""What every picture of curves needs: decimated curves and the ranges of the axes.

>>> ticks(0.0, 1.0, 2)
((0.0, '0.0'), (0.5, '0.5'), (1.0, '1.0'))
"""

from __future__ import annotations

import json
import re
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from math import ceil, floor, log10
from pathlib import Path
from typing import Final, NamedTuple

from tickrig.host.canmon.model.graph.series import Series, View

_SMALLEST: Final = 1e-200
"""What is smaller counts as 0."""

_Tick = tuple[float, str]
"""Where, and what is written there."""


def ticks(low: float, high: float, about: int) -> tuple[_Tick, ...]:
    """Return round numbers between two others.

    Args:
        low: the least.
        high: the greatest, above `low`.
        about: how many are wanted; there are at most twice as many and one.
    """
    exponent, step = _step(low, high, max(1, about))
    digits = max(0, -exponent)
    numbers = [n * step for n in range(ceil(low / step), floor(high / step) + 1)]
    return tuple((number, _number_text(number, digits)) for number in numbers)


def widened(low: float, high: float) -> tuple[float, float]:
    """Return a range wide enough for floats to tell its ends apart."""
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


class Bar(NamedTuple):
    """The samples of one column.

    Attributes:
        first: the earliest value, which a line comes from the left to,
        low: the least,
        high: the greatest,
        last: the latest, which a line leaves from.
    """

    first: float
    low: float
    high: float
    last: float


def decimate(series: Series, from_us: int, to_us: int, columns: int) -> list[Bar | None]:
    """Return what lies in each of so many columns of equal time; None where nothing does.

    Args:
        series: the samples.
        from_us: where the first column begins.
        to_us: the last time of the last column.
        columns: how many, at least 1.
    """
    at_us, values = series.at_us, series.values
    span_us = max(1, to_us + 1 - from_us)
    begin = bisect_left(at_us, from_us)
    bars: list[Bar | None] = []
    for column in range(1, columns + 1):
        end = bisect_left(at_us, from_us - (-span_us * column // columns), begin)
        piece = values[begin:end]
        bars.append(Bar(piece[0], min(piece), max(piece), piece[-1]) if piece else None)
        begin = end
    return bars


class Stop(NamedTuple):
    """One stop of a curve: a column, and what lies in it.

    Attributes:
        x: number of the column; outside the picture for the neighbours of what is seen.
        bar: its values.
    """

    x: int
    bar: Bar


@dataclass(frozen=True, slots=True)
class Curve:
    """A curve as it is drawn: from stop to stop.

    Attributes:
        label: what people call it.
        axis: its vertical axis.
        unit: of its values.
        stops: from left to right.
    """

    label: str
    axis: int
    unit: str
    stops: tuple[Stop, ...]


@dataclass(frozen=True, slots=True)
class Chart:
    """All curves of a picture.

    Attributes:
        view: what is seen.
        columns: how many columns the picture has.
        curves: in the order in which they were asked for.
        ranges: least and greatest value by axis, in the order of the axes.
    """

    view: View
    columns: int
    curves: tuple[Curve, ...]
    ranges: dict[int, tuple[float, float]]


def chart(series: Sequence[Series], view: View, columns: int) -> Chart:
    """Bring series into so many columns; a spike stays, however short it is."""
    curves = tuple(
        Curve(one.label, one.axis, one.unit, _stops(one, view, columns)) for one in series
    )
    axes = sorted({curve.axis for curve in curves})
    ranges = {axis: view.ranges.get(axis) or _range(curves, axis, columns) for axis in axes}
    return Chart(view, columns, curves, ranges)


def _stops(series: Series, view: View, columns: int) -> tuple[Stop, ...]:
    bars = decimate(series, view.from_us, view.to_us, columns)
    seen = series.between(view.from_us, view.to_us)
    inside = [Stop(x, bar) for x, bar in enumerate(bars) if bar is not None]
    left = [_outside(series, seen.start - 1, view, columns)] if seen.start else []
    right = [_outside(series, seen.stop, view, columns)] if seen.stop < len(series) else []
    return (*left, *inside, *right)


def _outside(series: Series, index: int, view: View, columns: int) -> Stop:
    value = series.values[index]
    x = (series.at_us[index] - view.from_us) * columns // (view.span_us + 1)
    return Stop(x, Bar(value, value, value, value))


def _range(curves: Sequence[Curve], axis: int, columns: int) -> tuple[float, float]:
    stops = [stop for curve in curves if curve.axis == axis for stop in curve.stops]
    seen = [stop.bar for stop in stops if 0 <= stop.x < columns] or [stop.bar for stop in stops]
    low = min((bar.low for bar in seen), default=0.0)
    return widened(low, max((bar.high for bar in seen), default=low))


# Curves as one HTML page: the SVG, and a cursor that reads out the values.

COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Of the curves, in turn; people who see few colours tell them apart (Okabe and Ito)."""

_AXIS_WIDTH: Final = 64
_LEGEND_HEIGHT: Final = 20
_BOTTOM: Final = 28
_STYLE: Final = (
    "text{font:12px sans-serif;fill:#444}.grid{stroke:#ddd}.frame{fill:none;stroke:#888}"
    ".curve{fill:none;stroke-width:1.3;stroke-linejoin:round}.cursor{stroke:#888}"
)


class _Area(NamedTuple):
    """Where the curves are, in pixels."""

    left: int
    top: int
    width: int
    height: int


def _area_of(axes: int, curves: int, width: int, height: int) -> _Area:
    """Return what remains for the curves beside axes and legend: 50 pixels at least."""
    left = _AXIS_WIDTH
    right = _AXIS_WIDTH * max(0, axes - 1) + 16
    top = _LEGEND_HEIGHT * curves + 8
    return _Area(left, top, max(50, width - left - right), max(50, height - top - _BOTTOM))


def svg(series: Sequence[Series], view: View, width: int = 960, height: int = 400) -> str:
    """Return a picture of so many pixels; the first axis is on the left, others on the right."""
    axes = len({one.axis for one in series})
    area = _area_of(axes, len(series), width, height)
    drawn = chart(series, view, area.width)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}"'
        f' width="{width}" height="{height}">',
        f"<style>{_STYLE}</style>",
        '<rect width="100%" height="100%" fill="#fff"/>',
        f'<clipPath id="area">{_rect(area)}</clipPath>',
        *_time_axis(view, area),
        *_value_axes(drawn, area),
        f'<g clip-path="url(#area)">{"".join(_curves(drawn, area))}</g>',
        *_legend(drawn.curves),
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


def _time_axis(view: View, area: _Area) -> Iterator[str]:
    low, high = view.seconds(view.from_us), view.seconds(view.to_us)
    bottom = area.top + area.height
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


def _legend(curves: Sequence[Curve]) -> Iterator[str]:
    for number, curve in enumerate(curves):
        unit = f" [{curve.unit}]" if curve.unit else ""
        axis = f" (axis {curve.axis})" if curve.axis > 1 else ""
        y = _LEGEND_HEIGHT * (number + 1) - 3
        yield _text_element(
            _AXIS_WIDTH, y, "start", f"━ {curve.label}{unit}{axis}", COLOURS[number % len(COLOURS)]
        )


def _cursor(view: View, area: _Area) -> str:
    if view.cursor_us is None:
        return ""
    x = area.left + (view.cursor_us - view.from_us) / view.span_us * area.width
    return f'<path class="cursor" d="M{x:.1f} {area.top}v{area.height}"/>'


_PAGE: Final = Path(__file__).with_name("page.html")
"""With `@title@`, `@svg@` and `@data@` where these stand."""


def html_page(
    series: Sequence[Series], view: View, width: int = 960, height: int = 400, title: str = "canmon"
) -> str:
    """Return a page that needs nothing else; what is read out are the values of a column."""
    area = _area_of(len({one.axis for one in series}), len(series), width, height)
    curves = [
        {
            "label": curve.label,
            "unit": curve.unit,
            "stops": [(x, float(f"{bar.last:.7g}")) for x, bar in curve.stops],
        }
        for curve in chart(series, view, area.width).curves
    ]
    data = {
        "left": area.left,
        "top": area.top,
        "height": area.height,
        "columns": area.width,
        "from": view.seconds(view.from_us),
        "span": view.span_us / 1e6,
        "curves": curves,
    }
    text = json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")
    parts = {"title": escape(title), "svg": svg(series, view, width, height), "data": text}
    return re.sub("@(title|svg|data)@", lambda place: parts[place[1]], _PAGE.read_text("utf-8"))
