"""One panel of the monitor on our drive in virtual time, with keys pressed."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from typing import Any, Generic, TypeVar

from textual.pilot import Pilot
from textual.widgets import Input, Static

from tests.host.canmon.tui.rig_session import RigSession
from tickrig.host.canmon.tui.app import MonitorApp
from tickrig.host.canmon.tui.panels.panel import Panel
from tickrig.host.canmon.workspace import Workspace
from tickrig.host.tui import LineView, line_text

P = TypeVar("P", bound=Panel)
SIZE = (90, 20)


class Desk(Generic[P]):
    """The panel, and the hands on its keys.

    Attributes:
        panel: the panel.
        session: what it is on.
    """

    def __init__(
        self, monitor: MonitorApp, panel: P, session: RigSession, pilot: Pilot[None]
    ) -> None:
        self._monitor, self._pilot = monitor, pilot
        self.panel, self.session = panel, session

    async def press(self, *keys: str) -> None:
        await self._pilot.press(*keys)
        await self._pilot.pause()

    async def answer(self, text: str) -> None:
        """Answer what is asked."""
        self.panel.query_one(Input).value = text
        await self.press("enter")

    async def click(self, selector: str, offset: tuple[int, int]) -> None:
        await self._pilot.click(selector, offset=offset)
        await self._pilot.pause()

    def lines(self, selector: str = "LineView") -> list[str]:
        """Return the lines of a view as they are now."""
        self._monitor.refresh_view()
        view = self.panel.query(selector).first(LineView)
        return [line_text(line).rstrip() for line in view.lines]

    def static(self, selector: str) -> str:
        """Return what a label says."""
        self._monitor.refresh_view()
        return str(self.panel.query_one(selector, Static).content).strip()

    def told(self) -> list[str]:
        """Return what the monitor told."""
        return [note.message for note in self._monitor._notifications]

    @property
    def asked(self) -> bool:
        return bool(self.panel.query_one("PromptLine").display)


Act = Callable[[Desk[P]], Awaitable[None]]


def at_desk(
    kind: type[P],
    act: Act[P],
    *,
    settings: Mapping[str, Any] | None = None,
    session: RigSession | None = None,
) -> P:
    """Run a monitor with one panel while something is done with it."""
    found = session or RigSession()

    async def main() -> P:
        panel = kind(found)
        panel.load(settings or {})
        monitor = MonitorApp(found, [panel])
        async with monitor.run_test(size=SIZE) as pilot:
            await pilot.pause()
            await act(Desk(monitor, panel, found, pilot))
        return panel

    return asyncio.run(main())


def kept(panel: Panel) -> dict[str, Any]:
    """Return the settings as they come back from a workspace."""
    workspace = Workspace()
    workspace.put(panel.section, panel.save())
    return Workspace(workspace.text).section(panel.section)
