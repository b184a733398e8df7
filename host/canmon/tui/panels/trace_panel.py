"""The tab of the trace, with a list of all frames, or the latest frame of each identifier.

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

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import Any, ClassVar, Final

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.events import Click
from textual.widgets import Input, Static

from tickrig.host.canmon.model import frames
from tickrig.host.canmon.model.decode.filter import Filter, FilterError, parse_filter
from tickrig.host.canmon.model.frames import STAMPS, AnyRecord, Stamp
from tickrig.host.canmon.model.logs.log_file import SUFFIXES
from tickrig.host.canmon.model.top_model import meaning_text
from tickrig.host.canmon.model.trace import DisplayFilter, Latest, Ring, TraceRow
from tickrig.host.canmon.output.recording import write_records
from tickrig.host.canmon.tui.panels.panel import Panel, PromptLine, read_help
from tickrig.host.canmon.tui.session import DecodedFrame, Model, Session, Task
from tickrig.host.canmon.workspace import SettingError, choice, text_of, truth
from tickrig.host.tui import Line, LineView, line_text, plain
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
    """Settings of the trace tab that determine the text of a line.

    Attributes:
        stamp: format of the time at the beginning of a line.
        origin_us: time that is displayed as 0 in relative times.
        bits: whether to show the payload as bits instead of bytes.
        meaning: whether to show the decoded meaning after the frame.
        channel_width: width of the bus name in characters, or 0 to omit the name.
        counts: whether to show the number of earlier frames with the same CAN-ID.
        gaps: whether to show the time since the previous frame with the same CAN-ID.
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
        before_us = at_us - (row.since_us or 0)
        return frames.stamp_text(self.stamp, at_us, self.origin_us, before_us)

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


_CHANNEL_MAX: Final = 12
_BOOKMARK: Final = "black on yellow"
_BOOKMARKS: Final = 1_000
"""Number of bookmarks that a workspace can hold."""
_SILENT: Final = (
    "no frame comes: bit rate, cable, termination, power? F2 changes the settings.",
    "To ask all node-IDs: A, then f in the tab nodes; or in another terminal",
)


_GAPS_WIDTH: Final = 90
"""Width below which a screen shows either the meanings of frames, or the gaps between them."""


