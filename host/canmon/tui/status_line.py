"""The line at the bottom: how the bus is, what got lost, and whether frames may be sent."""

from __future__ import annotations

from typing import Final

from rich.segment import Segment
from rich.style import Style
from textual.events import Click
from textual.strip import Strip
from textual.widget import Widget

from tickrig.host.canmon.model.frames.quantity import load_text
from tickrig.host.canmon.tui.tasks.recorder_task import RecorderTask
from tickrig.host.canmon.tui.tasks.session import Session
from tickrig.host.tui.line_view import Line

ARMED: Final = (" ARMED ", "bold white on red")
LISTENING: Final = (" LISTEN-ONLY ", "bold black on green")
WARNING: Final = "bold yellow"
ALARM: Final = "bold red"


class StatusLine(Widget):
    """Shows a status; a click on its first word arms or disarms.

    Args:
        session: what it is about.
        recorder: what records.
    """

    DEFAULT_CSS = "StatusLine { height: 1; background: $boost; }"

    def __init__(self, session: Session, recorder: RecorderTask) -> None:
        super().__init__(id="status")
        self._session, self._recorder = session, recorder
        self._counts = [0]
        self.line: Line = ()

    def refresh_view(self) -> None:
        """Show how things are now; called ten times a second."""
        with self._session.lock:
            line = self._status()
        if line != self.line:
            self.line = line
            self.refresh()

    def _status(self) -> Line:
        """Return the line: who may send, the buses, counts, what is wrong."""
        session, model = self._session, self._session.model
        self._counts = [*self._counts[-10:], model.frames]
        line = [ARMED if session.armed else LISTENING, *self._recorder.light()]
        for bus in model.top.traffic.buses(model.now_us):
            load = load_text(bus.load.latest.bits, model.top.view.bit_rate)
            line.append((f" {bus.channel} {load}", ""))
            if bus.errors.state is not None:
                state = bus.errors.state.name.lower().replace("_", "-")
                line.append((f" {state}", "" if state == "active" else ALARM))
            line += [(f" {bus.errors.frames} error frames", WARNING)] if bus.errors.frames else []
        line.append((f"  {model.frames} frames  {model.frames - self._counts[0]}/s", ""))
        line.append((f"  lost {model.lost}", ALARM if model.lost else ""))
        line += [(f"  passed over {model.unread}", ALARM)] if model.unread else []
        line += [(f"  sent {session.sent}", "")] if session.sent else []
        line += [(f"  {', '.join(model.away)} is gone", ALARM)] if model.away else []
        trouble = session.trouble or model.failed
        line += [(f"  {trouble}", ALARM)] if trouble else []
        line += [("  end of the log", "")] if model.ended and not trouble else []
        return tuple(line)

    def render_line(self, y: int) -> Strip:
        """Return the line for the screen."""
        strip = Strip([Segment(text, Style.parse(style)) for text, style in self.line])
        return strip.crop_extend(0, self.size.width, None).apply_style(self.rich_style)

    async def on_click(self, event: Click) -> None:
        """Arm or disarm."""
        if self.line and event.x < len(self.line[0][0]):
            await self.app.run_action("arm")
