from __future__ import annotations

from typing import Any

import pytest

from tests.host.canmon.tui.pilot import drive_session, hear, on_monitor, wire_session
from tests.host.canmon.wire import Wire
from tickrig.host.canmon.tui.app import MonitorApp
from tickrig.host.canmon.tui.panels.statistics_panel import StatisticsPanel
from tickrig.host.canmon.tui.panels.trace_panel import CHANGED
from tickrig.host.canmon.workspace import SettingError
from tickrig.host.tui import LineView, line_text


def shown(monitor: MonitorApp) -> list[str]:
    """Return heads and rows as they are now."""
    monitor.refresh_view()
    views = monitor.shown.query(LineView)
    return [line_text(line).rstrip() for view in views for line in view.lines]


def test_it_is_the_table_of_top_and_its_keys() -> None:
    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await pilot.press("3")
        await pilot.pause()  # now it has a size
        lines = shown(monitor)
        assert lines[0].startswith("can0: 134 frames, load 20.1 kbit/s")
        assert lines[1] == "lost 0, 14 identifiers by id"
        assert lines[3].split()[:2] == ["000", "4"]
        await pilot.press("b")
        assert "█" in "".join(shown(monitor))
        await pilot.press("n")
        assert "█" not in "".join(shown(monitor))
        await pilot.press("b", "d")
        assert any(line.endswith("5 boot-up boot-up") for line in shown(monitor))
        await pilot.press("d", "s")
        assert shown(monitor)[1].endswith("by rate")
        await pilot.press("c")
        assert shown(monitor)[0] == "lost 0, 0 identifiers by rate"

    on_monitor(drive_session(), act, size=(160, 30))


def test_space_holds_it(wire: Wire) -> None:
    session = wire_session(wire)

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await pilot.press("3")
        await pilot.pause()  # now it has a size
        hear(session, wire, "181#01")
        shown(monitor)
        await pilot.press("space")
        hear(session, wire, "181#02", "182#01")
        assert "held" in shown(monitor)[1]
        assert "181              1" in "\n".join(shown(monitor))
        await pilot.press("space")
        assert "181              2" in "\n".join(shown(monitor))
        line = monitor.shown.query_one("#rows", LineView).lines[0]
        assert [text for text, style in line if style == CHANGED] == ["02"]

    on_monitor(session, act)


def test_a_narrow_window_has_fewer_columns() -> None:
    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await pilot.press("3")
        await pilot.pause()  # now it has a size
        assert "jitter" in shown(monitor)[2]
        await pilot.resize_terminal(60, 20)
        await pilot.pause()
        assert "jitter" not in shown(monitor)[2]

    on_monitor(drive_session(), act, size=(160, 30))


def test_its_settings_come_back() -> None:
    settings = {"sort": "jitter", "bits": True, "decode": True}
    panel = StatisticsPanel(drive_session())
    panel.load(settings)
    assert panel.save() == settings
    with pytest.raises(SettingError, match="sort: 'size' is not one of id, rate, jitter, gap, age"):
        panel.load({"sort": "size"})


def test_heads_stay_when_rows_are_scrolled() -> None:
    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await pilot.press("3")
        await pilot.pause()
        shown(monitor)
        await pilot.press("end")
        await pilot.pause()
        assert monitor.shown.query_one("#rows", LineView).top > 0
        assert monitor.shown.query_one("#heads", LineView).top == 0
        heads = monitor.shown.query_one("#heads", LineView)
        assert line_text(heads.lines[-1]).startswith("CAN-ID")

    on_monitor(drive_session(), act, size=(100, 14))
