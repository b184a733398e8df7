"""The monitor without a terminal, stepped by hand."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterable
from pathlib import Path
from typing import Any

from textual.app import App

from tests.host.canmon.wire import Wire
from tickrig.host.canmon.sources.source import FileSource, FileSpec
from tickrig.host.canmon.tui.app import MonitorApp
from tickrig.host.canmon.tui.panels.nodes_panel import NodesPanel
from tickrig.host.canmon.tui.panels.panel import Panel
from tickrig.host.canmon.tui.panels.statistics_panel import StatisticsPanel
from tickrig.host.canmon.tui.panels.trace_panel import TracePanel
from tickrig.host.canmon.tui.session import Model, Session, open_session
from tickrig.host.canmon.workspace import PanelSettings
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.tui import LineView, line_text

DRIVE = Path(__file__).parents[3] / "golden/canmon/drive.log"
OURS = (TracePanel, NodesPanel, StatisticsPanel)
SIZE = (120, 30)
PATIENCE_US = 10_000_000
TRIES = 1_000

Act = Callable[[MonitorApp, Any], Awaitable[None]]


def drive_session() -> Session:
    """A session on the recorded drive, all of it taken."""
    session = Session(FileSource([FileSpec(DRIVE)]), Model())
    while not session.model.ended:
        session.step()
    return session


def wire_session(wire: Wire) -> Session:
    """A session on a bus whose far end a test holds."""
    return open_session([wire.word], BusOptions(bitrate=None), Model(bit_rate=500_000))


def hear(session: Session, wire: Wire, *frames: str) -> None:
    """Send frames at the far end and let the session take them."""
    count = session.model.frames + len(frames)
    for frame in frames:
        wire.send(frame)
    while session.model.frames < count:
        before = session.model.frames
        session.step(PATIENCE_US)
        assert session.model.frames > before


def on_monitor(
    session: Session,
    act: Act,
    *,
    panels: Iterable[type[Panel]] = OURS,
    size: tuple[int, int] = SIZE,
    panel_settings: Callable[[list[Panel]], PanelSettings] | None = None,
) -> MonitorApp:
    """Run a monitor while something is done with it."""

    async def main() -> MonitorApp:
        made = [panel(session) for panel in panels]
        monitor = MonitorApp(session, made, panel_settings(made) if panel_settings else None)
        async with monitor.run_test(size=size) as pilot:
            await pilot.pause()
            await act(monitor, pilot)
        return monitor

    try:
        return asyncio.run(main())
    finally:
        session.close()
        session.source.close()


def shown(monitor: MonitorApp) -> list[str]:
    """Return the lines of the panel on the screen, as they are now."""
    monitor.refresh_view()
    return [line_text(line).rstrip() for line in monitor.shown.query_one(LineView).lines]


async def until(pilot: Any, holds: Callable[[], bool]) -> None:
    """Let the monitor work until something holds."""
    for _ in range(TRIES):
        if holds():
            return
        await pilot.pause(0.01)
    raise AssertionError(screen_text(pilot.app))


def screen_text(app: App[None]) -> str:
    """Return all that is on the screen."""
    strips = app.screen._compositor.render_strips()
    return "\n".join(strip.text.rstrip() for strip in strips)
