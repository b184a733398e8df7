from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from textual.widgets import Input, Static

from tests.host.canmon.tui.pilot import (
    drive_session,
    hear,
    on_monitor,
    screen_text,
    shown,
    until,
    wire_session,
)
from tests.host.canmon.wire import Wire
from tickrig.host.canmon.model.logs.log_reader import read_log
from tickrig.host.canmon.tui.app import MonitorApp
from tickrig.host.canmon.tui.panels.trace_panel import CHANGED, TracePanel
from tickrig.host.canmon.workspace import SettingError
from tickrig.host.tui import LineView


def panel_of(monitor: MonitorApp) -> TracePanel:
    return monitor.query_one(TracePanel)


def test_frames_are_shown_decoded_as_they_come(wire: Wire) -> None:
    session = wire_session(wire)

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        hear(session, wire, "705#7F", "185#0102")
        lines = shown(monitor)
        assert "705       [1] 7F" in lines[0]
        assert lines[0].endswith("5 heartbeat pre-operational")
        assert lines[1].endswith("5 unmapped mapping unknown")

    on_monitor(session, act)


def test_bytes_that_changed_have_a_colour(wire: Wire) -> None:
    session = wire_session(wire)

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        hear(session, wire, "185#0102", "185#0182")
        shown(monitor)
        line = panel_of(monitor).query_one(LineView).lines[1]
        assert [text.strip() for text, style in line if style == CHANGED] == ["82"]
        await pilot.press("b")
        line = panel_of(monitor).query_one(LineView).lines[1]
        assert [text.strip() for text, style in line if style == CHANGED] == ["1"]
        await pilot.press("b")
        assert "01 82" in shown(monitor)[1]

    on_monitor(session, act)


def test_the_latest_frame_is_in_view_until_somebody_scrolls_up(wire: Wire) -> None:
    session = wire_session(wire)

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        hear(session, wire, *(f"181#{n:02X}" for n in range(100)))
        assert "[1] 63" in shown(monitor)[-1]
        view = monitor.shown.query_one(LineView)
        await until(pilot, lambda: view.allow_vertical_scroll)  # the screen is laid out
        await pilot.press("home")
        await until(pilot, lambda: "[1] 00" in shown(monitor)[0])
        hear(session, wire, "181#FF")
        assert "[1] 00" in shown(monitor)[0]
        await pilot.press("end")
        await until(pilot, lambda: "[1] FF" in shown(monitor)[-1])

    on_monitor(session, act)


def test_space_holds_the_picture_and_frames_are_taken_meanwhile(wire: Wire) -> None:
    session = wire_session(wire)

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        hear(session, wire, "181#01")
        await pilot.press("space")
        hear(session, wire, "181#02")
        assert len(shown(monitor)) == 1
        assert "[paused]" in screen_text(monitor)
        await pilot.press("space")
        assert "[1] 02" in shown(monitor)[-1]

    on_monitor(session, act)


def test_o_shows_the_latest_frame_of_each_identifier_and_how_many_came() -> None:
    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await pilot.press("o")
        lines = shown(monitor)
        assert len(lines) == 14
        row = next(line for line in lines if " 585 " in line)
        assert row.split()[2:5] == ["47", "585", "[8]"]
        await pilot.press("o")
        assert len(shown(monitor)) > 14

    on_monitor(drive_session(), act)


def test_a_filter_is_written_behind_a_slash() -> None:
    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await pilot.press("slash", *"emcy", "enter")
        assert [line.split()[2] for line in shown(monitor)] == ["085"]
        assert "[filter emcy]" in screen_text(monitor)
        await pilot.press("o")
        assert len(shown(monitor)) == 1
        await pilot.press("slash", "ctrl+u", "enter")
        assert len(shown(monitor)) == 14

    on_monitor(drive_session(), act)


def test_keys_are_text_while_a_filter_is_written_and_escape_gives_it_up() -> None:
    async def act(monitor: MonitorApp, pilot: Any) -> None:
        before = shown(monitor)
        await pilot.press("slash", *"qA2 ", "escape")
        shown(monitor)
        await pilot.pause()  # all lines are there again: now it can scroll to the last
        assert shown(monitor) == before
        assert not monitor.session.armed
        assert panel_of(monitor).save()["filter"] == ""

    on_monitor(drive_session(), act)


def test_a_wrong_filter_is_told_with_its_column() -> None:
    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await pilot.press("slash", *"3 an", "enter")
        await pilot.pause()
        assert "column" in screen_text(monitor)
        assert len(shown(monitor)) > 14
        await pilot.press("escape")
        await pilot.pause()
        assert "column" not in screen_text(monitor)

    on_monitor(drive_session(), act)