class TracePanel(Panel):
    """A list of arriving frames, filtered and decoded. Changed data are in colour."""

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
        Binding("f", "find", "find"),
        Binding("n", "again(1)", "next", key_display="n N"),
        Binding("N", "again(-1)", "previous", show=False),
        Binding("m", "bookmark", "bookmark"),
        Binding("right_square_bracket", "marked(1)", "next bookmark", show=False),
        Binding("left_square_bracket", "marked(-1)", "bookmarks", key_display="[ ]"),
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
        self._cursor: int | None = None  # the number of a row in the ring that is shown
        self._bookmarks: set[int] = set()  # times of frames
        self._wanted: tuple[str, Filter | None] = "", None
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
        """Process new rows of the trace."""
        self._display_filter.follow()

    def snapshot(self, model: Model) -> None:
        """Copy the visible rows."""
        view = self.query_one(LineView)
        passed, latest = self.paused or (self._display_filter.passed, self._display_filter.latest())
        self._fit(passed, latest)
        if self.overwrite:
            self._begin, self._total = 0, len(latest)
            self._lines = [self._layout.line(row, count) for row, count in latest]
            return
        self._total = passed.count - passed.first
        self._begin = max(0, self._total - view.rows) if self._follows(view) else view.top
        begin = passed.first + self._begin
        rows = passed.rows(begin, view.rows)
        self._lines = [self._marked_line(row, number) for number, row in enumerate(rows, begin)]
        if not self._total and self.session.silent:
            command = self.session.scan_command
            self._lines = [*map(plain, _SILENT), plain(f"    {command}", "bold")]
            self._total = len(self._lines)

    def _marked_line(self, row: TraceRow, number: int) -> Line:
        line = self._layout.line(row)
        if row.record.at_us in self._bookmarks:
            line = ((line[0][0], _BOOKMARK), *line[1:])
        if number == self._cursor:
            return tuple((text, f"{style} reverse".strip()) for text, style in line)
        return line

    def paint(self) -> None:
        """Show the rows. Follow the latest row if it was in view."""
        view = self.query_one(LineView)
        follows = self._follows(view)
        if self._head != (head := self._title()):
            self._head = head
            self.query_one("#head", Static).update(head)
        view.show(self._lines, self._begin, self._total)
        if follows and not self.overwrite:
            view.show_end()

    def load(self, settings: Mapping[str, Any]) -> None:
        """Load mode, time stamp, filter and displayed items."""
        self.overwrite = truth(settings, "overwrite", self.overwrite)
        stamp = choice(settings, "time", self.session.stamp, [str(one) for one in STAMPS])
        self.session.stamp = Stamp(stamp)
        self._bookmarks = _times(settings, "bookmarks")
        self._layout = replace(
            self._layout,
            bits=truth(settings, "bits", self._layout.bits),
            meaning=truth(settings, "decode", self._layout.meaning),
        )
        text = text_of(settings, "filter", self.filter_text)
        try:
            self.apply_filter(text)
        except FilterError as error:
            raise SettingError(("filter",), str(error)) from None

    def save(self) -> dict[str, Any]:
        """Return mode, time stamp, filter and displayed items."""
        return {
            "overwrite": self.overwrite,
            "time": str(self.session.stamp),
            "bookmarks": sorted(self._bookmarks)[:_BOOKMARKS] or None,
            "bits": self._layout.bits,
            "decode": self._layout.meaning,
            "filter": self.filter_text,
        }

    def apply_filter(self, text: str) -> None:
        """Show only the frames that pass a filter.

        Raises:
            FilterError: the text is not a filter.
        """
        wanted: Filter | None = parse_filter(text) if text else None
        with self.session.lock:
            self._display_filter = DisplayFilter(self.session.model.trace, wanted)
        self.filter_text, self.paused, self._cursor = text, None, None

    def on_line_view_moved(self) -> None:
        """Show the lines that came into view."""
        self.refresh_view()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Apply the filter, or show its error."""
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
        """Edit the filter."""
        field = self.query_one("#wanted", Input)
        field.display = True
        field.focus()

    def action_leave(self) -> None:
        """Return to the lines."""
        field = self.query_one("#wanted", Input)
        field.value, field.display = self.filter_text, bool(self.filter_text)
        self.query_one("#wrong").display = False
        self.query_one(LineView).focus()
        self.refresh_view()

    def action_pause(self) -> None:
        """Pause or continue the display. Frames are recorded in both cases."""
        self.paused, self._cursor = None if self.paused else self._held(), None
        self.refresh_view()

    def action_overwrite(self) -> None:
        """Show the latest frame of each identifier, or all frames."""
        self.overwrite = not self.overwrite
        self.refresh_view()

    def action_meaning(self) -> None:
        """Show or hide the meanings of frames."""
        self._layout = replace(self._layout, meaning=not self._layout.meaning)
        self.refresh_view()

    def action_bits(self) -> None:
        """Show bits or bytes."""
        self._layout = replace(self._layout, bits=not self._layout.bits)
        self.refresh_view()

    def action_stamp(self) -> None:
        """Switch to the next format of times, such as the time since the previous frame."""
        self.session.next_stamp()
        self.refresh_view()

    def show_frame(self, at_us: int, record: AnyRecord | None = None) -> None:
        """Pause the trace at a frame, or at the latest frame until a time."""
        if record is not None and self.filter_text and self._place(at_us, record) is None:
            self.apply_filter("")
            self.query_one("#wanted").display = False
            self.notify("the filter hid this frame: it is off now")
        place = self._place(at_us, record)
        if place is None:
            self.notify("the trace does not have this frame any more")
            return
        self._go(place)

    def _place(self, at_us: int, record: AnyRecord | None) -> int | None:
        """Return the number of a row in the displayed ring, or None if it is not in the ring."""
        passed, place = self._passed(), None
        for number, row in enumerate(passed.rows(passed.first, passed.count), passed.first):
            if record is not None and (row.record is record or row.record == record):
                return number
            if record is None and row.record.at_us <= at_us:
                place = number
        return place

    def _passed(self) -> Ring:
        return (self.paused or self._held())[0]

    def _held(self) -> tuple[Ring, list[Latest]]:
        """Return copies of the rows that pass the filter, and the latest of each identifier."""
        with self.session.lock:
            return self._display_filter.passed.copy(), self._display_filter.latest()

    def _go(self, number: int) -> None:
        """Pause the display with a row in its middle."""
        self.paused = self.paused or self._held()
        self.overwrite, self._cursor = False, number
        view = self.query_one(LineView)
        self.refresh_view()  # as many lines as there are have to be known before it is scrolled
        top = number - self.paused[0].first - view.rows // 2
        view.scroll_to(y=max(0, top), animate=False, immediate=True, force=True)
        self.refresh_view()

    def action_find(self) -> None:
        """Ask for a filter, and go to the next frame that passes the filter."""
        self.query_one(PromptLine).prompt(
            "find, as 'node=3 and emcy' or 'sdo[6040h]'; then n next, N previous",
            self._wanted[0],
            self._find,
        )

    def _find(self, text: str) -> None:
        self._wanted = text, parse_filter(text)
        self.action_again(1)

    def action_again(self, step: int) -> None:
        """Go to the next or the previous frame that passes the searched filter."""
        text, wanted = self._wanted
        if wanted is not None:
            self._search(step, f"further {text}", lambda row: _passes(row, wanted))
        else:
            self.action_find()

    def action_bookmark(self) -> None:
        """Set a bookmark at the frame under the cursor, or remove its bookmark.

        Without a cursor, the command applies to the first visible frame.
        """
        passed, view = self._passed(), self.query_one(LineView)
        number = passed.first + view.top if self._cursor is None else self._cursor
        for row in passed.rows(number, 1):
            self._bookmarks ^= {row.record.at_us}
        self.refresh_view()

    def action_marked(self, step: int) -> None:
        """Go to the next or the previous bookmark."""
        self._search(step, "further bookmark", lambda row: row.record.at_us in self._bookmarks)

    def _search(self, step: int, what: str, fits: Callable[[TraceRow], bool]) -> None:
        """Go to the next or previous row that fits. After the last row, continue with the first."""
        passed, begin = self._passed(), self._cursor
        if begin is None:
            begin = passed.first + self.query_one(LineView).top - (step > 0)
        rows = list(enumerate(passed.rows(passed.first, passed.count), passed.first))
        place = begin - passed.first
        above, below = rows[: max(0, place)], rows[max(0, place + 1) :]
        order = [*below, *above] if step > 0 else [*above[::-1], *below[::-1]]
        found = next((number for number, row in order if fits(row)), None)
        if found is None:
            self.notify(f"no {what}")
            return
        if (found - begin) * step < 0:
            self.notify(f"from the {'first' if step > 0 else 'last'} frame again")
        self._go(found)

    def on_click(self, event: Click) -> None:
        """Put the cursor on a line."""
        view = self.query_one(LineView)
        row = event.screen_y - view.region.y
        if not self.overwrite and 0 <= row < min(view.rows, self._total - view.top):
            self._go(self._passed().first + view.top + row)

    def action_clear(self) -> None:
        """Delete all rows."""
        with self.session.lock:
            self._display_filter.clear()
        self.paused = self._cursor = None
        self._bookmarks.clear()
        self.refresh_view()

    def action_write(self) -> None:
        """Ask for a file, and write the frames that pass the filter into it."""
        self.query_one(PromptLine).prompt(f"a log: {' '.join(SUFFIXES)}", "trace.log", self._write)

    def _write(self, text: str) -> None:
        passed = self._passed()
        rows = passed.rows(passed.first, passed.count)
        for said in write_records(Path(text), [row.record for row in rows]):
            self.notify(said, markup=False)

    def _follows(self, view: LineView) -> bool:
        return view.follows and self.paused is None

    def _fit(self, passed: Ring, latest: Sequence[Latest]) -> None:
        """Adapt the columns to the names of buses and to the first time."""
        buses = {one.row.record.channel for one in latest}
        width = min(_CHANNEL_MAX, max(map(len, buses))) if len(buses) > 1 else 0
        self._layout = replace(
            self._layout,
            stamp=self.session.stamp,
            channel_width=width,
            counts=self.overwrite,
            origin_us=self.session.origin_us,
            gaps=not self._layout.meaning or self.size.width >= _GAPS_WIDTH,
        )

    def _title(self) -> str:
        words = ["paused"] * (self.paused is not None)
        words += [f"filter {self.filter_text}"] * bool(self.filter_text)
        note = f"   [{', '.join(words)}]" if words else ""
        return line_text(self._layout.head()) + note


def _passes(row: TraceRow, wanted: Filter) -> bool:
    """Return whether a frame passes a filter. An undecoded line of a serial port does not pass."""
    return row.decoded is not None and wanted.matches(row.record, row.decoded)


def _times(settings: Mapping[str, Any], name: str) -> set[int]:
    """Return times in microseconds. Raise SettingError if they are invalid."""
    value = settings.get(name, [])
    if not isinstance(value, list) or not all(type(item) is int for item in value):
        raise SettingError((name,), "is no array of times in microseconds")
    return set(value)


class _Follower(Task):
    """Task that keeps the rows of a panel up to date, whichever tab is shown."""

    def __init__(self, panel: TracePanel) -> None:
        self._panel = panel

    def tick(self, now_us: int, records: Sequence[DecodedFrame], /) -> Frames:
        """Process new rows. Nothing is sent."""
        self._panel.follow()
        return ()
