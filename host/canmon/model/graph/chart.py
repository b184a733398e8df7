"""What every picture of curves needs: decimated curves and the ranges of the axes.

>>> ticks(0.0, 1.0, 2)
((0.0, '0.0'), (0.5, '0.5'), (1.0, '1.0'))
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, floor, log10
from typing import Final, NamedTuple

from tickrig.host.canmon.model.graph.series import Series, View

SMALLEST: Final = 1e-200
"""What is smaller counts as 0."""

Tick = tuple[float, str]
"""Where, and what is written there."""


def ticks(low: float, high: float, about: int) -> tuple[Tick, ...]:
    """Return round numbers between two others.

    Args:
        low: the least.
        high: the greatest, above `low`.
        about: how many are wanted; there are at most twice as many and one.
    """
    exponent, step = _step(low, high, max(1, about))
    digits = max(0, -exponent)
    numbers = [n * step for n in range(ceil(low / step), floor(high / step) + 1)]
    return tuple((number, _text(number, digits)) for number in numbers)


def widened(low: float, high: float) -> tuple[float, float]:
    """Return a range wide enough for floats to tell its ends apart."""
    size = max(abs(low), abs(high))
    if high - low > max(size * 1e-12, SMALLEST):
        return low, high
    margin = size * 0.1 if size > SMALLEST else 1.0
    return low - margin, high + margin


def _step(low: float, high: float, about: int) -> tuple[int, float]:
    rough = (high - low) / about
    exponent = floor(log10(rough))
    mantissa = rough / 10.0**exponent
    factor = next(factor for factor in (1, 2, 5, 10) if mantissa <= factor * 1.000001)
    if factor == 10:
        factor, exponent = 1, exponent + 1
    return exponent, factor * 10.0**exponent


def _text(number: float, digits: int) -> str:
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
