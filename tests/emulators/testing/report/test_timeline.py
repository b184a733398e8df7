from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.emulators.testing.report.bench_report import (
    JournalLine,
    Outcome,
    PlannedFault,
    SignalSeries,
    TestRecord,
    Value,
)
from tickrig.emulators.testing.report.timeline import (
    CURVE_PX,
    SWITCH_PX,
    Lane,
    TimeAxis,
    Timeline,
    TimeSpan,
    timeline_of,
)
from tickrig.host.text.page_text import DASH


def line_of(
    *series: SignalSeries,
    faults: tuple[PlannedFault, ...] = (),
    journal: tuple[JournalLine, ...] = (),
    virtual_us: int | None = 1_000_000,
) -> Timeline:
    test = TestRecord(
        "t", Outcome.PASSED, virtual_us=virtual_us, series=series, faults=faults, journal=journal
    )
    line = timeline_of(test)
    assert line is not None
    return line


def lane(*points: tuple[int, Value], steps: bool = True) -> Lane:
    return line_of(SignalSeries("v", "V", points, steps)).lanes[0]


def test_a_step_holds_until_the_next_and_to_the_end() -> None:
    assert lane((0, 0), (500_000, 10)).path == "M0 100H500V0H1000"


def test_a_line_goes_straight_and_ends_with_its_last_sample() -> None:
    drawn = lane((0, 0.0), (250_000, 10.0), (500_000, 5.0), steps=False)
    assert drawn.path == "M0 100L250 0L500 50"


def test_where_nothing_is_known_the_curve_has_a_gap() -> None:
    assert lane((0, 0), (200_000, None), (400_000, 1)).path == "M0 100H200M400 0H1000"
    drawn = lane((0, 0.0), (200_000, None), (400_000, 1.0), (500_000, 0.0), steps=False)
    assert drawn.path == "M0 100M400 0L500 100"


def test_a_step_to_the_same_value_is_not_drawn() -> None:
    assert lane((0, 0), (100_000, 0), (500_000, 9), (600_000, 9)).path == "M0 100H500V0H1000"


def test_a_line_of_one_value_is_flat_and_a_gap_is_none_of_it() -> None:
    assert lane((0, 5), (100_000, None), (200_000, 5)).path == "M0 50H100M200 50H1000"


@pytest.mark.parametrize(
    ("points", "rows"),
    [
        (((0, 1), (1, 0.5), (2, 7), (3, 123456.789)), ("1", "0.5", "123457", "123457", "4")),
        (((0, 3), (1, None), (2, -4)), ("3", "-4", "3", "-4", "3")),
        (((0, "Off"), (1, "On")), ("Off", DASH, DASH, "On", "2")),
        (((0, 4), (1, 4)), ("4", "4", "4", "4", "2")),
    ],
)
def test_a_table_has_first_least_greatest_and_last(
    points: tuple[tuple[int, Value], ...], rows: tuple[str, ...]
) -> None:
    assert lane(*points).rows == rows


def test_the_label_has_the_range_and_switches_are_low() -> None:
    drawn = lane((0, 2.5), (1, 7))
    assert (drawn.low, drawn.high, drawn.scale, drawn.height) == ("2.5", "7", (2.5, 7), CURVE_PX)
    assert lane((0, 0), (1, 1)).height == SWITCH_PX
    assert lane((0, 0), (1, 2)).height == CURVE_PX


def test_words_that_change_for_ever_are_thinned() -> None:
    drawn = lane(*((n, f"w{n}") for n in range(1_000)))
    assert 50 < len(drawn.words) <= 200
    assert (drawn.words[0].text, drawn.words[-1].text) == ("w0", "w999")


def test_the_axis_has_round_times() -> None:
    assert TimeAxis(0, 2_000_000).ticks == [
        (0, "0.0"),
        (25, "0.5"),
        (50, "1.0"),
        (75, "1.5"),
        (100, "2.0"),
    ]
    assert TimeAxis(1_000_000, 1_500_000).ticks[1:3] == [(20, "1.1"), (40, "1.2")]


@pytest.mark.parametrize(
    ("left", "width", "place"),
    [
        (0, 25, "inside"),
        (75, 25, "inside"),
        (50, 24.9, "behind"),
        (51, 24, "behind"),
        (51.1, 24, "before"),
        (99, 1, "before"),
    ],
)
def test_the_name_of_a_fault_is_where_it_has_room(left: float, width: float, place: str) -> None:
    assert TimeSpan(left, width, "cut").place == place


