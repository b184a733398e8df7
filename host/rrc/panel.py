"""The panel of a chair, to drive a real or emulated RRC by keys or a game pad (extra `tui`)."""

from __future__ import annotations

import signal
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing
from types import FrameType
from typing import ClassVar, Final

import click
from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.widgets import Static

from tickrig.host.cli.start import taking_signals
from tickrig.host.rrc import gauges
from tickrig.host.rrc.cli import RrcCall
from tickrig.host.rrc.gauges import DIM, FAULT, ON
from tickrig.host.rrc.pilot import Drives, Pilot, PilotView
from tickrig.host.rrc.verbs import Ended, open_chair, open_pad
from tickrig.host.text.values import format_time
from tickrig.host.tui import FramedApp, KeyFooter

REFRESH_S: Final = 0.1
_STEP_PCT: Final = 10
_LEAST: Final = (60, 15)
_ROOMY: Final = (80, 24)

HELP: Final = """\
space   dead-man key: the chair drives while it is held, or
        pressed again within 1 s; on a game pad any button
arrows  aim forward, back, left, right, by 10 %
x       release the key, and aim at 0
h       the host drives: the aim, while the key is held
s       the stick drives, within the limit; + - change it
n       stop the chair
1-5     speed mode, 1 is the slowest
b       beep
P       stop VR2 by force
F1 ?    this help; Esc leaves it
q       stop the chair and end"""

_STYLES: Final = {"<": "bold cyan", ">": "bold green", "!": "bold red"}


