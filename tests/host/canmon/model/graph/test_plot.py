from __future__ import annotations

import math
import re
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.canmon.model.graph.plot import (
    Canvas,
    chart,
    decimate,
    read_out,
    render,
    ticks,
    widened,
)
from tickrig.host.canmon.model.graph.series import Series, View


def made(values: list[float], label: str = "a", axis: int = 1, unit: str = "") -> Series:
    series = Series(label, axis, unit)
    for number, value in enumerate(values):
        series.append(number * 1_000, value)
    return series


RAMP = """\
━ speed 40 rpm
       40┤                  ⣀⠤⠒⠉
         │             ⢀⡠⠔⠊⠉
       20┤        ⢀⡠⠤⠒⠊⠁
         │    ⣀⠤⠔⠊⠁
        0┤⣀⠤⠒⠉
         └┬─────────┬───────────
        0.00      0.02 s
"""

TWO_AXES = """\
━ a 0
━ b 20 V  (axis 2)
        5┤     ⡰⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⢉⠏⢢     20
         │    ⡰⠁         │⢀⠎  ⢣
         │   ⡰⠁          ⢠⠃    ⢣
         │  ⡰⠁          ⡠⠃      ⢣  15
         │ ⡰⠁ ⣀⠤⠤⢄⡀    ⡰⠁│       ⢣
        0┤⡰⠕⠊⠉    ⠈⠉⠒⠤⡰⠁ │        ⢣10
         └┬───────────┬────────────
        0.000       0.002 s
"""


def stripped(lines: list[str]) -> str:
    return "".join(line.rstrip() + "\n" for line in lines)


def test_a_ramp_is_a_diagonal() -> None:
    ramp = made([float(n) for n in range(41)], "speed", unit="rpm")
    assert stripped(render([ramp], View.of([ramp]), 32, 8)) == RAMP


def test_two_axes_have_their_own_scales_and_the_cursor_reads_out() -> None:
    pair = [made([0, 1, 0, 5, 0]), made([10, 20, 20, 20, 10], "b", 2, "V")]
    view = replace(View.of(pair), cursor_us=2_500)
    assert stripped(render(pair, view, 44, 10)) == TWO_AXES


def test_colours_tell_the_curves_apart() -> None:
    pair = [made([0, 1]), made([1, 0], "b")]
    lines = render(pair, View.of(pair), 40, 10, colour=True)
    assert (lines[0], lines[1]) == ("\x1b[36m━ a 1\x1b[0m", "\x1b[33m━ b 0\x1b[0m")
    plain = [re.sub(r"\x1b\[\d+m", "", line) for line in lines]
    assert plain == render(pair, View.of(pair), 40, 10)


@given(
    st.lists(st.lists(st.floats(-1e9, 1e9), max_size=50), max_size=4),
    st.integers(1, 120),
    st.integers(1, 40),
    st.integers(-100_000, 100_000),
    st.integers(10, 100_000),
)
def test_a_picture_has_the_size_that_was_asked_for(
    values: list[list[float]], width: int, height: int, from_us: int, span_us: int
) -> None:
    series = [made(some, "x", 1 + number % 3) for number, some in enumerate(values)]
    view = View(from_us, from_us + span_us, cursor_us=from_us + span_us // 3)
    lines = render(series, view, width, height)
    assert len(lines) == max(6, height)
    assert max(map(len, lines)) <= max(30, width)


def test_between_two_samples_their_line_is_seen() -> None:
    series = made([0, 10, 20])
    lines = render([series], View(1_200, 1_800), 40, 8)
    assert all(re.search("[\u2801-\u28ff]", line) for line in lines[2:5])


def test_a_spike_between_thousands_of_samples_is_drawn_to_its_top() -> None:
    series = made([0.0] * 50_000)
    series.values[31_234] = 7.0
    lines = render([series], View.of([series]), 60, 20)
    assert re.search("[\u2801-\u28ff]", lines[1])


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=300), st.integers(1, 40))
def test_no_spike_vanishes_however_few_the_columns(values: list[float], columns: int) -> None:
    series = made(values)
    bars = [bar for bar in decimate(series, 0, 1_000 * len(values), columns) if bar]
    assert (min(bar.low for bar in bars), max(bar.high for bar in bars)) == (
        min(values),
        max(values),
    )
    assert (bars[0].first, bars[-1].last) == (values[0], values[-1])


def test_what_was_seen_holds_until_the_next_frame() -> None:
    series = made([1.5, 2.5], unit="V")
    assert [str(reading) for reading in read_out([series], 999)] == ["a 1.5 V"]
    assert read_out([series], 1_250)[0][1:3] == (2.5, 250)
    assert [str(reading) for reading in read_out([series], -1)] == ["a - V"]


def test_what_is_no_number_is_left_out_and_counted() -> None:
    series = made([1, math.nan, math.inf, 2])
    assert (list(series.values), series.not_numbers) == ([1, 2], 2)


def test_a_series_keeps_the_latest() -> None:
    series = Series("a", most=10)
    for number in range(1_000):
        series.append(number, number)
    assert 10 <= len(series) < 20
    assert list(series.at_us) == list(range(1_000))[-len(series) :]
    series.clear()
    assert len(series) == 0


def test_time_never_goes_back() -> None:
    series = Series("a")
    series.append(10, 1)
    series.append(5, 2)
    assert list(series.at_us) == [10, 10]


def test_zooming_keeps_the_place() -> None:
    view = View(0, 1_000)
    assert view.zoomed(2).zoomed(0.5) == view
    assert view.zoomed(4, 1_000).to_us == 1_000
    assert view.zoomed(1e9).span_us == 10
    assert view.moved(0.5) == View(500, 1_500)


def test_an_empty_view_is_refused() -> None:
    with pytest.raises(ValueError, match="shows nothing"):
        View(5, 5)
    with pytest.raises(ValueError, match="axis 1 from 2 to 2 shows nothing"):
        View(0, 5, {1: (2, 2)})


def test_an_axis_keeps_the_range_that_it_is_given() -> None:
    series = made([1, 2])
    assert chart([series], View(0, 1_000, {1: (-5, 5)}), 10).ranges == {1: (-5, 5)}
    assert chart([series], View(0, 1_000), 10).ranges == {1: (1, 2)}
    assert chart([made([4])], View(0, 1_000), 10).ranges == {1: (3.6, 4.4)}


@given(st.floats(-1e12, 1e12), st.floats(1e-6, 1e12), st.integers(1, 20))
def test_the_marks_of_an_axis_lie_on_it(low: float, span: float, about: int) -> None:
    low, high = widened(low, low + span)
    marks = ticks(low, high, about)
    margin = (high - low) * 1e-6
    assert all(low - margin <= mark <= high + margin for mark, _ in marks)
    assert len(marks) <= 2 * about + 1


def test_numbers_are_written_with_the_digits_that_tell_them_apart() -> None:
    assert [text for _, text in ticks(-0.1, 0.1, 4)] == ["-0.10", "-0.05", "0.00", "0.05", "0.10"]
    assert [text for _, text in ticks(0, 3e8, 3)] == ["0", "1e+08", "2e+08", "3e+08"]


def test_dots_outside_a_canvas_are_cut() -> None:
    canvas = Canvas(1, 1)
    canvas.fill(0, -5, -1)
    canvas.fill(1, 2, 99)
    assert canvas.row(0) == [("⢠", 0)]
