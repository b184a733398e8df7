"""Curves as one HTML page: the SVG, and a cursor that reads out the values."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from html import escape
from typing import Final, NamedTuple

from tickrig.host.canmon.model.graph.chart import Chart, Curve, chart, ticks
from tickrig.host.canmon.model.graph.series import Series, View

COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Of the curves, in turn; people who see few colours tell them apart (Okabe and Ito)."""

AXIS_WIDTH: Final = 64
LEGEND_HEIGHT: Final = 20
BOTTOM: Final = 28
STYLE: Final = (
    "text{font:12px sans-serif;fill:#444}.grid{stroke:#ddd}.frame{fill:none;stroke:#888}"
    ".curve{fill:none;stroke-width:1.3;stroke-linejoin:round}.cursor{stroke:#888}"
)


class Area(NamedTuple):
    """Where the curves are, in pixels."""

    left: int
    top: int
    width: int
    height: int


def area_of(axes: int, curves: int, width: int, height: int) -> Area:
    """Return what remains for the curves beside axes and legend: 50 pixels at least."""
    left = AXIS_WIDTH
    right = AXIS_WIDTH * max(0, axes - 1) + 16
    top = LEGEND_HEIGHT * curves + 8
    return Area(left, top, max(50, width - left - right), max(50, height - top - BOTTOM))


def svg(series: Sequence[Series], view: View, width: int = 960, height: int = 400) -> str:
    """Return a picture of so many pixels; the first axis is on the left, others on the right."""
    axes = len({one.axis for one in series})
    area = area_of(axes, len(series), width, height)
    drawn = chart(series, view, area.width)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}"'
        f' width="{width}" height="{height}">',
        f"<style>{STYLE}</style>",
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


def _rect(area: Area, more: str = "") -> str:
    left, top, width, height = area
    return f'<rect x="{left}" y="{top}" width="{width}" height="{height}"{more}/>'


def _text(x: float, y: float, anchor: str, text: str, colour: str = "") -> str:
    fill = f' style="fill:{colour}"' if colour else ""
    return f'<text x="{x:g}" y="{y:g}" text-anchor="{anchor}"{fill}>{escape(text)}</text>'


def _time_axis(view: View, area: Area) -> Iterator[str]:
    low, high = view.seconds(view.from_us), view.seconds(view.to_us)
    bottom = area.top + area.height
    for second, label in ticks(low, high, max(2, area.width // 100)):
        x = round(area.left + (second - low) / (high - low) * area.width, 1)
        yield f'<path class="grid" d="M{x:g} {area.top}V{bottom}"/>'
        yield _text(x, bottom + 18, "middle", f"{label} s")


def _value_axes(drawn: Chart, area: Area) -> Iterator[str]:
    for number, (axis, (low, high)) in enumerate(drawn.ranges.items()):
        owners = [n for n, curve in enumerate(drawn.curves) if curve.axis == axis]
        colour = COLOURS[owners[0] % len(COLOURS)] if len(drawn.ranges) > 1 else ""
        right = area.left + area.width + AXIS_WIDTH * (number - 1)
        x, anchor = (area.left - 6, "end") if number == 0 else (right + 6, "start")
        for value, label in ticks(low, high, max(2, area.height // 50)):
            y = round(area.top + (high - value) / (high - low) * area.height, 1)
            if number == 0:
                yield f'<path class="grid" d="M{area.left} {y:g}h{area.width}"/>'
            yield _text(x, y + 4, anchor, label, colour)


def _curves(drawn: Chart, area: Area) -> Iterator[str]:
    for number, curve in enumerate(drawn.curves):
        colour = COLOURS[number % len(COLOURS)]
        path = "L".join(_points(curve, drawn.ranges[curve.axis], area))
        title = f"<title>{escape(curve.label)}</title>"
        yield f'<path class="curve" stroke="{colour}" d="{path and "M"}{path}">{title}</path>'


def _points(curve: Curve, shown: tuple[float, float], area: Area) -> list[str]:
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
        y = LEGEND_HEIGHT * (number + 1) - 3
        yield _text(
            AXIS_WIDTH, y, "start", f"━ {curve.label}{unit}{axis}", COLOURS[number % len(COLOURS)]
        )


def _cursor(view: View, area: Area) -> str:
    if view.cursor_us is None:
        return ""
    x = area.left + (view.cursor_us - view.from_us) / view.span_us * area.width
    return f'<path class="cursor" d="M{x:.1f} {area.top}v{area.height}"/>'


_PAGE: Final = """\
<!doctype html>
<html lang="en">
<meta charset="utf-8">
<title>{title}</title>
<style>body{{margin:1em;font:14px sans-serif}}svg{{max-width:100%;height:auto}}</style>
{svg}<pre id="values">Move over the picture to read the values.</pre>
<script>
"use strict";
const graph = {data};
const svg = document.querySelector("svg");
const line = document.createElementNS(svg.namespaceURI, "path");
line.setAttribute("class", "cursor");
svg.append(line);
svg.addEventListener("mousemove", event => {{
  const point = new DOMPoint(event.clientX, event.clientY);
  const x = Math.round(point.matrixTransform(svg.getScreenCTM().inverse()).x) - graph.left;
  if (x < 0 || x >= graph.columns) return;
  line.setAttribute("d", `M${{x + graph.left}} ${{graph.top}}v${{graph.height}}`);
  const second = graph.from + x / graph.columns * graph.span;
  const values = graph.curves.map(curve => {{
    const held = curve.stops.filter(stop => stop[0] <= x).pop();
    return `${{curve.label}} ${{held ? held[1] : "-"}} ${{curve.unit}}`;
  }});
  const lines = [`${{second.toFixed(6)}} s`, ...values];
  document.getElementById("values").textContent = lines.join("\\n");
}});
</script>
</html>
"""


def html_page(
    series: Sequence[Series], view: View, width: int = 960, height: int = 400, title: str = "canmon"
) -> str:
    """Return a page that needs nothing else; what is read out are the values of a column."""
    area = area_of(len({one.axis for one in series}), len(series), width, height)
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
    return _PAGE.format(title=escape(title), svg=svg(series, view, width, height), data=text)
