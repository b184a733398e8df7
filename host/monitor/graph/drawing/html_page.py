"""Curves as one HTML page: the SVG, and a cursor that reads out the values."""

from __future__ import annotations

import json
from collections.abc import Sequence
from html import escape
from typing import Final

from tickrig.host.monitor.graph.drawing.chart import chart
from tickrig.host.monitor.graph.drawing.svg import area_of, svg
from tickrig.host.monitor.graph.series import Series
from tickrig.host.monitor.graph.view import View

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
