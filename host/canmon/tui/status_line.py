"""The line at the bottom: how the bus is, what got lost, and whether frames may be sent."""

from __future__ import annotations

from typing import Final, NamedTuple

from rich.segment import Segment
from rich.style import Style
from textual.events import Click
from textual.strip import Strip
from textual.widget import Widget

from tickrig.host.canmon.tui.tasks.session import Session
from tickrig.host.monitor.frames.quantity import load_text
from tickrig.host.monitor.traffic.traffic import BusRow
from tickrig.host.tui.line_view import Line

ARMED: Final = (" ARMED ", "bold white on red")
LISTENING: Final = (" LISTEN-ONLY ", "bold black on green")
WARNING: Final = "bold yellow"
ALARM: Final = "bold red"


class Status(NamedTuple):
    """What the line tells.

    Attributes:
        armed: frames are sent.
        buses: what each bus did.
        bit_rate: of the buses, None if it is not known.
        frames: taken in all.
        rate: frames in the latest second.
        lost: frames that did not get here.
        unread: what came and is no frame of classic CAN.
        sent: frames that this program sent.
        trouble: what is wrong; empty if nothing.
        ended: no more will come.
    """

    armed: bool = False
    buses: tuple[BusRow, ...] = ()
    bit_rate: int | None = None
    frames: int = 0
    rate: int = 0
    lost: int = 0
    unread: int = 0
    sent: int = 0
    trouble: str = ""
    ended: bool = False


def status_line(status: Status) -> Line:
    """Return the line."""
    line = [ARMED if status.armed else LISTENING]
    for bus in status.buses:
        line.append((f" {bus.channel} {load_text(bus.load.latest.bits, status.bit_rate)}", ""))
        if bus.errors.state is not None:
            state = bus.errors.state.name.lower().replace("_", "-")
            line.append((f" {state}", "" if state == "active" else ALARM))
        line += [(f" {bus.errors.frames} error frames", WARNING)] if bus.errors.frames else []
    line.append((f"  {status.frames} frames  {status.rate}/s", ""))
    line.append((f"  lost {status.lost}", ALARM if status.lost else ""))
    line += [(f"  passed over {status.unread}", ALARM)] if status.unread else []
    line += [(f"  sent {status.sent}", "")] if status.sent else []
    line += [(f"  {status.trouble}", ALARM)] if status.trouble else []
    line += [("  end of the log", "")] if status.ended and not status.trouble else []
    return tuple(line)


class StatusLine(Widget):
    """Shows a status; a click on its first word arms or disarms.

    Args:
        session: what it is about.
    """

    DEFAULT_CSS = "StatusLine { height: 1; background: $boost; }"

    def __init__(self, session: Session) -> None:
        super().__init__(id="status")
        self._session = session
        self._counts = [0]
        self.line: Line = ()

    def refresh_view(self) -> None:
        """Show how things are now; called ten times a second."""
        with self._session.lock:
            line = status_line(self._status())
        if line != self.line:
            self.line = line
            self.refresh()

    def _status(self) -> Status:
        session, model = self._session, self._session.model
        self._counts = [*self._counts[-10:], model.frames]
        return Status(
            session.armed,
            model.top.traffic.buses(model.now_us),
            model.top.view.bit_rate,
            model.frames,
            model.frames - self._counts[0],
            model.lost,
            model.unread,
            session.sent,
            session.trouble or model.failed,
            model.ended,
        )

    def render_line(self, y: int) -> Strip:
        """Return the line for the screen."""
        strip = Strip([Segment(text, Style.parse(style)) for text, style in self.line])
        return strip.crop_extend(0, self.size.width, None).apply_style(self.rich_style)

    async def on_click(self, event: Click) -> None:
        """Arm or disarm."""
        if self.line and event.x < len(self.line[0][0]):
            await self.app.run_action("arm")
