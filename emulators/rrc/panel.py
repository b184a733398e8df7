"""The operator panel of the RRC: a small full-screen program (extra `tui`)."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Awaitable, Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import ClassVar, Final

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.widgets import Static

from tickrig.emulators.bench.control import EmulatorControl, EmulatorEnded, RequestInbox
from tickrig.emulators.rrc import panel_text, small_panel_text
from tickrig.emulators.rrc.panel_text import FAULT_KEYS, Observer, PanelView
from tickrig.emulators.serial.emulator import Emulator
from tickrig.host.control.requests import VERSION, Object
from tickrig.host.rrc import gauges
from tickrig.host.tui import FramedApp, KeyFooter

_SendRequests = Callable[[Sequence[Object]], Awaitable[list[Object]]]
"""Function that sends requests of the control socket to an emulator, and returns the answers."""

_REFRESH_S: Final = 0.1
_STEP_PCT: Final = 10

HELP: Final = """\
arrows  move the stick by 10 %; it stays where it is
space   let the stick go
p       power button: VR2 on, off, out of a forced stop
a       alarm button: in Standby the stick drives then,
        plainly; with D held without backing, with U with
        gears, with both it also backs towards the stick
u d     press a speed button
U D     hold a speed button, or let it go
1-6     let a fault come, or go; 6 cuts the line
F1 ?    this help; Esc leaves it
q       end the emulator"""

_LEAST: Final = (60, 15)
_ROOMY: Final = (80, 24)
"""Columns and lines: `_LEAST` is the minimum for the panel, `_ROOMY` shows the complete panel."""


def _too_small(size: tuple[int, int], least: tuple[int, int]) -> Text:
    """Report that the terminal is too small, in columns and lines."""
    have, need = (f"{columns} x {lines}" for columns, lines in (size, least))
    return Text(f"terminal too small: {have}, at least {need}")


class RrcPanel(FramedApp):
    """Terminal panel of an emulated RRC and its VR2 wheelchair: stick, buttons, faults and lamps.

    A terminal does not report the release of a key. So an arrow key moves the stick and leaves it
    there, a button key presses the button for 100 ms, and a capital letter holds a speed button.

    In a terminal smaller than 80 x 24 the panel has no square for the stick and no frames. The
    smallest size is 60 x 15.

    Args:
        send: function that sends requests to the emulator, and returns the answers of the emulator.
        ready: function that is called when the screen is ready, to start the emulator.
    """

    ENABLE_COMMAND_PALETTE = False
    # Textual's names, never changed: classes of the screen from so many columns and lines on.
    HORIZONTAL_BREAKPOINTS = [(0, "-tiny"), (_LEAST[0], "-small"), (_ROOMY[0], "-roomy")]  # noqa: RUF012
    VERTICAL_BREAKPOINTS = [(0, "-tiny"), (_LEAST[1], "-small"), (_ROOMY[1], "-roomy")]  # noqa: RUF012
    CSS_PATH = "panel.tcss"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up", "stick(1,0)", "forward", show=False, priority=True),
        Binding("down", "stick(-1,0)", "back", show=False, priority=True),
        Binding("left", "stick(0,-1)", "left", show=False, priority=True),
        Binding("right", "stick(0,1)", "stick", key_display="←↑↓→", priority=True),
        Binding("space", "centre", "centre"),
        Binding("p", "press('power_button')", "power"),
        Binding("a", "press('alarm_button')", "alarm"),
        Binding("u", "press('speed_up_button')", "speed", key_display="u d U D"),
        Binding("d", "press('speed_down_button')", "speed down", show=False),
        Binding("U", "hold('speed_up_button')", "hold speed up", show=False),
        Binding("D", "hold('speed_down_button')", "hold speed down", show=False),
        *[
            Binding(key, f"fault('{name}')", "faults", show=key == "1", key_display="1-6")
            for key, name in FAULT_KEYS.items()
        ],
    ]

    def __init__(self, send: _SendRequests, ready: Callable[[], None] = lambda: None) -> None:
        super().__init__()
        self._send, self._when_ready = send, ready
        self._observer = Observer()
        self._shown: dict[str, Text] = {}  # what each pane shows: drawing is dear

    def compose(self) -> ComposeResult:
        """Lay out the panes."""
        with Vertical(id="panel"):
            with Horizontal(id="top"):
                yield _pane("stick", "stick")
                with Vertical(id="right"):
                    yield _pane("outputs", "RRC and VR2")
                    yield _pane("controls", "buttons and faults")
            yield _pane("wire", "wire")
            yield Static(id="report")
            yield Static(id="status")
        yield Static(HELP, id="help", markup=False)
        yield Static(id="tiny")
        yield KeyFooter()

    @property
    def view(self) -> PanelView:
        """The displayed view."""
        return self._observer.view

    @property
    def helps(self) -> bool:
        """Whether the help of the panel is on the screen.

        The panel has its own help, because Textual's help does not fit beside it.
        """
        return bool(self.screen_stack and self.screen.has_class("-helps"))

    def action_show_help_panel(self) -> None:
        """Show the help for the keys."""
        self.screen.add_class("-helps")
        self.refresh_bindings()

    def action_hide_help_panel(self) -> None:
        """Show the panel again."""
        self.screen.remove_class("-helps")
        self.refresh_bindings()

    def on_ready(self) -> None:
        """Start to poll the emulator."""
        self._when_ready()
        self.set_interval(_REFRESH_S, self.look)

    async def look(self) -> None:
        """Fetch the present state, and show it."""
        answers = await self._request(
            _request("get"), _request("status"), _request("lines", since=self._observer.seen)
        )
        if answers and self.query("#wire"):  # the screen may be gone by now
            self._observer.take(*answers)
            self._show()

    async def action_stick(self, v_steps: int, w_steps: int) -> None:
        """Move the stick by steps of 10 %."""
        stick = [
            max(-100, min(100, self.view.number(name) + steps * _STEP_PCT))
            for name, steps in (("stick_v_pct", v_steps), ("stick_w_pct", w_steps))
        ]
        await self._do(_request("set", name="stick", value=stick))

    async def action_centre(self) -> None:
        """Release the stick."""
        await self._do(_request("set", name="stick", value=[0, 0]))

    async def action_press(self, name: str) -> None:
        """Press a button for a moment."""
        await self._do(_request("press", name=name))

    async def action_hold(self, name: str) -> None:
        """Hold or release a button."""
        await self._do(_request("set", name=name, value=1 - self.view.number(name)))

    async def action_fault(self, name: str) -> None:
        """Start or clear a fault."""
        if name in self.view.faults:
            await self._do(_request("clear", name=name))
        else:
            await self._do(_request("fault", spec=name))

    async def _do(self, request: Object) -> None:
        await self._request(request)
        await self.look()

    async def _request(self, *requests: Object) -> list[Object]:
        try:
            return await self._send(requests)
        except EmulatorEnded:
            self.exit()
            return []

    def _show(self) -> None:
        view, roomy = self.view, self.size.width >= _ROOMY[0] and self.size.height >= _ROOMY[1]
        panes = panel_text if roomy else small_panel_text
        pad = gauges.stick_pad(view.number("stick_v_pct"), view.number("stick_w_pct"))
        self.query_one("#stick").border_subtitle = panel_text.stick_hint(view)
        for name, text in (
            ("stick", pad),
            ("outputs", panes.outputs_pane(view)),
            ("controls", panes.controls_pane(view)),
            ("wire", panel_text.wire_pane(view, self.query_one("#wire").content_size.height)),
            ("report", panes.report_line(view)),
            ("status", panel_text.status_line(view)),
            ("tiny", _too_small(self.size, _LEAST)),
        ):
            if self._shown.get(name) != text:
                self._shown[name] = text
                self.query_one(f"#{name}", Static).update(text)


def _pane(name: str, title: str) -> Static:
    pane = Static(id=name, classes="pane")
    pane.border_title = title
    return pane


def _request(do: str, **fields: object) -> Object:
    return {"v": VERSION, "do": do, **fields}


# Run an emulator in a thread of its own, and the operator panel in this one.

_SWITCH_S: Final = 0.000_2
"""Longest time for which the screen may block the rig; a tick is 10 ms."""


def run_panel(emulator: Emulator) -> None:
    """Show the panel until it is closed or the emulator is stopped."""
    inbox = RequestInbox(EmulatorControl(emulator))

    def run() -> None:
        with _ending(emulator, inbox):
            while emulator.running:
                emulator.step()
                inbox.serve()

    async def send(requests: Sequence[Object]) -> list[Object]:
        return await asyncio.wrap_future(inbox.post(requests))

    started: list[Future[None]] = []
    panel = RrcPanel(send, lambda: started.append(pool.submit(run)))
    before_s = sys.getswitchinterval()
    sys.setswitchinterval(_SWITCH_S)
    try:
        with (
            panel.ended_by_signals(),
            ThreadPoolExecutor(1, "rig") as pool,
            _ending(emulator, inbox),
        ):
            panel.run()
    finally:
        sys.setswitchinterval(before_s)
    for rig in started:
        rig.result()


@contextmanager
def _ending(emulator: Emulator, inbox: RequestInbox) -> Iterator[None]:
    """Stop the emulator, and release all waiting requests, on any exit."""
    try:
        yield
    finally:
        emulator.stop()
        inbox.close()
