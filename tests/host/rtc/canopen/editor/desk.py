"""The System Editor on a rig in virtual time."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from unittest.mock import patch

from textual.pilot import Pilot
from textual.widgets import Input

from tests.host.rtc.canopen.bench import SYSTEMS, node
from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.node import Node
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.host.rtc.canopen.editor import app as editor_app
from tickrig.host.rtc.canopen.editor.app import SystemEditor
from tickrig.host.rtc.canopen.editor.session import AddComponents, EditorSession
from tickrig.host.rtc.canopen.events import ServerEvent
from tickrig.host.rtc.canopen.serve import open_server
from tickrig.host.rtc.editor.widgets import CursorView
from tickrig.host.tui import LineView, line_text

FIG_120 = SYSTEMS / "fig120.yaml"
CAST = {16: "f-palette", 32: "motor-core-unit"}


class Desk:
    """An editor, and the nodes that it is about; time passes when it is told to.

    Attributes:
        app: the editor.
        pilot: presses keys.
        nodes: by node-ID.
    """

    def __init__(self, path: Path, models: dict[int, str], furnish: AddComponents) -> None:
        wire = CanWire()
        self.nodes: dict[int, Node] = {n: node(wire, n, model) for n, model in models.items()}
        rig = Rig(*(Station(one, one.port) for one in self.nodes.values()))
        self.link = CanHost(rig, wire.end())
        self.events: list[ServerEvent] = []
        server = open_server(path)
        furnish(server)
        self.session = EditorSession(server, path, self.link, furnish, (self.events.append,))
        self.app = SystemEditor(self.session, "rig")
        self.pilot: Pilot[None]

    async def pass_ms(self, duration_ms: int) -> None:
        until_us = self.link.now_us + 1_000 * duration_ms
        while self.link.now_us < until_us:
            self.session.turn(until_us)
        self.app.look()
        await self.pilot.pause()

    async def press(self, *keys: str, then_ms: int = 0) -> None:
        await self.pilot.press(*keys)
        await self.pilot.pause()
        if then_ms:
            await self.pass_ms(then_ms)

    async def answer(self, text: str) -> None:
        """Write the answer to a question."""
        self.app.screen.query_one(Input).value = text
        await self.press("enter")

    async def go_to(self, text: str, pane: str = "system") -> None:
        """Put the cursor on the first row that has a text."""
        view = self._pane(pane)
        assert isinstance(view, CursorView)
        view.focus()
        places = [n for n, row in enumerate(view.rows_shown) if text in line_text(row.line)]
        assert places, f"{text} is not in {self.shown(pane)}"
        view.put_cursor(places[0])
        await self.pilot.pause()

    def shown(self, pane: str = "system") -> str:
        lines = self._pane(pane).lines
        return "\n".join(line_text(line).rstrip() for line in lines)

    def _pane(self, name: str) -> LineView:
        """Return a pane of the screen in front, or of one behind it."""
        found = (
            one for screen in reversed(self.app.screen_stack) for one in screen.query(LineView)
        )
        pane: LineView = next(pane for pane in found if pane.id == name)
        return pane

    def line(self, text: str, pane: str = "system") -> str:
        return next((one for one in self.shown(pane).splitlines() if text in one), "")

    @property
    def said(self) -> list[str]:
        return [str(notification.message) for notification in self.app._notifications]


Act = Callable[[Desk], Awaitable[None]]


def at_desk(
    act: Act,
    path: Path = FIG_120,
    models: dict[int, str] | None = None,
    size: tuple[int, int] = (80, 24),
    furnish: AddComponents = lambda server: None,
) -> None:
    """Let somebody work where all nodes have booted; the screen's own clock stands still."""

    async def main() -> None:
        desk = Desk(path, models or CAST, furnish)
        async with desk.app.run_test(size=size) as pilot:
            desk.pilot = pilot
            await desk.pass_ms(700)
            await act(desk)

    with patch.object(editor_app, "PAINT_S", 3_600):
        asyncio.run(main())
