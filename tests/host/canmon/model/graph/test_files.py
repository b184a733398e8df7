from __future__ import annotations

import json
import re
from dataclasses import replace
from io import BytesIO, StringIO
from xml.etree import ElementTree

from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.canmon.model.graph.plot import html_page, svg
from tickrig.host.canmon.model.graph.series import Series, View
from tickrig.host.canmon.output.graph_file import write_csv, write_png

SVG = "{http://www.w3.org/2000/svg}"


def made(values: list[float], label: str = "a", axis: int = 1, unit: str = "") -> Series:
    series = Series(label, axis, unit)
    for number, value in enumerate(values):
        series.append(number * 1_000, value)
    return series


def texts(root: ElementTree.Element) -> list[str]:
    return [element.text or "" for element in root.iter(f"{SVG}text")]


def curves(root: ElementTree.Element) -> list[str]:
    return [e.get("d") or "" for e in root.iter(f"{SVG}path") if e.get("class") == "curve"]


def test_an_svg_has_axes_a_legend_and_a_path_for_each_curve() -> None:
    pair = [made([0, 1, 2, 3]), made([10, 20, 20, 10], "<b>", 2, "V")]
    picture = svg(pair, View.of(pair), 300, 150)
    root = ElementTree.fromstring(picture)
    assert root.get("viewBox") == "0 0 300 150"
    assert texts(root) == [
        *("0.000 s", "0.002 s"),
        *("0", "2"),
        *("10", "15", "20"),
        *("━ a", "━ <b> [V] (axis 2)"),
    ]
    assert curves(root) == [
        "M64 122L115 97.3L167 72.7L219 48",
        "M64 122L115 48L167 48L219 122",
    ]


def test_a_spike_is_in_the_svg_however_short() -> None:
    series = made([0.0] * 100_000)
    series.values[54_321] = 9.0
    (path,) = curves(ElementTree.fromstring(svg([series], View.of([series]))))
    assert re.search(r"L\d+ 28L", path)
    assert path.count("L") < 2 * 960


def test_a_cursor_is_a_line() -> None:
    series = made([0, 1, 2])
    view = replace(View.of([series]), cursor_us=1_000)
    assert '<path class="cursor" d="M504.0 28v344"/>' in svg([series], view)


def test_an_svg_of_nothing_is_an_svg() -> None:
    for series in ([], [Series("a")]):
        assert curves(ElementTree.fromstring(svg(series, View.of(series)))) == [""] * len(series)


@given(
    st.lists(st.lists(st.floats(-1e12, 1e12), max_size=20), max_size=5),
    st.integers(10, 500),
    st.integers(10, 500),
)
def test_an_svg_of_anything_is_well_formed(
    values: list[list[float]], width: int, height: int
) -> None:
    series = [made(some, "&<x", 1 + n % 4) for n, some in enumerate(values)]
    root = ElementTree.fromstring(svg(series, View.of(series), width, height))
    assert len(curves(root)) == len(series)


def test_a_page_holds_what_its_cursor_reads_out() -> None:
    series = made([0, 1.5, 2], "</script>", unit="V")
    page = html_page([series], View.of([series]), 300, 200, "run <1>")
    assert "<title>run &lt;1&gt;</title>" in page
    match = re.search(r"const graph = (.*);\n", page)
    assert match is not None
    assert "</script>" not in match[1]
    (curve,) = json.loads(match[1])["curves"]
    assert (curve["label"], curve["unit"]) == ("</script>", "V")
    assert [value for _, value in curve["stops"]] == [0, 1.5, 2]


def test_a_table_has_all_samples_in_the_order_of_time() -> None:
    slow, fast = Series("slow"), made([1, 2, 3.5], "fast", unit="V")
    slow.append(500, 7)
    slow.append(2_000, 8)
    slow.append(2_000, 9)
    slow.append(5_000, 10)
    file = StringIO()
    write_csv(file, [slow, fast], View(0, 2_000))
    assert file.getvalue().splitlines() == [
        "t_s,slow,fast [V]",
        "0.000000,,1",
        "0.000500,7,",
        "0.001000,,2",
        "0.002000,9,3.5",
    ]


def test_a_png_has_the_size_that_was_asked_for() -> None:
    series = [made([0, 1, 2]), made([5, 4, 3], "b", 2, "V"), made([1], "c", 3)]
    file = BytesIO()
    write_png(file, series, replace(View.of(series), cursor_us=500), 640, 300)
    data = file.getvalue()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    assert (int.from_bytes(data[16:20]), int.from_bytes(data[20:24])) == (640, 300)
    write_png(file, [], View.of([]))
