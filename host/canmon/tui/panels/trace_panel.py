"""The tab of the trace: frames one below the other, or the latest of each identifier."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar, Final

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import Input, Static

from tickrig.host.canmon.model.decode.filter import Filter, FilterError, parse_filter
from tickrig.host.canmon.model.frames import Stamp
from tickrig.host.canmon.model.logs.log_file import SUFFIXES
from tickrig.host.canmon.model.trace import DisplayFilter, Latest, Ring
from tickrig.host.canmon.output.recording import write_records
from tickrig.host.canmon.tui.controls import PromptLine
from tickrig.host.canmon.tui.panels.panel import Panel
from tickrig.host.canmon.tui.session import DecodedFrame, Model, Session, Task
from tickrig.host.canmon.tui.trace_line import TraceLines
from tickrig.host.canmon.workspace import SettingError, choice, text_of, truth
from tickrig.host.tui import Line, LineView, line_text
from tickrig.wire.can import Frames

_STAMPS: Final = (Stamp.ZERO, Stamp.DELTA, Stamp.ABSOLUTE, Stamp.DATE)
_CHANNEL_MAX: Final = 12
_GAPS_WIDTH: Final = 90
"""A narrower screen has room for what frames mean, or for the gaps between them."""


class TracePanel(Panel):
    """Frames as they come, filtered, decoded, with what changed in colour."""

    title = "trace"
    section = "trace"
    HELP = """
    # Trace

    Each frame with its time, the time since the one before it with the same CAN-ID, its bytes and
    what it means. Bytes that differ from those before are coloured. Frames that this program sent
    have a coloured CAN-ID. It follows the latest frame while that is in view. A window of less than
    90 columns leaves out the gaps while it shows meanings.

    `s` saves the frames that pass the filter, the latest 100,000 at the most, as a log.

    A filter: `node=3 and (pdo or emcy)`, `181-18F`, `sdo[6040h]`, `statusword.fault`,
    `123:7FF,#FF`.
    """
    DEFAULT_CSS = """
    TracePanel #wanted { display: none; height: 1; border: none; }
    TracePanel #head { height: 1; }
    TracePanel #wrong { display: none; height: auto; color: $error; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("space", "pause", "pause"),
        Binding("o", "overwrite", "overwrite"),
        Binding("slash", "filter", "filter", key_display="/"),
        Binding("d", "meaning", "decode"),
        Binding("b", "bits", "bits"),
        Binding("t", "stamp", "time"),
        Binding("c", "clear", "clear"),
        Binding("s", "write", "save"),
        Binding("escape", "leave", "leave the filter", show=False),
    ]

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.overwrite, self.filter_text = False, ""
        self.paused: tuple[Ring, list[Latest]] | None = None
        self._layout = TraceLines()
        self._display_filter = DisplayFilter(session.model.trace)
        self._follower = _Follower(self)
        session.tasks.append(self._follower)
        self._begin = self._total = 0
        self._head = ""
        self._lines: list[Line] = []

    def compose(self) -> ComposeResult:
        """Lay out filter, titles and lines."""
        yield Input(self.filter_text, placeholder="filter", id="wanted", compact=True)
        yield Static(id="wrong", markup=False)
        yield Static(id="head", markup=False)
        yield LineView()
        yield PromptLine()

    def on_mount(self) -> None:
        """Show the filter if there is one."""
        self.query_one("#wanted").display = bool(self.filter_text)

    def follow(self) -> None:
        """Take new rows of the trace."""
        self._display_filter.follow()

    def snapshot(self, model: Model) -> None:
        """Keep the rows that are in view."""
        view = self.query_one(LineView)
        passed, latest = self.paused or (self._display_filter.passed, self._display_filter.latest())
        self._fit(passed, latest)
        if self.overwrite:
            self._begin, self._total = 0, len(latest)
            self._lines = [self._layout.line(row, count) for row, count in latest]
            return
        self._total = passed.count - passed.first
        self._begin = max(0, self._total - view.rows) if self._follows(view) else view.top
        rows = passed.rows(passed.first + self._begin, view.rows)
        self._lines = [self._layout.line(row) for row in rows]

    def paint(self) -> None:
        """Show them; the latest one if it was in view."""
        view = self.query_one(LineView)
        follows = self._follows(view)
        if self._head != (head := self._title()):
            self._head = head
            self.query_one("#head", Static).update(head)
        view.show(self._lines, self._begin, self._total)
        if follows and not self.overwrite:
            view.show_end()

    def load(self, settings: Mapping[str, Any]) -> None:
        """Take mode, time stamp, filter and what is shown."""
        self.overwrite = truth(settings, "overwrite", self.overwrite)
        stamp = choice(settings, "time", self._layout.stamp, [str(one) for one in _STAMPS])
        self._layout = replace(
            self._layout,
            stamp=Stamp(stamp),
            bits=truth(settings, "bits", self._layout.bits),
            meaning=truth(settings, "decode", self._layout.meaning),
        )
        text = text_of(settings, "filter", self.filter_text)
        try:
            self.apply_filter(text)
        except FilterError as error:
            raise SettingError(("filter",), str(error)) from None

    def save(self) -> dict[str, Any]:
        """Return them."""
        return {
            "overwrite": self.overwrite,
            "time": str(self._layout.stamp),
            "bits": self._layout.bits,
            "decode": self._layout.meaning,
            "filter": self.filter_text,
        }

    def apply_filter(self, text: str) -> None:
        """Show only what a filter passes; FilterError if it is none."""
        wanted: Filter | None = parse_filter(text) if text else None
        with self.session.lock:
            self._display_filter = DisplayFilter(self.session.model.trace, wanted)
        self.filter_text, self.paused = text, None

    def on_line_view_moved(self) -> None:
        """Bring the lines that came into view."""
        self.refresh_view()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Apply the filter, or say what is wrong with it."""
        wrong = self.query_one("#wrong", Static)
        try:
            self.apply_filter(event.value.strip())
        except FilterError as error:
            wrong.update(str(error))
            wrong.display = True
            return
        wrong.display = False
        self.action_leave()

    def action_filter(self) -> None:
        """Write a filter."""
        field = self.query_one("#wanted", Input)
        field.display = True
        field.focus()

    def action_leave(self) -> None:
        """Go back to the lines."""
        field = self.query_one("#wanted", Input)
        field.value, field.display = self.filter_text, bool(self.filter_text)
        self.query_one("#wrong").display = False
        self.query_one(LineView).focus()
        self.refresh_view()

    def action_pause(self) -> None:
        """Hold the picture, or go on; frames are taken meanwhile."""
        with self.session.lock:
            held = self._display_filter.passed.copy(), self._display_filter.latest()
        self.paused = None if self.paused else held
        self.refresh_view()

    def action_overwrite(self) -> None:
        """Show the latest frame of each identifier, or all."""
        self.overwrite = not self.overwrite
        self.refresh_view()

    def action_meaning(self) -> None:
        """Show or hide what frames mean."""
        self._layout = replace(self._layout, meaning=not self._layout.meaning)
        self.refresh_view()

    def action_bits(self) -> None:
        """Show bits or bytes."""
        self._layout = replace(self._layout, bits=not self._layout.bits)
        self.refresh_view()

    def action_stamp(self) -> None:
        """Show another time: since the first frame, since the one before, absolute, date."""
        place = (_STAMPS.index(self._layout.stamp) + 1) % len(_STAMPS)
        self._layout = replace(self._layout, stamp=_STAMPS[place])
        self.refresh_view()

    def action_clear(self) -> None:
        """Begin anew."""
        with self.session.lock:
            self._display_filter.clear()
        self.paused = None
        self.refresh_view()

    def action_write(self) -> None:
        """Ask for a file, and write the frames that pass the filter into it."""
        self.query_one(PromptLine).prompt(f"a log: {' '.join(SUFFIXES)}", "trace.log", self._write)

    def _write(self, text: str) -> None:
        with self.session.lock:
            passed = (self.paused[0] if self.paused else self._display_filter.passed).copy()
        rows = passed.rows(passed.first, passed.count)
        for said in write_records(Path(text), [row.record for row in rows]):
            self.notify(said, markup=False)

    def _follows(self, view: LineView) -> bool:
        return view.follows and self.paused is None

    def _fit(self, passed: Ring, latest: Sequence[Latest]) -> None:
        """Make room for what is there: buses, and the first time."""
        buses = {one.row.record.channel for one in latest}
        width = min(_CHANNEL_MAX, max(map(len, buses))) if len(buses) > 1 else 0
        first = passed.rows(0, 1) if passed.first == 0 else []
        origin_us = first[0].record.at_us if first else self._layout.origin_us
        self._layout = replace(
            self._layout,
            channel_width=width,
            counts=self.overwrite,
            origin_us=origin_us,
            gaps=not self._layout.meaning or self.size.width >= _GAPS_WIDTH,
        )

    def _title(self) -> str:
        words = ["paused"] * (self.paused is not None)
        words += [f"filter {self.filter_text}"] * bool(self.filter_text)
        note = f"   [{', '.join(words)}]" if words else ""
        return line_text(self._layout.head()) + note


class _Follower(Task):
    """The task that keeps a panel's rows up to date, whichever tab is shown."""

    def __init__(self, panel: TracePanel) -> None:
        self._panel = panel

    def tick(self, now_us: int, records: Sequence[DecodedFrame], /) -> Frames:
        """Follow; it sends nothing."""
        self._panel.follow()
        return ()
