from __future__ import annotations

import re

import pytest

from tests.host.canmon.model.record_log import hear
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.graph.plot import LiveGraph, ViewMode
from tickrig.host.canmon.model.graph.series import parse_signal
from tickrig.wire.can import CanFrame

S = 1_000_000
RAMP = "".join(f"{second}.0 181#{second:02X}\n" for second in range(1, 21))


def graph(*words: str, mode: ViewMode = ViewMode.LIVE) -> LiveGraph:
    made = LiveGraph(mode)
    for word in words or ("181[0]",):
        made.add(parse_signal(word))
    for record in hear(RAMP):
        made.take(record, None)
    made.now_us = 20 * S
    return made


def span_s(made: LiveGraph) -> tuple[float, float]:
    view = made.view()
    return view.from_us / S, view.to_us / S


PICTURE = """\
━ 181[0] 20
       20┤                 ⣀⣀⡠⠤⠤⠒⠉
         │            ⣀⠤⠔⠊⠉
       15┤     ⣀⠤⠔⠒⠒⠉⠉
       10┤⡠⠤⠔⠊⠉
         └──┬───────────┬─────────
           10          15 s"""


def test_a_live_graph_shows_the_latest_window() -> None:
    made = graph()
    lines = [re.sub("\x1b\\[[0-9]*m", "", line).rstrip() for line in made.render(34, 7)]
    assert "\n".join(lines) == PICTURE
    made.now_us = 22 * S
    assert span_s(made) == (12, 22)


def test_all_of_a_log_is_seen() -> None:
    assert span_s(graph(mode=ViewMode.ALL)) == (1, 20)


def test_zooming_a_live_window_keeps_its_end() -> None:
    made = graph()
    made.zoom(2)
    assert (span_s(made), made.mode) == ((15, 20), ViewMode.LIVE)


def test_zooming_goes_to_the_cursor_else_to_the_middle() -> None:
    made = graph(mode=ViewMode.ALL)
    made.zoom(2)
    assert (span_s(made), made.mode) == ((5.75, 15.25), ViewMode.HELD)
    made.move_cursor(-1)
    made.zoom(2)
    assert span_s(made) == (5.75, 10.5)


def test_moving_stops_the_picture() -> None:
    made = graph()
    made.move(-0.5)
    made.now_us = 30 * S
    assert span_s(made) == (5, 15)
    made.show(ViewMode.LIVE)
    assert span_s(made) == (20, 30)


def test_the_cursor_begins_in_the_middle_stays_in_sight_and_stops_the_picture() -> None:
    made = graph()
    made.move_cursor(0)
    assert (made.cursor_us, made.mode) == (15 * S, ViewMode.HELD)
    assert "181[0] 15" in made.render(34, 7)[0]
    made.move_cursor(-0.2)
    assert made.cursor_us == 13 * S
    made.move_cursor(9)
    assert made.cursor_us == 20 * S
    made.show(ViewMode.ALL)
    assert made.cursor_us is None


def test_holding_keeps_what_is_seen() -> None:
    made = graph()
    made.show(ViewMode.HELD)
    made.now_us = 40 * S
    assert span_s(made) == (10, 20)


def test_one_axis_is_stretched_and_moved_and_fits_again() -> None:
    made = graph("181[0]", "181[0]*10@2", mode=ViewMode.ALL)
    made.next_axis()
    made.stretch(2)
    assert made.view().ranges == {2: (57.5, 152.5)}
    made.lift(0.1)
    assert made.view().ranges == {2: (67.0, 162.0)}
    made.next_axis()
    assert made.axis == 1
    made.next_axis()
    made.fit()
    assert made.view().ranges == {}


def test_an_axis_is_never_stretched_to_nothing() -> None:
    made = graph(mode=ViewMode.ALL)
    for _ in range(200):
        made.stretch(2)
    low, high = made.view().ranges[1]
    assert low < high


def test_a_signal_that_comes_later_has_its_past() -> None:
    made = graph()
    past = [(record, None) for record in hear(RAMP)]
    made.add(parse_signal("181[0]*2"), past)
    made.take(Record(21 * S, "can0", CanFrame.parse("181#15")), None)
    assert list(made.series[1].values) == [2.0 * n for n in range(1, 22)]
    made.remove(0)
    assert ([word.text for word in made.words], len(made.series)) == (["181[0]*2"], 1)


def test_clearing_forgets_the_samples_alone() -> None:
    made = graph()
    made.clear()
    assert ([len(one) for one in made.series], len(made.words)) == ([0], 1)


@pytest.mark.parametrize("mode", list(ViewMode))
def test_without_a_signal_all_keys_do_no_harm(mode: ViewMode) -> None:
    made = LiveGraph(mode)
    made.zoom(2)
    made.move(1)
    made.move_cursor(1)
    made.next_axis()
    made.stretch(2)
    made.lift(1)
    made.fit()
    assert len(made.render(40, 10)) == 10