class ChairPanel(FramedApp):
    """Full-screen terminal panel that shows the state of a wheelchair and drives it by keys.

    If the terminal is smaller than 80 x 24 characters, the panel does not draw the stick position.
    The smallest usable size is 60 x 15.

    Args:
        pilot: pilot that executes what the keys request.
        url: URL of the port as shown on the screen.

    Attributes:
        interrupted: whether Ctrl-C ended the panel. The terminal sends Ctrl-C as a key, not as a
            signal.
    """

    ENABLE_COMMAND_PALETTE = False
    # Textual's names, never changed.
    HORIZONTAL_BREAKPOINTS = [(0, "-tiny"), (_LEAST[0], "-small"), (_ROOMY[0], "-roomy")]  # noqa: RUF012
    VERTICAL_BREAKPOINTS = [(0, "-tiny"), (_LEAST[1], "-small"), (_ROOMY[1], "-roomy")]  # noqa: RUF012
    CSS = """
    #top { height: 14; }
    #aim { width: 27; }
    #state { width: 1fr; height: 14; }
    #lines { height: 1fr; }
    .pane { border: round $primary; padding: 0 1; }
    #status { height: 1; background: $boost; }
    .-small #aim { display: none; }
    .-small #top, .-small #state { height: 8; }
    .-small .pane { border: none; }
    #help { display: none; padding: 0 1; }
    .-helps #panel { display: none; }
    .-helps #help { display: block; }
    #tiny { display: none; }
    .-tiny #panel, .-tiny #help, .-tiny #keys { display: none; }
    .-tiny #tiny { display: block; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("space", "hold", "drive", priority=True),
        Binding("up", "aim(1,0)", "forward", show=False, priority=True),
        Binding("down", "aim(-1,0)", "back", show=False, priority=True),
        Binding("left", "aim(0,-1)", "left", show=False, priority=True),
        Binding("right", "aim(0,1)", "aim", key_display="←↑↓→", priority=True),
        Binding("x", "release", "release"),
        Binding("h", "take('host')", "host"),
        Binding("s", "take('stick')", "stick"),
        Binding("n", "take('stopped')", "stop"),
        Binding("plus", "limit(1)", "limit", key_display="+ -"),
        Binding("minus", "limit(-1)", "limit down", show=False),
        *[
            Binding(str(n), f"speed({n})", "speed", show=n == 1, key_display="1-5")
            for n in range(1, 6)
        ],
        Binding("b", "beep", "beep"),
        Binding("P", "power_off", "power off"),
        Binding("ctrl+c", "interrupt", "interrupt", show=False, priority=True),
    ]

    def __init__(self, pilot: Pilot, url: str) -> None:
        super().__init__()
        self.interrupted = False
        self._pilot, self._url = pilot, url
        self._shown: dict[str, Text] = {}  # what each pane shows: drawing is dear

    def compose(self) -> ComposeResult:
        """Lay out the panes."""
        with Vertical(id="panel"):
            with Horizontal(id="top"):
                yield _pane("aim", "aim")
                yield _pane("state", "RRC and VR2")
            yield _pane("lines", "events")
            yield Static(id="status")
        yield Static(HELP, id="help", markup=False)
        yield Static(id="tiny")
        yield KeyFooter()

    @property
    def helps(self) -> bool:
        """Whether help is on the screen."""
        return bool(self.screen_stack and self.screen.has_class("-helps"))

    def action_show_help_panel(self) -> None:
        """Show the help on the keys."""
        self.screen.add_class("-helps")
        self.refresh_bindings()

    def action_hide_help_panel(self) -> None:
        """Show the panel again."""
        self.screen.remove_class("-helps")
        self.refresh_bindings()

    def on_ready(self) -> None:
        """Start to poll the chair."""
        self.look()
        self.set_interval(REFRESH_S, self.look)

    def action_hold(self) -> None:
        """Press the dead-man key."""
        self._pilot.press()

    def action_aim(self, v_steps: int, w_steps: int) -> None:
        """Change the values to drive by steps of 10 %."""
        self._pilot.aim(v_steps * _STEP_PCT, w_steps * _STEP_PCT)

    def action_release(self) -> None:
        """Release the dead-man key."""
        self._pilot.release()

    def action_take(self, drives: str) -> None:
        """Choose the host or the stick as driver."""
        self._pilot.take(Drives(drives))

    def action_limit(self, steps: int) -> None:
        """Change the limit of the stick by 10 %."""
        self._pilot.limit_stick(steps * _STEP_PCT)

    def action_speed(self, mode: int) -> None:
        """Choose the speed mode."""
        self._pilot.choose_speed(mode)

    def action_beep(self) -> None:
        """Sound the buzzer."""
        self._pilot.beep()

    def action_interrupt(self) -> None:
        """End the panel as if the signal of Ctrl-C was received."""
        self.interrupted = True
        self.end()

    def action_power_off(self) -> None:
        """Force VR2 to stop."""
        self._pilot.power_off()

    def look(self) -> None:
        """Show the present state."""
        if not self.query("#lines"):  # the screen may be gone by now
            return
        view = self._pilot.view
        have, least = (f"{columns} x {lines}" for columns, lines in (self.size, _LEAST))
        for name, text in (
            ("aim", gauges.stick_pad(*view.aim_pct)),
            ("state", _state_pane(view)),
            ("lines", _lines_pane(view, self.query_one("#lines").content_size.height)),
            ("status", Text(f" {self._url}   {view.now_us / 1e6:.1f} s")),
            ("tiny", Text(f"terminal too small: {have}, at least {least}")),
        ):
            if self._shown.get(name) != text:
                self._shown[name] = text
                self.query_one(f"#{name}", Static).update(text)


def _pane(name: str, title: str) -> Static:
    pane = Static(id=name, classes="pane")
    pane.border_title = title
    return pane


def _state_pane(view: PilotView) -> Text:
    """Show the driver, the effect of the driver, and the reports of the RRC."""
    sa, (aim_v, aim_w) = view.status, view.aim_pct
    key = (" DRIVES ", "bold black on green") if view.held else (" released ", "reverse dim")
    who = f" {view.drives.text}"
    if view.drives is Drives.STICK:
        who += f", at most {view.most_pct} %"
    rows = [
        Text.assemble(key if view.drives is Drives.HOST else ("", ""), (who, "bold")),
        Text.assemble(
            *("aim    ", f"v {gauges.signed(aim_v)} %  w {gauges.signed(aim_w)} %"),
            *("   stick ", "" if sa is None else f"{sa.in_v_pct:+} {sa.in_w_pct:+}"),
        ),
    ]
    if sa is None:
        rows.append(Text(" VR2 is off: press its power button ", style=FAULT))
    else:
        rows += [
            Text.assemble("drive  v ", gauges.bar(sa.out_v_pct)),
            Text.assemble("       w ", gauges.bar(sa.out_w_pct)),
            Text.assemble(
                *("speed  ", gauges.scale(sa.speed_mode, 5)),
                *("   gauge ", gauges.scale(sa.gauge, 10)),
            ),
        ]
    if view.load is not None:
        rows.append(Text(f"load   {view.load.load_pct} %, margin {view.load.margin_pct} %"))
    return Text("\n").join(rows)


def _lines_pane(view: PilotView, height: int) -> Text:
    """Show the latest events, with the newest at the bottom."""
    shown = view.lines[max(0, len(view.lines) - height) :]
    rows = [
        Text.assemble((f"{format_time(at_us):>11} ", DIM), (f"{mark} {text}", _STYLES[mark]))
        for at_us, mark, text in shown
    ]
    return Text("\n").join(rows) if rows else Text("h: the host drives   s: the stick", style=ON)


def run() -> None:
    """Show the panel until it is closed. Then stop the chair."""
    call = click.get_current_context().find_object(RrcCall)
    assert call is not None
    ended, stop = Ended(), threading.Event()
    with ExitStack() as stack:
        pad = None if call.pad is None else stack.enter_context(closing(open_pad(call.pad)))
        chair = stack.enter_context(open_chair(ended))
        pilot = Pilot(chair, pad)
        panel = ChairPanel(pilot, call.url)

        def received(number: int, frame: FrameType | None) -> None:
            ended.received(number, frame)
            panel.end()

        def step() -> None:
            try:
                while not stop.is_set():
                    pilot.step()
            finally:
                panel.end()

        with taking_signals(received), ThreadPoolExecutor(1, "rrc") as pool:
            stepping = pool.submit(step)
            try:
                if ended.number:  # it came while the port was opened
                    panel.end()
                panel.run()
            finally:
                stop.set()
            if panel.interrupted:
                ended.received(signal.SIGINT, None)
        stepping.result()
