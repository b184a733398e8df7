"""Files with curves: SVG and HTML, PNG through matplotlib (extra `plot`), and CSV."""

from __future__ import annotations

import csv
import heapq
from collections.abc import Iterator, Sequence
from io import BytesIO
from itertools import cycle, groupby
from operator import itemgetter
from pathlib import Path
from typing import Any, BinaryIO, Final, TextIO

from tickrig.host.canmon.model.graph.plot import (
    COLOURS,
    Band,
    Chart,
    Curve,
    chart,
    html_page,
    state_colour,
    svg,
)
from tickrig.host.canmon.model.graph.series import Series, View
from tickrig.host.cli.messages import Refused, SourceFailed
from tickrig.host.text.whole_file import replacing, write_whole


def write_csv(file: TextIO, series: Sequence[Series], view: View) -> None:
    """Write the visible samples of curves as CSV, with a row per time and a column per curve.

    A cell is empty if a curve has no sample at that time. If a curve has several samples at that
    time, the last sample is written. Times are seconds with six decimals, as in the log.
    """
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(["t_s", *(_heading(one) for one in series)])
    samples = heapq.merge(*(_samples(number, one, view) for number, one in enumerate(series)))
    for at_us, group in groupby(samples, key=itemgetter(0)):
        cells: list[str | float] = [""] * len(series)
        for _, number, _, value in group:
            shown = int(value) if value.is_integer() else value
            cells[number] = series[number].name(value) or shown
        writer.writerow([f"{at_us // 1_000_000}.{at_us % 1_000_000:06d}", *cells])


def _heading(drawn: Series | Curve) -> str:
    return f"{drawn.label} [{drawn.unit}]" if drawn.unit else drawn.label


def _samples(number: int, series: Series, view: View) -> Iterator[tuple[int, int, int, float]]:
    """Yield time, number of the series, number of the sample, and value, in sorting order."""
    seen = series.between(view.from_us, view.to_us)
    for index in range(seen.start, seen.stop):
        yield series.at_us[index], number, index, series.values[index]


_DPI: Final = 100
_AXIS_SHARE: Final = 0.09
"""Share of the width for each axis beyond the second one."""
_LEAST_HEIGHT, _BAND_HEIGHT = 250, 45
"""Least height in pixels of a picture with states, and height of each row of states."""
_LETTER: Final = 8
"""Width of a letter in pixels."""
_MARGIN: Final = 0.03
"""Share of an axis that is left free above and below its curves."""


def write_png(  # noqa: PLR0913, PLR0917 - what is drawn, and how
    file: BinaryIO,
    series: Sequence[Series],
    view: View,
    width: int = 960,
    height: int = 400,
    title: str = "",
) -> None:
    """Write a picture of this size in pixels.

    Raises:
        ImportError: matplotlib is not installed.
    """
    from matplotlib.figure import Figure  # noqa: PLC0415 - an extra, and slow

    drawn = chart(series, view, width)
    if drawn.bands:  # what is too low for all of them is made higher
        height = max(height, _LEAST_HEIGHT + _BAND_HEIGHT * len(drawn.bands))
    figure = Figure(figsize=(width / _DPI, height / _DPI), dpi=_DPI, layout="constrained")
    curves, states = bool(drawn.curves or not drawn.bands), len(drawn.bands)
    ratios = [*[6.0] * curves, *[1.0] * states]
    grid = figure.add_gridspec(len(ratios), 1, height_ratios=ratios)
    first = figure.add_subplot(grid[0])
    strips = [first] * (not curves)
    strips += [figure.add_subplot(grid[place]) for place in range(1, len(ratios))]
    for band, strip in zip(drawn.bands, strips, strict=True):
        _draw_band(strip, band, drawn)
    first.set_title(title, loc="left", fontsize="small")
    first.grid(visible=True, alpha=0.4)
    axes = {axis: first.twinx() if number else first for number, axis in enumerate(drawn.ranges)}
    for number, (axis, (low, high)) in enumerate(drawn.ranges.items()):
        margin = (high - low) * _MARGIN
        axes[axis].set_ylim(low - margin, high + margin)
        if number > 1:
            axes[axis].spines["right"].set_position(("axes", 1 + _AXIS_SHARE * (number - 1)))
    lines = []
    for curve, colour in zip(drawn.curves, cycle(COLOURS), strict=False):
        times, values = _points(curve, drawn)
        lines += axes[curve.axis].plot(
            times, values, label=_heading(curve), color=colour, linewidth=1.2
        )
    for one in {first, *strips}:
        one.set_xlim(view.seconds(view.from_us), view.seconds(view.to_us))
        one.tick_params(labelbottom=False)
    lowest = strips[-1] if strips else first
    lowest.tick_params(labelbottom=True)
    lowest.set_xlabel("s")
    if view.cursor_us is not None:
        first.axvline(view.seconds(view.cursor_us), color="#888888", linewidth=1)
    if lines:
        figure.legend(handles=lines, loc="outside upper left", ncols=3)
    figure.savefig(file, format="png")


