"""Curves as PNG, through matplotlib (the extra `plot`)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from typing import BinaryIO, Final

from tickrig.host.monitor.graph.chart import Chart, Curve, chart
from tickrig.host.monitor.graph.series import Series, View
from tickrig.host.monitor.graph.svg import COLOURS

DPI: Final = 100
AXIS_SHARE: Final = 0.09
"""Of the width, for each axis beyond the second."""
MARGIN: Final = 0.03
"""Of an axis, above and below its curves."""


def write_png(
    file: BinaryIO, series: Sequence[Series], view: View, width: int = 960, height: int = 400
) -> None:
    """Write a picture of so many pixels.

    Raises:
        ImportError: matplotlib is not there.
    """
    from matplotlib.figure import Figure  # noqa: PLC0415 - an extra, and slow

    figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI, layout="constrained")
    drawn = chart(series, view, width)
    first = figure.add_subplot()
    first.grid(visible=True, alpha=0.4)
    axes = {axis: first.twinx() if number else first for number, axis in enumerate(drawn.ranges)}
    for number, (axis, (low, high)) in enumerate(drawn.ranges.items()):
        margin = (high - low) * MARGIN
        axes[axis].set_ylim(low - margin, high + margin)
        if number > 1:
            axes[axis].spines["right"].set_position(("axes", 1 + AXIS_SHARE * (number - 1)))
    lines = []
    for curve, colour in zip(drawn.curves, cycle(COLOURS), strict=False):
        label = f"{curve.label} [{curve.unit}]" if curve.unit else curve.label
        times, values = _points(curve, drawn)
        lines += axes[curve.axis].plot(times, values, label=label, color=colour, linewidth=1.2)
    first.set_xlim(view.seconds(view.from_us), view.seconds(view.to_us))
    first.set_xlabel("s")
    if view.cursor_us is not None:
        first.axvline(view.seconds(view.cursor_us), color="#888888", linewidth=1)
    if lines:
        figure.legend(handles=lines, loc="outside upper left", ncols=3)
    figure.savefig(file, format="png")


def _points(curve: Curve, drawn: Chart) -> tuple[list[float], list[float]]:
    view = drawn.view
    times: list[float] = []
    values: list[float] = []
    for x, bar in curve.stops:
        second = view.seconds(view.from_us) + x * view.span_us / drawn.columns / 1e6
        times += [second] * len(bar)
        values += bar
    return times, values