def test_d_hides_what_frames_mean() -> None:
    async def act(monitor: MonitorApp, pilot: Any) -> None:
        assert "sync" in "".join(shown(monitor))
        await pilot.press("d")
        assert "sync" not in "".join(shown(monitor))

    on_monitor(drive_session(), act)


def test_t_goes_round_the_times() -> None:
    async def act(monitor: MonitorApp, pilot: Any) -> None:
        found = []
        for _ in range(4):
            found.append(shown(monitor)[-1].split()[0])
            await pilot.press("t")
        zero, delta, absolute, date = found
        assert (float(zero), float(delta)) == (0.736204, 0.000068)
        assert float(absolute) >= 0.736204
        assert date.count("-") == 2
        assert shown(monitor)[-1].split()[0] == zero

    on_monitor(drive_session(), act)


def test_c_begins_anew(wire: Wire) -> None:
    session = wire_session(wire)

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        hear(session, wire, "181#01", "182#01")
        await pilot.press("c")
        assert shown(monitor) == []
        hear(session, wire, "183#01")
        assert [line.split()[2] for line in shown(monitor)] == ["183"]
        await pilot.press("o")
        assert len(shown(monitor)) == 1

    on_monitor(session, act)


def test_a_hidden_trace_misses_nothing(wire: Wire) -> None:
    session = wire_session(wire)

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await pilot.press("slash", *"181", "enter", "2")
        hear(session, wire, "181#01", "182#01", "181#02")
        await pilot.press("1", "o")
        assert [line.split()[2:4] for line in shown(monitor)] == [["2", "181"]]

    on_monitor(session, act)


def test_its_settings_come_back() -> None:
    session = drive_session()
    settings = {"overwrite": True, "time": "d", "bits": True, "decode": False, "filter": "sync"}
    panel = TracePanel(session)
    panel.load(settings)
    assert panel.save() == {**settings, "bookmarks": None}
    session.close()


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        ({"bits": 1}, "bits: 1 is neither true nor false"),
        ({"time": "x"}, "time: 'x' is not one of z, d, a, A"),
        ({"filter": 3}, "filter: 3 is no text"),
        ({"filter": "node ="}, "column"),
    ],
)
def test_a_wrong_setting_is_told(settings: dict[str, object], reason: str) -> None:
    session = drive_session()
    with pytest.raises(SettingError, match=reason):
        TracePanel(session).load(settings)
    session.close()


async def save_as(monitor: MonitorApp, pilot: Any, name: Path) -> None:
    await pilot.press("s")
    monitor.query_one("#answer", Input).value = str(name)
    await pilot.press("enter")
    await pilot.pause()


def test_what_passes_the_filter_is_saved_as_a_log(wire: Wire, tmp_path: Path) -> None:
    session = wire_session(wire)

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        hear(session, wire, "701#00", "181#01", "702#00")
        await save_as(monitor, pilot, tmp_path / "all.log")
        panel_of(monitor).apply_filter("heartbeat or boot-up")
        await save_as(monitor, pilot, tmp_path / "some.blf")
        said = [note.message for note in monitor._notifications]
        assert said[:2] == [
            f"3 frames written to {tmp_path}/all.log",
            f"2 frames written to {tmp_path}/some.blf",
        ]

    on_monitor(session, act)
    all_of, some = (list(read_log(tmp_path / name)) for name in ("all.log", "some.blf"))
    assert [str(one.frame) for one in all_of] == ["701#00", "181#01", "702#00"]
    assert [(one.at_us, one.frame) for one in some] == [
        (one.at_us, one.frame) for one in (all_of[0], all_of[2])
    ]


def test_a_trace_is_saved_over_nothing_and_a_mistake_is_told(wire: Wire, tmp_path: Path) -> None:
    (tmp_path / "kept.log").write_text("precious")
    session = wire_session(wire)
    mistakes = {"kept.log": "is there already", "a.xyz": "name ends in", "no/a.log": "No such file"}

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        for name, text in mistakes.items():
            await save_as(monitor, pilot, tmp_path / name)
            assert text in str(monitor.query_one("#ask #wrong", Static).content)
            await pilot.press("escape")

    on_monitor(session, act)
    assert (tmp_path / "kept.log").read_text() == "precious"


@pytest.mark.parametrize(("width", "gaps"), [(80, False), (120, True)])
def test_a_narrow_window_has_meanings_in_the_place_of_gaps(width: int, gaps: bool) -> None:
    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await pilot.pause()
        lines = shown(monitor)
        head = str(monitor.shown.query_one("#head", Static).content)
        assert ("gap ms" in head) is gaps
        assert lines[-1][head.index("data") - 1 :].startswith(" [")
        await pilot.press("d")
        shown(monitor)
        assert "gap ms" in str(monitor.shown.query_one("#head", Static).content)

    on_monitor(drive_session(), act, size=(width, 24))