def _draw_band(strip: Any, band: Band, drawn: Chart) -> None:
    """Draw states as a row of rectangles with their names."""
    strip.set_yticks([])
    strip.set_ylabel(band.label, rotation=0, ha="right", va="center")
    for run in band.runs:
        begin, end = (_second(drawn, column) for column in (run.begin, run.end))
        strip.axvspan(begin, end, color=state_colour(band, run.name))
        if (run.end - run.begin) > _LETTER * len(run.name):
            strip.text(
                begin, 0.5, f" {run.name}", va="center", transform=strip.get_xaxis_transform()
            )


def _second(drawn: Chart, column: int) -> float:
    view = drawn.view
    return view.seconds(view.from_us) + column * view.span_us / drawn.columns / 1e6


def _points(curve: Curve, drawn: Chart) -> tuple[list[float], list[float]]:
    times: list[float] = []
    values: list[float] = []
    for x, bar in curve.stops:
        times += [_second(drawn, x)] * len(bar)
        values += bar
    return times, values


_KINDS: Final = (".svg", ".html", ".png", ".csv")


def check_graph_path(path: Path) -> None:
    """Raise Refused if the name of a file indicates no known format."""
    if path.suffix.lower() not in _KINDS:
        raise Refused(f"-o {path}: a graph is written as {', '.join(_KINDS)}")


def write_graph(
    path: Path, series: Sequence[Series], view: View, size: tuple[int, int], title: str = ""
) -> None:
    """Write curves into a file in the format that its suffix indicates, such as PNG or CSV.

    Args:
        path: path of the file. Its suffix is one of `_KINDS`.
        series: samples of the curves.
        view: part of the curves to show.
        size: width and height of a picture in pixels.
        title: title of a picture.

    Raises:
        Refused: the file is a PNG, which needs matplotlib, and matplotlib is not installed.
        SourceFailed: the file cannot be written.
    """
    try:
        _write(path, series, view, size, title)
    except OSError as error:
        raise SourceFailed(f"{path}: {error.strerror}") from error
    except ImportError:
        raise Refused(f"{path}: PNG needs matplotlib: pip install 'tickrig[plot]'") from None


def _write(
    path: Path, series: Sequence[Series], view: View, size: tuple[int, int], title: str
) -> None:
    match path.suffix.lower():
        case ".svg":
            write_whole(path, svg(series, view, *size, title))
        case ".html":
            write_whole(path, html_page(series, view, *size, title=title or path.stem))
        case ".csv":
            with replacing(path) as beside, beside.open("w", encoding="utf-8", newline="") as file:
                write_csv(file, series, view)
        case _:
            picture = BytesIO()
            write_png(picture, series, view, *size, title)
            write_whole(path, picture.getvalue())
