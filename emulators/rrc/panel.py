"""The operator panel of the RRC: a small full-screen program (extra `tui`)."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from typing import ClassVar, Final

from rich.text import Text
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.widgets import Footer, Static

from tickrig.emulators.inbox import EmulatorEnded
from tickrig.emulators.requests import VERSION, Object
from tickrig.emulators.rrc import panel_text
from tickrig.emulators.rrc.panel_text import FAULT_KEYS, View
from tickrig.emulators.trace import Mark
from tickrig.host.cli.duration import format_time

Ask = Callable[[Sequence[Object]], Awaitable[list[Object]]]
"""Makes requests of an emulator, those of the control socket, and brings the answers."""

REFRESH_S: Final = 0.1
STEP_PCT: Final = 10
KEPT_LINES: Final = 60


class RrcPanel(App[None]):
    """Stick, buttons, faults and lamps of an RRC and its VR2.

    A terminal tells no key-up: arrows move the stick and leave it there, a
    button key is a pulse of 100 ms, and capitals hold the speed buttons.

    Args:
        ask: reaches the emulator.
        ready: called when the screen stands, to start the emulator.
    """

    ENABLE_COMMAND_PALETTE = False
    CSS = """
    #top { height: 14; }
    #stick { width: 27; }
    #right { width: 1fr; }
    #outputs { height: 8; }
    #controls { height: 6; }
    #wire { height: 1fr; }
    .pane { border: round $primary; padding: 0 1; }
    #status { height: 1; background: $boost; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up", "stick(1,0)", "forward", show=False, priority=True),
        Binding("down", "stick(-1,0)", "back", show=False, priority=True),
        Binding("left", "stick(0,-1)", "left", show=False, priority=True),
        Binding("right", "stick(0,1)", "stick", key_display="←↑↓→", priority=True),
        Binding("space", "centre", "centre"),
        Binding("p", "press('power_button')", "power"),
        Binding("a", "press('alarm_button')", "alarm"),
        Binding("u", "press('speed_up_button')", "speed", key_display="u d"),
        Binding("d", "press('speed_down_button')", show=False),
        Binding("U", "hold('speed_up_button')", "hold", key_display="U D"),
        Binding("D", "hold('speed_down_button')", show=False),
        *[
            Binding(key, f"fault('{name}')", "faults", show=key == "1", key_display="1-6")
            for key, name in FAULT_KEYS.items()
        ],
        Binding("q,ctrl+c", "quit", "quit", key_display="q"),
    ]

    def __init__(self, ask: Ask, ready: Callable[[], None] = lambda: None) -> None:
        super().__init__()
        self._ask, self._when_ready = ask, ready
        self.view = View()
        self._seen = 0  # number of the latest line
        self._shown: dict[str, Text] = {}  # what each pane shows: drawing is dear

    def compose(self) -> ComposeResult:
        """Lay out the panes."""
        with Horizontal(id="top"):
            yield _pane("stick", "stick")
            with Vertical(id="right"):
                yield _pane("outputs", "RRC and VR2")
                yield _pane("controls", "buttons and faults")
        yield _pane("wire", "wire")
        yield Static(id="status")
        yield Footer(compact=True)

    def on_ready(self) -> None:
        """Begin to look at the emulator."""
        self._when_ready()
        self.set_interval(REFRESH_S, self.look)

    async def look(self) -> None:
        """Fetch what there is to see, and show it."""
        answers = await self._request(
            _request("get"), _request("status"), _request("lines", since=self._seen)
        )
        if answers and self.query("#wire"):  # the screen may be gone by now
            self._take(*answers)
            self._show()

    async def action_stick(self, v_steps: int, w_steps: int) -> None:
        """Move the stick by steps of 10 %."""
        stick = [
            max(-100, min(100, self.view.number(name) + steps * STEP_PCT))
            for name, steps in (("stick_v_pct", v_steps), ("stick_w_pct", w_steps))
        ]
        await self._do(_request("set", name="stick", value=stick))

    async def action_centre(self) -> None:
        """Let the stick go."""
        await self._do(_request("set", name="stick", value=[0, 0]))

    async def action_press(self, name: str) -> None:
        """Press a button for a moment."""
        await self._do(_request("press", name=name))

    async def action_hold(self, name: str) -> None:
        """Hold a button, or let it go."""
        await self._do(_request("set", name=name, value=1 - self.view.number(name)))

    async def action_fault(self, name: str) -> None:
        """Let a fault come, or go."""
        if name in self.view.faults:
            await self._do(_request("clear", name=name))
        else:
            await self._do(_request("fault", spec=name))

    async def _do(self, request: Object) -> None:
        await self._request(request)
        await self.look()

    async def _request(self, *requests: Object) -> list[Object]:
        try:
            return await self._ask(requests)
        except EmulatorEnded:
            self.exit()
            return []

    def _take(self, values: Object, status: Object, lines: Object) -> None:
        fresh = [line for line in _lines(lines) if line[0] > self._seen]
        self._seen = fresh[-1][0] if fresh else self._seen
        reports = [text for _, _, mark, text in fresh if _is_report(mark, text)]
        events = [line[1:] for line in fresh if not _is_report(*line[2:])]
        self.view = View(
            _values(values["values"]),
            _values(status),
            (*self.view.lines, *events)[-KEPT_LINES:],
            reports[-1] if reports else self.view.report,
        )

    def _show(self) -> None:
        view = self.view
        pad = panel_text.stick_pad(view.number("stick_v_pct"), view.number("stick_w_pct"))
        wire = self.query_one("#wire", Static)
        wire.border_subtitle = view.report
        for name, text in (
            ("stick", pad),
            ("outputs", panel_text.outputs_pane(view)),
            ("controls", panel_text.controls_pane(view)),
            ("wire", panel_text.wire_pane(view, wire.content_size.height)),
            ("status", panel_text.status_line(view)),
        ):
            if self._shown.get(name) != text:
                self._shown[name] = text
                self.query_one(f"#{name}", Static).update(text)


def _is_report(mark: str, text: str) -> bool:
    return mark == Mark.FROM_DEVICE and text.startswith("SA:")


def _pane(name: str, title: str) -> Static:
    pane = Static(id=name, classes="pane")
    pane.border_title = title
    return pane


def _request(do: str, **fields: object) -> Object:
    return {"v": VERSION, "do": do, **fields}


def _values(answer: object) -> dict[str, int | str]:
    if not isinstance(answer, dict):
        return {}
    return {name: value for name, value in answer.items() if isinstance(value, int | str)}


def _lines(answer: Object) -> list[tuple[int, str, str, str]]:
    lines = answer["lines"]
    if not isinstance(lines, list):
        return []
    return [(x["number"], format_time(x["at_us"]), x["mark"], x["text"]) for x in lines]
