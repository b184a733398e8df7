from __future__ import annotations

import asyncio
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from textual.binding import Binding
from textual.widgets import Input

from tests.host.canmon.tui.pilot import (
    OURS,
    drive_session,
    hear,
    on_monitor,
    screen_text,
    shown,
    until,
    wire_session,
)
from tests.host.canmon.wire import Wire
from tickrig.host.canmon.tui.app import MonitorApp, StatusLine
from tickrig.host.canmon.tui.panels.panel import TABS
from tickrig.host.canmon.tui.panels.trace_panel import TracePanel
from tickrig.host.canmon.tui.session import DecodedFrame, Model, open_session
from tickrig.host.canmon.workspace import MonitorSetup, PanelSettings, Workspace
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.tui import FramedApp, KeyFooter, line_text
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.instant import NEVER

PANELS = tuple(map(TABS.load, TABS.built_in))


def status(monitor: MonitorApp) -> str:
    monitor.refresh_view()
    return line_text(monitor.query_one(StatusLine).line)


def test_number_keys_and_the_mouse_show_tabs() -> None:
    async def act(monitor: MonitorApp, pilot: Any) -> None:
        for number, panel in enumerate(OURS, 1):
            await pilot.press(str(number))
            assert isinstance(monitor.shown, panel)
        await pilot.press("9")
        await pilot.click("#--content-tab-tab-nodes_view")
        await pilot.pause()
        assert monitor.shown.title == "nodes"

    on_monitor(drive_session(), act)


@pytest.mark.parametrize("panel", PANELS)
def test_f1_tells_what_each_panel_shows_and_what_its_keys_do(panel: Any) -> None:
    bindings = Binding.make_bindings(panel.BINDINGS)
    assert all(binding.description for binding in bindings)
    assert panel.HELP.split()[0] == "#"

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await pilot.press("f1")
        await until(pilot, lambda: panel.HELP.split()[1] in screen_text(monitor))
        await pilot.press("f1")
        assert not monitor.screen.query("HelpPanel")

    on_monitor(drive_session(), act, panels=[panel])


def test_escape_hides_help_and_else_goes_to_the_panel() -> None:
    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await pilot.press("slash", "f1", "escape")
        assert not monitor.screen.query("HelpPanel")
        assert isinstance(monitor.focused, Input)
        await pilot.press("escape")
        assert not isinstance(monitor.focused, Input)

    on_monitor(drive_session(), act)


@pytest.mark.parametrize("columns", [80, 100])
def test_all_keys_and_tabs_are_on_the_screen(columns: int) -> None:
    frame = [*MonitorApp.BINDINGS, *FramedApp.BINDINGS]

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        for number, panel in enumerate(PANELS, 1):
            await pilot.press(str(number))
            await pilot.pause()
            text = screen_text(monitor)
            for binding in Binding.make_bindings([*frame, *panel.BINDINGS]):
                assert not binding.show or f" {binding.description}" in text
            assert all(f"{n} {one.title}" in text for n, one in enumerate(PANELS, 1))

    on_monitor(drive_session(), act, panels=PANELS, size=(columns, 24))


def test_a_click_presses_a_key() -> None:
    async def act(monitor: MonitorApp, pilot: Any) -> None:
        footer = monitor.query_one(KeyFooter)
        row = screen_text(monitor).splitlines()[footer.region.y]
        await pilot.click(KeyFooter, offset=(row.index("o overwrite"), 0))
        assert monitor.query_one(TracePanel).overwrite
        await pilot.click(KeyFooter, offset=(row.index("o overwrite") - 1, 0))
        assert monitor.query_one(TracePanel).overwrite

    on_monitor(drive_session(), act)


def test_all_keys_of_the_panel_are_commands_by_name() -> None:
    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await pilot.press("ctrl+p", *"overw")
        await until(pilot, lambda: "key o" in screen_text(monitor))
        await pilot.press("enter")
        await until(pilot, lambda: monitor.query_one(TracePanel).overwrite)
        names = [command.title for command in monitor.get_system_commands(monitor.screen)]
        assert {"trace", "nodes", "pause", "arm", "stop all"} <= set(names)

    on_monitor(drive_session(), act)


def said(monitor: MonitorApp) -> list[str]:
    return [note.message for note in monitor._notifications]


class Beacon:
    """Sends a frame each time it is asked."""

    channel, due_us = "", NEVER

    def __init__(self) -> None:
        self.stops = 0

    def tick(self, now_us: int, records: Sequence[DecodedFrame], /) -> Frames:
        return (CanFrame.parse("000#0105"),)

    def stop(self) -> None:
        self.stops += 1
        self.due_us = NEVER


