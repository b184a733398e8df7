"""The table of all identifiers that `canmon top` shows. Frames, keys and the time drive it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Final, NamedTuple

from tickrig.host.canmon.model import traffic
from tickrig.host.canmon.model.frames import (
    ARROWS,
    Record,
    any_ident,
    count_text,
    ident_text,
    load_text,
    ms_text,
    rate_text,
    s_text,
)
from tickrig.host.text.page_text import in_cells
from tickrig.wire.can import ErrorFrame

if TYPE_CHECKING:
    from tickrig.host.canmon.model.decode.decoded import Decoded
    from tickrig.host.canmon.model.frames import AnyRecord, LineRecord


# The columns of the table of identifiers, and which of them a narrow screen leaves out.

REVERSE: Final = "\x1b[7m"
PLAIN: Final = "\x1b[0m"

_UNCHANGED: Final = "·"
_NOTCHED: Final = " "
_HEAT: Final = "▁▂▃▄▅▆▇█"
"""Characters for bits, from one that changes seldom to one that changes with each frame."""


def _data_text(row: traffic.IdRow, styled: bool) -> str:
    """Return the bytes of the latest frame as text. Changed bytes are shown in reverse."""
    if row.frame.remote:
        return f"remote request for {row.frame.dlc}"
    latest = row.changed.latest & ~row.changed.notched
    cells = [
        _marked(f"{byte:02X}", styled and bool(latest >> 8 * place & 0xFF))
        for place, byte in enumerate(row.frame.data)
    ]
    return " ".join(cells)


def _heat_text(row: traffic.IdRow, styled: bool) -> str:
    """Return a character for each bit. Bit 7 of a byte is first."""
    heats = _heats(row.changed, row.frames)
    latest = row.changed.latest & ~row.changed.notched
    cells = []
    for place in range(len(row.frame.data)):
        bits = [
            _marked(
                heats[bit] if bit < len(heats) else _UNCHANGED, styled and bool(latest >> bit & 1)
            )
            for bit in reversed(range(8 * place, 8 * place + 8))
        ]
        cells.append("".join(bits))
    return " ".join(cells)


def _heats(changed: traffic.BitRow, frames: int) -> list[str]:
    shown = changed.changed
    return [
        _NOTCHED
        if changed.notched >> bit & 1
        else _heat(count, frames)
        if shown >> bit & 1
        else _UNCHANGED
        for bit, count in enumerate(changed.counts())
    ]


def _heat(count: int, frames: int) -> str:
    """Return the character for the number of changes of a bit in a number of frames, 2 or more."""
    return _HEAT[-(-count * len(_HEAT) // (frames - 1)) - 1]


def _marked(text: str, marked: bool) -> str:
    return f"{REVERSE}{text}{PLAIN}" if marked else text


class _TopColumn(NamedTuple):
    """A column of numbers.

    Attributes:
        title: title of the column.
        width: width in characters.
        rank: rank of the column. Without room for all columns, the column with the highest rank is
            left out first.
        text: function that returns the text of a row at a time.
    """

    title: str
    width: int
    rank: int
    text: Callable[[traffic.IdRow, int], str]


def _gap(name: str) -> Callable[[traffic.IdRow, int], str]:
    return lambda row, now_us: ms_text(getattr(row.gaps, name, None))


_COLUMNS: Final = (
    _TopColumn("frames", 8, 1, lambda row, now_us: str(row.frames)),
    _TopColumn("1/s", 7, 0, lambda row, now_us: rate_text(row.rate_hz)),
    _TopColumn("gap ms", 8, 3, lambda row, now_us: ms_text(row.gap_us)),
    _TopColumn("min", 8, 6, _gap("min_us")),
    _TopColumn("avg", 8, 2, _gap("mean_us")),
    _TopColumn("p99", 8, 7, _gap("p99_us")),
    _TopColumn("max", 8, 4, _gap("max_us")),
    _TopColumn("jitter", 8, 8, _gap("jitter_us")),
    _TopColumn("missed", 6, 5, lambda row, now_us: count_text(getattr(row.gaps, "missed", None))),
    _TopColumn("age s", 7, 9, lambda row, now_us: s_text(now_us - row.last_us)),
)


def _ids(channel: str, ident: str, width: int) -> str:
    """Return the first cells of a line. Without a width, the bus is left out."""
    bus = f"{in_cells(channel):<{width}.{width}} " if width else ""
    return f"{bus}{ident:<{_ID_WIDTH}}"


def _fitting(width: int) -> tuple[_TopColumn, ...]:
    """Return the columns that fit side by side into a width in characters."""
    kept = list(_COLUMNS)
    while len(kept) > 1 and sum(column.width + 1 for column in kept) > width:
        kept.remove(max(kept, key=lambda column: column.rank))
    return tuple(kept)


# The traffic of serial lines: one row for each kind of message, and its table for `canmon top`.

_ANSWERS: Final = ("ok", "refused", "event")
"""Signals whose name is a kind of answer."""

_COMMAND: Final = "command"
_STATUS: Final = "status"
_OTHER: Final = "other"


class _LineRow(NamedTuple):
    """One kind of message on one line, in one direction.

    Attributes:
        channel: name of the line.
        sent: whether the messages go to the device.
        word: kind of the message.
        messages: number of messages.
        first_us: time of the first message.
        last_us: time of the latest message.
        gap_us: time between the previous and the latest message, or None for the first message.
        text: content of the latest message.
    """

    channel: str
    sent: bool
    word: str
    messages: int
    first_us: int
    last_us: int
    gap_us: int | None
    text: str

    @property
    def rate_hz(self) -> float:
        """Average number of messages per second, or 0 for a single message."""
        span_us = self.last_us - self.first_us
        return (self.messages - 1) * 1e6 / span_us if span_us > 0 else 0.0


class LineTraffic:
    """Counter of the messages on serial lines, for the table of `canmon top`.

    The counter has a row for each kind of message, so its memory does not grow with the number of
    messages.
    """

    def __init__(self) -> None:
        self._rows: dict[tuple[str, bool, str], _LineRow] = {}

    def take(self, line: LineRecord) -> None:
        """Count a message."""
        at_us, decoded = line.at_us, line.decoded
        key = line.channel, line.sent, _word_of(decoded)
        row = self._rows.get(key)
        if row is None:
            self._rows[key] = _LineRow(*key, 1, at_us, at_us, None, decoded.text)
            return
        times = row.first_us, at_us, at_us - row.last_us
        self._rows[key] = _LineRow(*key, row.messages + 1, *times, decoded.text)

    def clear(self) -> None:
        """Delete all counts."""
        self._rows.clear()

    def rows(self) -> tuple[_LineRow, ...]:
        """Return the rows by line, direction and kind."""
        return tuple(self._rows[key] for key in sorted(self._rows))


def _word_of(decoded: Decoded) -> str:
    """Return the kind of a message, which is its command or the kind of answer."""
    if not decoded.signals:
        return _OTHER
    first = decoded.signals[0]
    if first.name == _COMMAND:
        return str(first.value)
    return first.name if first.name in _ANSWERS else _STATUS


def line_table(rows: tuple[_LineRow, ...], now_us: int, width: int) -> list[str]:
    """Return the table of serial traffic in `canmon top` as lines of text.

    If there are no rows, the result is an empty list.
    """
    if not rows:
        return []
    names = [f"{row.channel} {ARROWS[row.sent]} {row.word}" for row in rows]
    first = max(map(len, (*names, "line")))
    head = f"{'line':<{first}} {'count':>8} {'1/s':>7} {'gap ms':>8} {'age s':>7} meaning"
    lines = [
        f"{name:<{first}} {row.messages:>8} {rate_text(row.rate_hz):>7} {ms_text(row.gap_us):>8}"
        f" {s_text(now_us - row.last_us):>7} {row.text}"
        for name, row in zip(names, rows, strict=True)
    ]
    return [in_cells(line)[:width] for line in ("", head, *lines)]


# The table of all identifiers that `canmon top` paints, driven by frames, keys and the time.

_ID_WIDTH: Final = 9
_DATA_WIDTH: Final = 23
_HEAT_WIDTH: Final = 71
_MEANING_WIDTH: Final = 50
_CHANNEL_MAX: Final = 12
_KEY_LINE: Final = "  q quit, space hold, b bits, d decode, n notch, s sort, c clear"
_UNRATED: Final = "load at most (no --data-bitrate)"
UNBOUNDED: Final = 1 << 16
"""Width or height without a limit."""


class RowOrder(StrEnum):
    """Order by which the rows are sorted."""

    ID = "id"
    RATE = "rate"
    JITTER = "jitter"
    GAP = "gap"
    AGE = "age"


_ORDER_KEYS: Final[dict[RowOrder, Callable[[traffic.IdRow], float]]] = {
    RowOrder.ID: lambda row: 0,
    RowOrder.RATE: lambda row: -row.rate_hz,
    RowOrder.JITTER: lambda row: -row.gaps.jitter_us if row.gaps else 1,
    RowOrder.GAP: lambda row: -row.gaps.max_us if row.gaps else 1,
    RowOrder.AGE: lambda row: row.last_us,
}


@dataclass(frozen=True, slots=True)
class TableView:
    """Settings that determine how the table of `canmon top` is displayed.

    Attributes:
        order: order of the rows.
        bits: whether to show the payload as bits instead of bytes.
        held: whether the display is paused.
        top: number of rows that are scrolled past at the top.
        styled: whether to mark changes. Text for a file has no marks.
        bit_rate: bit rate of the buses in bit/s, or None if unknown.
        keys: whether to show a line with the available keys.
        meaning: function that returns the decoded meaning of the latest frame of a row, which is
            shown instead of the bytes, or None to show the bytes.
        unread: number of received items that are not CAN or CAN FD frames.
    """

    order: RowOrder = RowOrder.ID
    bits: bool = False
    held: bool = False
    top: int = 0
    styled: bool = False
    bit_rate: int | None = None
    keys: bool = False
    meaning: Callable[[traffic.IdRow], str] | None = None
    unread: int = 0


def render(
    snapshot: traffic.TrafficSnapshot,
    view: TableView,
    lost: int = 0,
    width: int = UNBOUNDED,
    height: int = UNBOUNDED,
) -> list[str]:
    """Return the table of `canmon top` as lines of text.

    There are at most `height` lines, and a line has at most `width` characters.

    Args:
        snapshot: statistics of the traffic to show.
        view: settings of the display.
        lost: number of lost frames.
        width: width of the screen in characters.
        height: height of the screen in lines.
    """
    head = [_bus_line(bus, view.bit_rate)[:width] for bus in snapshot.buses]
    head.append(_state_line(snapshot, view, lost)[:width])
    table = _Table.of(snapshot, view, width)
    head.append(table.titles())
    room = max(0, height - len(head))
    rows = sorted(snapshot.rows, key=_ORDER_KEYS[view.order])[view.top : view.top + room]
    return (head + [table.line(row, snapshot.at_us) for row in rows])[:height]


def _bus_line(bus: traffic.BusRow, bit_rate: int | None) -> str:
    """Return the state of a bus as one line."""
    load, errors = bus.load, bus.errors
    words = [
        f"{in_cells(bus.channel)}: {bus.frames} frames",
        f"load {load_text(load.latest.bit_s, bit_rate)}",
        f"error frames {errors.frames}",
    ]
    if errors.state is not None:
        words.append(f"controller {errors.state.name.lower().replace('_', '-')}")
    if errors.tec is not None:
        words.append(f"TEC {errors.tec} REC {errors.rec}")
    words += [f"overflows {errors.overflows}"] * bool(errors.overflows)
    words += [f"back in time {bus.went_back}"] * bool(bus.went_back)
    words += [f"CAN FD {bus.fd}"] * bool(bus.fd)
    words += [_UNRATED] * bool(bus.unrated)
    words.append(f"mean {load_text(load.mean_bit_s, bit_rate)}")
    words.append(f"peak {load_text(load.peak.bit_s, bit_rate)}")
    return ", ".join(words)


def _state_line(snapshot: traffic.TrafficSnapshot, view: TableView, lost: int) -> str:
    words = [f"lost {lost}", *[f"passed over {view.unread}"] * bool(view.unread)]
    words += [f"{len(snapshot.rows)} identifiers by {view.order}"]
    words += ["held"] * view.held
    keys = _KEY_LINE if view.keys else ""
    return ", ".join(words) + keys


class _Table(NamedTuple):
    """The parts of the rows that fit the screen.

    Attributes:
        bus_width: width of the names of buses in characters, or 0 to leave them out.
        columns: columns of numbers.
        text: function that writes the last cell of a row.
        title: title of this cell.
        styled: whether to mark changes. The lines are then not cut, because a style must not be
            cut.
        width: width of the screen in characters.
    """

    bus_width: int
    columns: tuple[_TopColumn, ...]
    text: Callable[[traffic.IdRow, bool], str]
    title: str
    styled: bool
    width: int

    @classmethod
    def of(cls, snapshot: traffic.TrafficSnapshot, view: TableView, width: int) -> _Table:
        """Choose the columns that fit."""
        longest = max((len(bus.channel) for bus in snapshot.buses), default=0)
        bus_width = min(_CHANNEL_MAX, longest) if len(snapshot.buses) > 1 else 0
        text, title, payload_width = _payload(view)
        room = width - len(_ids("", "", bus_width)) - payload_width - 1
        columns = _fitting(room)
        fits = room >= sum(column.width + 1 for column in columns)
        styled = view.styled and fits and (view.bits or view.meaning is None)
        return cls(bus_width, columns, text, title, styled, width)

    def titles(self) -> str:
        """Return the line with the titles."""
        cells = [f"{column.title:>{column.width}}" for column in self.columns]
        return " ".join([_ids("bus", "CAN-ID", self.bus_width), *cells, self.title])[: self.width]

    def line(self, row: traffic.IdRow, now_us: int) -> str:
        """Return the line of a row."""
        cells = [f"{column.text(row, now_us):>{column.width}}" for column in self.columns]
        ids = _ids(row.channel, ident_text(row.ident), self.bus_width)
        line = " ".join([ids, *cells, self.text(row, self.styled)])
        return (line if self.styled else line[: self.width]).rstrip()


def _payload(view: TableView) -> tuple[Callable[[traffic.IdRow, bool], str], str, int]:
    """Return the text, the title and the width of the last cell."""
    meaning = view.meaning
    if view.bits:
        return _heat_text, "bits that change", _HEAT_WIDTH
    if meaning is None:
        return _data_text, "data", _DATA_WIDTH
    return lambda row, styled: meaning(row), "meaning", _MEANING_WIDTH


_PAGE: Final = 10
"""Number of rows for a page key."""

_ORDERS: Final = tuple(RowOrder)


class TopModel:
    """State of `canmon top`: the statistics of the traffic and the settings of the display.

    Args:
        rates: bit rates of the buses.

    Attributes:
        traffic: statistics of the counted traffic.
        view: settings of the display.
    """

    def __init__(self, rates: traffic.BitRates = traffic.NO_RATES) -> None:
        self.traffic, self._serial, self.rates = traffic.Traffic(rates), LineTraffic(), rates
        self.view = TableView(styled=True, bit_rate=rates.nominal, keys=True)
        self._held: tuple[traffic.TrafficSnapshot, tuple[_LineRow, ...]] | None = None
        self._now_us = 0
        self._meanings: dict[tuple[str, int], Decoded] = {}
        self._acts: dict[str, Callable[[], None]] = {
            " ": self._hold,
            "b": lambda: self._show(bits=not self.view.bits),
            "d": lambda: self._show(meaning=None if self.view.meaning else self._meaning),
            "n": self.traffic.notch,
            "s": lambda: self._show(order=_next(self.view.order)),
            "c": self._clear,
            "j": lambda: self._scroll(1),
            "k": lambda: self._scroll(-1),
            "f": lambda: self._scroll(_PAGE),
            "p": lambda: self._scroll(-_PAGE),
        }

    def take(self, records: Iterable[AnyRecord]) -> None:
        """Count frames, and lines of serial ports, even while the display is paused."""
        for record in records:
            if isinstance(record, Record):
                self.traffic.take(record)
            else:
                self._serial.take(record)

    def take_decoded(self, decoded_frames: Iterable[tuple[AnyRecord, Decoded | None]]) -> None:
        """Count frames, and keep the meaning of the latest frame of each identifier."""
        for record, decoded in decoded_frames:
            self.take((record,))
            frame = record.frame
            if decoded is not None and frame is not None and not isinstance(frame, ErrorFrame):
                self._meanings[record.channel, any_ident(frame)] = decoded

    def press(self, key: str) -> None:
        """Process a key. A key without a meaning does nothing."""
        if key in self._acts:
            self._acts[key]()

    def lines(self, now_us: int, lost: int, width: int, height: int, unread: int = 0) -> list[str]:
        """Return the lines of the screen at a time."""
        self._now_us = now_us
        snapshot, rows = self._held or self._snapshot()
        below = line_table(rows, snapshot.at_us, width)[: height // 2]
        view = replace(self.view, unread=unread)
        return render(snapshot, view, lost, width, height - len(below)) + below

    def final(self, lost: int, snapshot: traffic.TrafficSnapshot | None = None) -> list[str]:
        """Return the whole table of all traffic, or of a snapshot, as plain text."""
        view = replace(self.view, held=False, top=0, styled=False, keys=False)
        rows = self._serial.rows()
        snapshot = snapshot or self.traffic.snapshot()
        now_us = max([snapshot.at_us, *(row.last_us for row in rows)])
        below = line_table(rows, now_us, UNBOUNDED)
        return render(snapshot, view, lost, UNBOUNDED, UNBOUNDED) + below

    def _meaning(self, row: traffic.IdRow) -> str:
        decoded = self._meanings.get((row.channel, row.ident))
        return _data_text(row, False) if decoded is None else meaning_text(decoded)

    def _snapshot(self) -> tuple[traffic.TrafficSnapshot, tuple[_LineRow, ...]]:
        return self.traffic.snapshot(self._now_us), self._serial.rows()

    def _clear(self) -> None:
        self.traffic.clear()
        self._serial.clear()

    def _hold(self) -> None:
        self._held = None if self._held else self._snapshot()
        self._show(held=self._held is not None)

    def _scroll(self, rows: int) -> None:
        last = max(0, len(self.traffic.snapshot(self._now_us).rows) - 1)
        self._show(top=min(last, max(0, self.view.top + rows)))

    def _show(self, **changes: object) -> None:
        self.view = replace(self.view, **changes)  # type: ignore[arg-type]  # fields of View


def meaning_text(decoded: Decoded) -> str:
    """Return the decoded meaning of a frame as text.

    The text includes the node, and the source of the signal names, such as an EDS file.
    """
    node = "" if decoded.node is None else f"{decoded.node} "
    source = f" ({decoded.source})" if decoded.source else ""
    return in_cells(f"{node}{decoded.kind} {decoded.text}".rstrip() + source)


def _next(order: RowOrder) -> RowOrder:
    return _ORDERS[(_ORDERS.index(order) + 1) % len(_ORDERS)]