def test_words_stand_as_long_as_they_hold() -> None:
    drawn = lane((0, "Off"), (250_000, "On"), (300_000, "On"), (500_000, None), (750_000, "Off"))
    assert drawn.words == (TimeSpan(0, 25, "Off"), TimeSpan(25, 25, "On"), TimeSpan(75, 25, "Off"))
    assert drawn.path == ""


def test_a_number_that_never_changes_is_said_once() -> None:
    drawn = lane((0, 5), (900_000, 5))
    assert (drawn.constant, drawn.words) == (True, (TimeSpan(0, 100, "5 V"),))


def test_zero_is_marked_where_a_curve_crosses_it() -> None:
    assert lane((0, -5), (1, 15)).zero == 75
    assert lane((0, 5), (1, 15)).zero is None


def test_a_fault_lasts_from_when_it_came_to_when_it_went() -> None:
    faults = (
        PlannedFault("cut", 250_000, 500_000),
        PlannedFault("stays", 900_000),
        PlannedFault("never", when="the 3rd OK"),
    )
    line = line_of(faults=faults)
    assert line.faults == (TimeSpan(25, 25, "cut"), TimeSpan(90, 10, "stays"))
    assert [span.place for span in line.faults] == ["inside", "before"]


def test_what_is_too_much_to_draw_is_counted() -> None:
    faults = tuple(PlannedFault(f"f{n}", n) for n in range(50))
    series = tuple(SignalSeries(f"s{n}", points=((0, "x" * 1_000),)) for n in range(41))
    line = line_of(*series, faults=faults)
    assert (len(line.faults), len(line.lanes)) == (40, 40)
    assert line.left_out == ("10 faults", "1 signal")
    assert line.lanes[0].words[0].text == "x" * 80


def test_a_fault_alone_makes_an_axis() -> None:
    line = line_of(faults=(PlannedFault("cut", 100, 300),), virtual_us=None)
    assert (line.axis[:], line.faults) == ((0, 300), (TimeSpan(33.33, 66.67, "cut"),))


def test_actions_and_misses_are_on_the_axis() -> None:
    journal = (
        JournalLine(0, "", "<", "OK"),
        JournalLine(500_000, "", "!", "cut"),
        JournalLine(2_000_000, "", "?", "no OK"),
    )
    events = line_of(SignalSeries("v", points=((0, 1),)), journal=journal).events
    assert [(event.left, event.text, event.missed) for event in events] == [
        (50, "cut", False),
        (100, "no OK", True),
    ]


def test_a_test_with_nothing_on_it_has_no_line() -> None:
    assert timeline_of(TestRecord("t", Outcome.PASSED, virtual_us=1)) is None


@pytest.mark.parametrize(
    ("points", "virtual_us", "span"),
    [
        (((100, 1), (900, 2)), None, (0, 900)),
        (((100, 1), (900, 2)), 1_000, (0, 1_000)),
        (((800, 1), (900, 2)), None, (800, 900)),
        (((5, 1),), None, (5, 6)),
        (((0, 1),), 0, (0, 1)),
        (((-5, 1), (5, 1)), None, (-5, 5)),
        (((40, 1),), 100, (0, 100)),
        (((60, 1),), 100, (60, 100)),
    ],
)
def test_the_axis_holds_what_happened(
    points: tuple[tuple[int, Value], ...], virtual_us: int | None, span: tuple[int, int]
) -> None:
    assert line_of(SignalSeries("v", points=points), virtual_us=virtual_us).axis[:] == span


NUMBERS = st.none() | st.integers(-(2**63), 2**63) | st.floats() | st.just(-1.7e308)


@given(
    st.lists(st.tuples(st.integers(0, 10**13), NUMBERS | st.text()), min_size=1),
    st.booleans(),
    st.none() | st.integers(0, 10**13),
)
def test_any_samples_are_drawn_within_the_field(
    points: list[tuple[int, Value]], steps: bool, virtual_us: int | None
) -> None:
    series = SignalSeries("v", points=tuple(sorted(points, key=lambda at: at[0])), steps=steps)
    line = line_of(series, virtual_us=virtual_us)
    for drawn in line.lanes:
        assert not re.search("nan|inf", drawn.path)
        numbers = [
            float(number) for number in re.findall(r"-?\d+(?:\.\d+)?(?:e-?\d+)?", drawn.path)
        ]
        assert all(0 <= number <= 1_000 for number in numbers)
        assert all(0 <= word.left <= word.left + word.width <= 100.01 for word in drawn.words)
    assert line.size > 0
