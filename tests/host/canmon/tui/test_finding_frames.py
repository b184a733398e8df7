"""From a finding to its frame, times, find, bookmarks, pictures, and a bus that is silent."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from textual.widgets import Input

from tests.host.canmon.tui.panel_pilot import Desk, at_desk, kept
from tests.host.canmon.tui.pilot import drive_session, on_monitor, screen_text, shown, until
from tests.host.canmon.tui.rig_session import BUS, NODE, RigSession
from tests.host.canmon.wire import Wire
from tickrig.host.canmon.model.check.checker import Alarms
from tickrig.host.canmon.model.check.rules import Rules
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.tui.app import MonitorApp
from tickrig.host.canmon.tui.panels.alarms_panel import AlarmsPanel
from tickrig.host.canmon.tui.panels.nodes_panel import NodesPanel
from tickrig.host.canmon.tui.panels.trace_panel import TracePanel
from tickrig.host.canmon.tui.panels.transmit_panel import TransmitPanel
from tickrig.host.canmon.tui.session import Model, open_session
from tickrig.host.canmon.workspace import SettingError
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.tui import LineView
from tickrig.wire.can import CanFrame

PANELS = (TracePanel, AlarmsPanel, NodesPanel)
SMALL = (80, 24)


def cursor_line(monitor: MonitorApp) -> str:
    """Return the line of the trace on which the cursor is."""
    monitor.refresh_view()
    lines = monitor.query_one(TracePanel).query_one(LineView).lines
    (found,) = [line for line in lines if any("reverse" in style for _, style in line)]
    return "".join(text for text, _ in found)


def aborting_session() -> RigSession:
    session = RigSession(eds=False)
    for _ in range(60):
        session.run(10_000)
        session.buses[BUS](CanFrame.parse("605#4041600000000000"))
    session.buses[BUS](CanFrame.parse("605#2F00100000000000"))
    for _ in range(60):
        session.run(10_000)
        session.buses[BUS](CanFrame.parse("605#4041600000000000"))
    session.run(10_000)
    return session


def test_enter_on_a_finding_goes_to_its_frame_in_the_trace() -> None:
    session = aborting_session()

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        panel = monitor.query_one(AlarmsPanel)
        panel.take_rules("no_sdo_abort = true")
        for row in session.model.trace.tail(1_000):
            assert isinstance(row.record, Record)
            assert row.decoded
            panel.held.alarms.take(row.record, row.decoded)
        await pilot.press("2")
        await pilot.pause()
        await pilot.press("enter")
        assert monitor.shown.title == "alarms"  # the title is no finding
        await pilot.press("down", "enter")  # of a rule its latest finding
        await pilot.pause()
        assert monitor.shown.title == "trace"
        assert "80 00 10 00 02 00 01 06" in cursor_line(monitor)
        assert "paused" in screen_text(monitor)
        view = monitor.shown.query_one(LineView)
        number = view.top + next(
            n for n in range(view.rows) if "80 00" in _text(view, view.top + n)
        )
        assert 3 < number - view.top < view.rows - 3  # frames before and after are in view
        await pilot.press("slash")
        monitor.shown.query_one("#wanted", Input).value = "705"
        await pilot.press("enter", "2", "end", "enter")
        await pilot.pause()
        assert "80 00 10 00 02 00 01 06" in cursor_line(monitor)
        assert not monitor.query_one(TracePanel).filter_text

    on_monitor(session, act, panels=PANELS, size=SMALL)


def _text(view: LineView, number: int) -> str:
    return "".join(text for text, _ in view.line_at(number))


def test_a_finding_without_a_frame_goes_to_its_time() -> None:
    session = drive_session()

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        trace = monitor.query_one(TracePanel)
        row = session.model.trace.rows(50, 1)[0]
        trace.show_frame(row.record.at_us)
        monitor.refresh_view()
        assert str(row.record.frame)[:3] in cursor_line(monitor)
        trace.show_frame(0)
        await pilot.pause()
        assert "does not have this frame" in str([n.message for n in monitor._notifications])

    on_monitor(session, act, size=SMALL)


def test_a_key_writes_times_otherwise_in_all_tabs() -> None:
    session = aborting_session()

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        panel = monitor.query_one(AlarmsPanel)
        panel.take_rules("no_sdo_abort = true")
        rows = session.model.trace.tail(1_000)
        for row in rows:
            assert isinstance(row.record, Record)
            panel.held.alarms.take(row.record, row.decoded)
        (found,) = panel.held.alarms.findings
        origin_us = rows[0].record.at_us
        relative = f"{(found.at_us - origin_us) / 1e6:.6f}"
        await pilot.press("2")
        assert f"({relative}) no-sdo-abort" in "\n".join(shown(monitor))
        await pilot.press("1")
        await pilot.pause()
        await pilot.press("f")
        monitor.shown.query_one("#answer", Input).value = "sdo.aborted"
        await pilot.press("enter")
        assert relative in cursor_line(monitor)
        await pilot.press("f3", "f3")
        absolute = f"{found.at_us / 1e6:.6f}"
        assert absolute in cursor_line(monitor)
        await pilot.press("2")
        assert f"({absolute}) no-sdo-abort" in "\n".join(shown(monitor))
        await pilot.press("1", "t")
        assert "1970-01-01 " in cursor_line(monitor)
        await pilot.press("2")
        assert "(1970-01-01 " in "\n".join(shown(monitor))

    on_monitor(session, act, panels=PANELS, size=(120, 40))


def test_frames_are_found_forwards_and_backwards() -> None:
    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await pilot.press("home", "n")  # nothing was asked for yet
        field = monitor.shown.query_one("#answer", Input)
        field.value = "emcy and"
        await pilot.press("enter")
        assert field.parent
        assert "column" in screen_text(monitor)
        field.value = "boot-up"
        await pilot.press("enter")
        first = cursor_line(monitor)
        assert "boot-up" in first
        await pilot.press("n")
        second = cursor_line(monitor)
        assert "boot-up" in second
        assert second != first
        await pilot.press("N")
        assert cursor_line(monitor) == first
        await pilot.press("N")
        assert cursor_line(monitor) == second  # behind the first one comes the last
        assert [n.message for n in monitor._notifications] == ["from the last frame again"]
        await pilot.press("space")
        monitor.refresh_view()
        assert "paused" not in screen_text(monitor)

    on_monitor(drive_session(), act, size=SMALL)


def test_bookmarks_are_set_found_and_kept() -> None:
    async def act(monitor: MonitorApp, pilot: Any) -> None:
        trace = monitor.query_one(TracePanel)
        await pilot.press("home", "m")
        monitor.refresh_view()
        assert "black on yellow" in str(trace.query_one(LineView).lines[0])
        await pilot.click(LineView, offset=(10, 5))
        await pilot.pause()
        clicked = cursor_line(monitor)
        await pilot.press("m", "end", "left_square_bracket")
        assert cursor_line(monitor) != clicked
        await pilot.press("right_square_bracket")
        assert cursor_line(monitor) == clicked
        assert len(kept(trace)["bookmarks"]) == 2
        again = TracePanel(drive_session())
        again.load(kept(trace))
        assert kept(again) == kept(trace)
        await pilot.press("m")
        assert len(kept(trace)["bookmarks"]) == 1
        await pilot.press("c")
        assert "bookmarks" not in kept(trace)

    on_monitor(drive_session(), act, size=SMALL)


def test_a_bookmark_that_is_no_time_is_refused() -> None:
    with pytest.raises(SettingError, match="bookmarks: is no array of times"):
        TracePanel(drive_session()).load({"bookmarks": ["soon"]})


@pytest.mark.parametrize("ending", [".svg", ".png"])
def test_a_key_saves_the_screen(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"screen{ending}"

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await pilot.press("f12")
        field = monitor.screen.query_one("Input", Input)
        assert field.value == "canmon-trace.svg"
        field.value = str(path)
        await pilot.press("enter")
        await until(pilot, path.exists)
        await until(pilot, lambda: bool(monitor._notifications))
        assert [note.message for note in monitor._notifications] == [f"{path} is written"]
        for name, reason in (("x.gif", "is .svg or .png"), ("no/x.svg", "No such file")):
            await pilot.press("f12")
            monitor.screen.query_one("Input", Input).value = str(tmp_path / name)
            await pilot.press("enter")
            await pilot.pause()
            assert reason in [note.message for note in monitor._notifications][-1]

    if ending == ".png":
        pytest.importorskip("matplotlib")
    on_monitor(drive_session(), act, size=SMALL)
    data = path.read_bytes()
    if ending == ".png":
        from PIL import Image  # noqa: PLC0415 - an extra

        with Image.open(path) as image:
            assert image.size == (640, 24 * 17)
            assert len(image.getcolors(100_000) or ()) > 5
    else:
        assert data.startswith(b"<svg")
        assert b"@font-face" not in data


def test_without_matplotlib_a_png_becomes_svg(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import sys  # noqa: PLC0415

    monkeypatch.setitem(sys.modules, "matplotlib", None)

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        said = monitor._write_picture(tmp_path / "screen.png")
        path = tmp_path / "screen.svg"
        assert said == f"PNG needs matplotlib: pip install 'tickrig[plot]'; {path} is written"
        assert path.read_text("utf-8").startswith("<svg")

    on_monitor(drive_session(), act, size=SMALL)


def test_a_silent_bus_leads_to_a_scan_and_the_scan_finds_the_nodes() -> None:
    session = RigSession(eds=False)

    async def act(desk: Desk[NodesPanel]) -> None:
        hint = f"f queries all node-IDs, as canmon net {BUS} scan"
        assert desk.lines()[0] == f"no node has sent a frame; {hint}"
        await desk.press("f")
        assert not desk.asked  # it is not armed
        desk.session.arm()
        await desk.press("f")
        await desk.answer("n")
        desk.session.run(100_000)
        asked = len(desk.session.frames)
        assert not asked
        await desk.press("f")
        await desk.answer("y")
        desk.session.run(3_000_000)
        assert desk.session.frames[0] == "601#4000100000000000"
        assert "605#4018100200000000" in desk.session.frames
        assert len(desk.session.frames) == 127 + 3
        assert desk.lines()[0].split()[0] == str(NODE)
        memory = desk.session.model.decoder.memory(BUS, NODE)
        assert memory.number(0x1018, 2) == 0x6210

    at_desk(NodesPanel, act, session=session)


def test_a_trace_of_a_silent_bus_says_what_to_do() -> None:
    session = RigSession()
    session._begun_us -= 10_000_000

    async def act(desk: Desk[TracePanel]) -> None:
        assert desk.lines()[0].startswith("no frame comes: bit rate, cable,")
        assert desk.lines()[2] == f"    canmon net {BUS} scan"
        desk.session.run(10_000)
        assert "no frame comes" not in desk.lines()[0]

    at_desk(TracePanel, act, session=session)


def test_a_lost_heartbeat_is_an_alarm_when_it_is_due() -> None:
    session = RigSession()
    panel = AlarmsPanel(session)
    panel.load({})
    session.run(10_000)
    session.buses[BUS](CanFrame.parse("605#2B17100064000000"))
    session.run(500_000)
    last_us = max(row.record.at_us for row in session.model.trace.tail(2))
    told_us = 0
    while not told_us and session.model.now_us < last_us + 2_000_000:
        session.model.now_us += 10_000
        panel.held.tick(session.now_us + session.model.now_us, ())
        told_us = session.model.now_us if panel.held.alarms.findings else 0
    assert 150_000 < told_us - last_us <= 270_000  # one and a half periods; it looks each 100 ms


def test_what_has_never_come_is_missed_after_a_while_only() -> None:
    alarms = Alarms(Rules(nodes=(9,), no_lost_heartbeat=True))
    alarms.take(Record(0, BUS, CanFrame.parse("705#05")))
    alarms.check_missing(0)
    alarms.check_missing(1_000_000)
    assert not alarms.findings


def test_transmit_remembers_what_was_sent_of_a_pdo() -> None:
    rows = [
        {"send": "5.rpdo1 controlword=15 target_velocity=100"},
        {"send": "5.rpdo1 controlword=6"},
    ]

    async def act(desk: Desk[TransmitPanel]) -> None:
        desk.session.arm()
        lines = desk.lines()
        assert "205#060000000000" in lines[1]
        await desk.press("enter", "down", "enter")
        desk.session.run(10_000)
        assert desk.session.frames == ["205#0F0064000000", "205#060064000000"]
        assert "205#060064000000" in desk.lines()[1]

    at_desk(TransmitPanel, act, settings={"row": rows})


def test_the_scan_that_is_proposed_names_the_bus_as_a_command_line_does(wire: Wire) -> None:
    options = BusOptions(bitrate=500_000, bus_kwargs=("rx_queue_size=9",))
    session = open_session([wire.word], options, Model())
    words = f"--bitrate=500000 --bus-kwargs rx_queue_size=9 {wire.word}"
    assert session.scan_command == f"canmon net {words} scan"
    assert session.over(Model()).scan_command == session.scan_command
    session.close()
    session.source.close()