def test_a_arms_and_f9_stops_all(wire: Wire) -> None:
    session, beacon = wire_session(wire), Beacon()
    session.tasks.append(beacon)
    beacon.due_us = 0

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        session.step()
        assert "LISTEN-ONLY" in status(monitor)
        assert (session.withheld, wire.all()) == (1, [])
        await pilot.press("A")
        assert "ARMED" in status(monitor)
        session.step()
        assert wire.next() == "000#0105"
        assert "sent 1" in status(monitor)
        await pilot.press("slash", "f9")  # also from within a field
        assert "LISTEN-ONLY" in status(monitor)
        assert beacon.stops == 1
        await pilot.press("escape", "A", "A")
        assert not session.armed

    on_monitor(session, act)


def test_a_click_on_listen_only_arms(wire: Wire) -> None:
    session = wire_session(wire)

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        monitor.refresh_view()
        await pilot.click("#status", offset=(40, 0))
        assert not session.armed
        await pilot.click("#status", offset=(3, 0))
        assert session.armed

    on_monitor(session, act)


def test_a_log_cannot_be_armed() -> None:
    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await pilot.press("A")
        assert not monitor.session.armed
        assert said(monitor) == ["nothing is sent into a log"]

    on_monitor(drive_session(), act)


@pytest.mark.parametrize("keys", [["q"], ["ctrl+q"], ["ctrl+c"], ["w", "ctrl+q"], ["w", "ctrl+c"]])
def test_these_keys_leave(keys: list[str]) -> None:
    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await pilot.press(*keys)
        assert not monitor.is_running

    on_monitor(drive_session(), act)


def test_the_status_tells_load_controller_errors_and_rate(tmp_path: Path) -> None:
    log = tmp_path / "run.log"
    log.write_text("(0.1) can0 181#01\n(0.2) can0 20000004#0010000000000000\n", "ascii")
    session = open_session([str(log)], BusOptions(), Model(bit_rate=500_000))

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        monitor.refresh_view()
        session.step()
        text = status(monitor)
        assert "can0 0.1 % passive 1 error frames  2 frames  2/s  lost 0  end of the log" in text

    on_monitor(session, act)


def test_what_is_passed_over_is_told_while_it_comes(tmp_path: Path) -> None:
    log = tmp_path / "run.log"
    log.write_text("(0.1) can0 181#01\n(0.2) can0 45123#81:00:12345678#1122\nwhat?\n", "ascii")
    session = open_session([str(log)], BusOptions(), Model())

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        session.step()
        assert "1 frames  1/s  lost 0  passed over 2" in status(monitor)
        await pilot.press("3")
        await pilot.pause()  # now it has a size
        assert shown(monitor)[1] == "lost 0, passed over 2, 1 identifiers by id"

    on_monitor(session, act)


def test_it_fits_into_any_window(wire: Wire) -> None:
    session = wire_session(wire)

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        hear(session, wire, *(f"181#{n:02X}" for n in range(50)))
        for size in ((40, 10), (200, 60), (10, 3), (80, 24)):
            await pilot.resize_terminal(*size)
            await pilot.pause()
            shown(monitor)
            await pilot.pause()
        assert "[1] 31" in screen_text(monitor)

    on_monitor(session, act)


def test_w_keeps_all_settings_in_a_file(tmp_path: Path) -> None:
    path = tmp_path / "bench.toml"

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await pilot.press("w", "escape")
        assert not path.exists()
        await pilot.press("w")
        monitor.screen.query_one("Input").value = str(path)  # type: ignore[attr-defined]
        await pilot.press("enter")
        assert "overwrite = false" in path.read_text("utf-8")
        await pilot.press("o")
        monitor.save()
        assert "overwrite = true" in path.read_text("utf-8")
        await pilot.press("w")
        monitor.screen.query_one("Input").value = str(tmp_path / "no" / "b.toml")  # type: ignore[attr-defined]
        await pilot.press("enter")
        assert "No such file" in said(monitor)[-1]
        assert monitor.panel_settings.workspace.path == path

    on_monitor(drive_session(), act)


def test_what_a_workspace_has_beside_is_told_and_a_foreign_change_too(tmp_path: Path) -> None:
    path = tmp_path / "bench.toml"
    path.write_text("[trace]\nshade = 3\n[radio]\n", "utf-8")

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        assert said(monitor) == ["not known here, and kept: radio, trace.shade"]
        path.write_text("[trace]\n", "utf-8")
        await pilot.press("o")
        monitor.save()
        monitor.save()
        await pilot.pause()
        assert len(said(monitor)) == 2
        assert "changed by another program" in said(monitor)[1]
        assert path.read_text("utf-8") == "[trace]\n"

    on_monitor(
        drive_session(),
        act,
        panel_settings=lambda panels: PanelSettings(Workspace.read(path), MonitorSetup(), panels),
    )


def test_what_ends_the_session_ends_the_monitor() -> None:
    session = drive_session()

    class Broken(Beacon):
        due_us = 0

        def tick(self, now_us: int, records: Sequence[DecodedFrame], /) -> Frames:
            raise ZeroDivisionError

    session.tasks.append(Broken())
    session.start()

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        while monitor.is_running:
            await asyncio.sleep(0.01)

    with pytest.raises(ZeroDivisionError):
        on_monitor(session, act)
