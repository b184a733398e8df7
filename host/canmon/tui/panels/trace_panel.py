"""The tab of the trace: frames one below the other, or the latest of each identifier.

>>> from tickrig.host.canmon.model.frames import Record
>>> from tickrig.wire.can import CanFrame
>>> row = TraceRow(7, Record(1_250_000, "can0", CanFrame.parse("185#3702")), 50_000, 100_000, 0xFF)
>>> line = TraceLines(origin_us=1_000_000).line(row)
>>> line_text(line)
'     0.250000  100.000 185       [2] 37 02'
>>> [text.strip() for text, style in line if style == CHANGED]
['37']
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import Any, ClassVar, Final

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import Input, Static

from tickrig.host.canmon.model import frames
from tickrig.host.canmon.model.decode.filter import Filter, FilterError, parse_filter
from tickrig.host.canmon.model.frames import Stamp
from tickrig.host.canmon.model.logs.log_file import SUFFIXES
from tickrig.host.canmon.model.top_model import meaning_text
from tickrig.host.canmon.model.trace import DisplayFilter, Latest, Ring, TraceRow
from tickrig.host.canmon.output.recording import write_records
from tickrig.host.canmon.tui.panels.panel import Panel, PromptLine, read_help
from tickrig.host.canmon.tui.session import DecodedFrame, Model, Session, Task
from tickrig.host.canmon.workspace import SettingError, choice, text_of, truth
from tickrig.host.tui import Line, LineView, line_text
from tickrig.wire.can import CanFrame, ErrorFrame, Frames

# Rows of the trace as lines with styles.


__all__ = ["CHANGED", "TraceLines", "line_text"]

CHANGED: Final = "bold yellow"
_SENT: Final = "bold cyan"
_ERROR: Final = "bold red"
_DIM: Final = "dim"
_HEAD: Final = "bold"
_KIND_STYLES: Final = {
    "emcy": "red",
    "error": "red",
    "nmt": "magenta",
    "boot-up": "magenta",
    "sdo": "blue",
    "unmapped": "dim",
    "raw": "dim",
    "fd": "dim",
}
_BYTES_WIDTH: Final = len("[8] 00 11 22 33 44 55 66 77")
_BITS_WIDTH: Final = len("[8]") + 8 * len(" 00000000")
_STAMP_WIDTHS: Final = {frames.Stamp.ABSOLUTE: 17, frames.Stamp.DATE: 26}
_STAMP_WIDTH: Final = 13


@dataclass(frozen=True, slots=True)
class TraceLines:
    """How rows are written.

    Attributes:
        stamp: the time at the beginning of a line.
        origin_us: the time that is 0.
        bits: bits instead of bytes.
        meaning: what a frame means stands behind it.
        channel_width: characters of the bus; 0 for none.
        counts: how often an identifier came stands before it.
        gaps: the time since the frame before it with the same identifier.
    """

    stamp: frames.Stamp = frames.Stamp.ZERO
    origin_us: int = 0
    bits: bool = False
    meaning: bool = True
    channel_width: int = 0
    counts: bool = False
    gaps: bool = True

    def head(self) -> Line:
        """Return the titles of the columns."""
        parts = [f"{'time s':>{self._stamp_width}}"] + [f"{'gap ms':>8}"] * self.gaps
        parts += [f"{'frames':>8}"] * self.counts
        parts += [f"{'bus':<{self.channel_width}}"] * bool(self.channel_width)
        parts += [f"{'CAN-ID':<9}", f"{'data':<{self._data_width}}"]
        parts += ["meaning"] * self.meaning
        return ((" ".join(parts).rstrip(), _HEAD),)

    def line(self, row: TraceRow, count: int = 0) -> Line:
        """Return the line of a row."""
        record = row.record
        channel = f"{record.channel:<{self.channel_width}} " * bool(self.channel_width)
        counted = f"{count:>8} " * self.counts
        gap = f"{frames.ms_text(row.gap_us):>8} " * self.gaps
        begin = f"{self._stamp(row):>{self._stamp_width}} {gap}"
        pieces = [(begin, _DIM), (counted + channel, ""), _ident(row), *self._data(row)]
        if self.meaning and row.decoded is not None:
            missing = self._data_width - sum(len(text) for text, _ in pieces[3:])
            style = _KIND_STYLES.get(row.decoded.kind, "")
            pieces.append((" " * (max(0, missing) + 1) + meaning_text(row.decoded), style))
        return tuple(piece for piece in pieces if piece[0])

    @property
    def _stamp_width(self) -> int:
        return _STAMP_WIDTHS.get(self.stamp, _STAMP_WIDTH)

    @property
    def _data_width(self) -> int:
        return _BITS_WIDTH if self.bits else _BYTES_WIDTH

    def _stamp(self, row: TraceRow) -> str:
        at_us = row.record.at_us
        match self.stamp:
            case frames.Stamp.DELTA:
                return frames.seconds_text(row.since_us or 0, 1)
            case frames.Stamp.ABSOLUTE:
                return frames.seconds_text(at_us, 1)
            case frames.Stamp.DATE:
                return frames.date_text(at_us)
            case _:
                return frames.seconds_text(at_us - self.origin_us, 1)

    def _data(self, row: TraceRow) -> Iterator[tuple[str, str]]:
        record = row.record
        if not isinstance(record, frames.Record):
            yield frames.bytes_text(record.data), ""
            return
        frame = record.frame
        if isinstance(frame, CanFrame) and frame.remote:
            yield f"[{frame.dlc}] remote request", ""
            return
        yield f"[{len(frame.data)}]", ""
        cells = _cells(frame.data, row.changed, self.bits)
        for changed, run in groupby(cells, key=itemgetter(1)):  # few pieces are painted soon
            yield "".join(cell for cell, _ in run), CHANGED if changed else ""


def _cells(data: bytes, changed: int, bits: bool) -> Iterator[tuple[str, bool]]:
    for place, byte in enumerate(data):
        differs = changed >> 8 * place & 0xFF
        if not bits:
            yield f" {byte:02X}", bool(differs)
            continue
        for bit in reversed(range(8)):
            yield f"{' ' * (bit == 7)}{byte >> bit & 1}", bool(differs >> bit & 1)


def _ident(row: TraceRow) -> tuple[str, str]:
    record = row.record
    style = _SENT if record.sent else _HEAD
    if not isinstance(record, frames.Record):
        return f"{frames.ARROWS[record.sent]:<9} ", style
    frame = record.frame
    if isinstance(frame, ErrorFrame):
        return f"{'error':<9} ", _ERROR
    return f"{frames.ident_text(frames.any_ident(frame)):<9} ", style


_STAMPS: Final = (Stamp.ZERO, Stamp.DELTA, Stamp.ABSOLUTE, Stamp.DATE)
_CHANNEL_MAX: Final = 12
_GAPS_WIDTH: Final = 90
"""A narrower screen has room for what frames mean, or for the gaps between them."""


class TracePanel(Panel):
    """Frames as they come, filtered, decoded, with what changed in colour."""

    title = "trace"
    section = "trace"
    HELP = read_help(__file__)
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
