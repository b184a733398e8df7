"""What every picture of curves needs: decimated curves and the ranges of the axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from tickrig.host.monitor.graph.decimate import Bar, decimate
from tickrig.host.monitor.graph.drawing.ticks import widened
from tickrig.host.monitor.graph.series import Series
from tickrig.host.monitor.graph.view import View


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
