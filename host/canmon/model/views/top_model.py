"""The table of all identifiers that `canmon top` paints, driven by frames, keys and the time."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Final, NamedTuple

from tickrig.host.canmon.model.frames.ident import any_ident
from tickrig.host.canmon.model.frames.quantity import load_text
from tickrig.host.canmon.model.frames.record import Record
from tickrig.host.canmon.model.traffic.bit_rates import NO_RATES, BitRates
from tickrig.host.canmon.model.traffic.line_traffic import LineRow, LineTraffic, line_table
from tickrig.host.canmon.model.traffic.tally import IdRow
from tickrig.host.canmon.model.traffic.traffic import BusRow, Snapshot, Traffic
from tickrig.host.canmon.model.views.top_columns import (
    Column,
    IdText,
    data_text,
    fitting,
    heat_text,
)
from tickrig.host.text.page_text import in_cells
from tickrig.wire.can_error import ErrorFrame

if TYPE_CHECKING:
    from tickrig.host.canmon.model.decode.decoded import Decoded
    from tickrig.host.canmon.model.frames.record import AnyRecord

DATA_WIDTH: Final = 23
HEAT_WIDTH: Final = 71
MEANING_WIDTH: Final = 50
CHANNEL_MAX: Final = 12
KEYS: Final = "  q quit, space hold, b bits, d decode, n notch, s sort, c clear"
UNRATED: Final = "load at most (no --data-bitrate)"
UNBOUNDED: Final = 1 << 16
"""A width or height that everything fits into."""


class Order(StrEnum):
    """By what the rows are sorted."""

    ID = "id"
    RATE = "rate"
    JITTER = "jitter"
    GAP = "gap"
    AGE = "age"


_KEYS: Final[dict[Order, Callable[[IdRow], float]]] = {
    Order.ID: lambda row: 0,
    Order.RATE: lambda row: -row.rate_hz,
    Order.JITTER: lambda row: -row.gaps.jitter_us if row.gaps else 1,
    Order.GAP: lambda row: -row.gaps.max_us if row.gaps else 1,
    Order.AGE: lambda row: row.last_us,
}


@dataclass(frozen=True, slots=True)
class View:
    """How the table is shown.

    Attributes:
        order: of its rows.
        bits: bits instead of bytes.
        held: the picture stands still.
        top: rows that are scrolled past.
        styled: changes are marked; text of a file is not.
        bit_rate: of the buses, None if it is not known.
        keys: a line tells the keys.
        meaning: what the latest frame of a row means, shown instead of its bytes.
        unread: what came and is no frame of CAN or CAN FD.
    """

    order: Order = Order.ID
    bits: bool = False
    held: bool = False
    top: int = 0
    styled: bool = False
    bit_rate: int | None = None
    keys: bool = False
    meaning: Callable[[IdRow], str] | None = None
    unread: int = 0


def render(
    snapshot: Snapshot, view: View, lost: int = 0, width: int = UNBOUNDED, height: int = UNBOUNDED
) -> list[str]:
    """Return the lines, no more than `height`, none wider than `width`.

    Args:
        snapshot: what there is to show.
        view: how.
        lost: frames that did not get here.
        width: characters of the screen.
        height: lines of the screen.
    """
    head = [bus_line(bus, view.bit_rate)[:width] for bus in snapshot.buses]
    head.append(_state_line(snapshot, view, lost)[:width])
    table = _Table.of(snapshot, view, width)
    head.append(table.titles())
    room = max(0, height - len(head))
    rows = sorted(snapshot.rows, key=_KEYS[view.order])[view.top : view.top + room]
    return (head + [table.line(row, snapshot.at_us) for row in rows])[:height]


def bus_line(bus: BusRow, bit_rate: int | None) -> str:
    """Write what a bus did in one line."""
    load, errors = bus.load, bus.errors
    words = [
        f"{in_cells(bus.channel)}: {bus.frames} frames",
        f"load {load_text(load.latest.bits, bit_rate)}",
        f"error frames {errors.frames}",
    ]
    if errors.state is not None:
        words.append(f"controller {errors.state.name.lower().replace('_', '-')}")
    if errors.tec is not None:
        words.append(f"TEC {errors.tec} REC {errors.rec}")
    words += [f"overflows {errors.overflows}"] * bool(errors.overflows)
    words += [f"back in time {bus.went_back}"] * bool(bus.went_back)
    words += [f"CAN FD {bus.fd}"] * bool(bus.fd)
    words += [UNRATED] * bool(bus.unrated)
    words.append(f"mean {load_text(load.mean_bit_s, bit_rate)}")
    words.append(f"peak {load_text(load.peak.bits, bit_rate)}")
    return ", ".join(words)


def _state_line(snapshot: Snapshot, view: View, lost: int) -> str:
    words = [f"lost {lost}", *[f"passed over {view.unread}"] * bool(view.unread)]
    words += [f"{len(snapshot.rows)} identifiers by {view.order}"]
    words += ["held"] * view.held
    keys = KEYS if view.keys else ""
    return ", ".join(words) + keys


class _Table(NamedTuple):
    """What of the rows has room.

    Attributes:
        ids: the leading column.
        columns: of numbers.
        payload: the last cell of a row, and its title.
        styled: what changed is marked, in lines that are not cut: a style may not be.
        width: characters of the screen.
    """

    ids: IdText
    columns: tuple[Column, ...]
    payload: tuple[Callable[[IdRow, bool], str], str]
    styled: bool
    width: int

    @classmethod
    def of(cls, snapshot: Snapshot, view: View, width: int) -> _Table:
        """Choose the columns."""
        longest = max((len(bus.channel) for bus in snapshot.buses), default=0)
        ids = IdText(min(CHANNEL_MAX, longest) if len(snapshot.buses) > 1 else 0)
        room = width - ids.width - _payload_width(view) - 1
        columns = fitting(room)
        fits = room >= sum(column.width + 1 for column in columns)
        styled = view.styled and fits and (view.bits or view.meaning is None)
        return cls(ids, columns, _payload(view), styled, width)

    def titles(self) -> str:
        """Return the head."""
        cells = [f"{column.title:>{column.width}}" for column in self.columns]
        return " ".join([self.ids.title(), *cells, self.payload[1]])[: self.width]

    def line(self, row: IdRow, now_us: int) -> str:
        """Return a row."""
        cells = [f"{column.text(row, now_us):>{column.width}}" for column in self.columns]
        line = " ".join([self.ids.of(row), *cells, self.payload[0](row, self.styled)])
        return (line if self.styled else line[: self.width]).rstrip()


def _payload_width(view: View) -> int:
    if view.bits:
        return HEAT_WIDTH
    return DATA_WIDTH if view.meaning is None else MEANING_WIDTH


def _payload(view: View) -> tuple[Callable[[IdRow, bool], str], str]:
    meaning = view.meaning
    if view.bits:
        return heat_text, "bits that change"
    if meaning is None:
        return data_text, "data"
    return lambda row, styled: meaning(row), "meaning"


PAGE: Final = 10
"""Rows that a key for a page goes."""

ORDERS: Final = tuple(Order)


class TopModel:
    """Traffic and the view of it.

    Args:
        rates: bit rates of the buses.

    Attributes:
        traffic: what was heard.
        view: how it is shown.
    """

    def __init__(self, rates: BitRates = NO_RATES) -> None:
        self.traffic, self._serial, self.rates = Traffic(rates), LineTraffic(), rates
        self.view = View(styled=True, bit_rate=rates.nominal, keys=True)
        self._held: tuple[Snapshot, tuple[LineRow, ...]] | None = None
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
            "f": lambda: self._scroll(PAGE),
            "p": lambda: self._scroll(-PAGE),
        }

    def take(self, records: Iterable[AnyRecord]) -> None:
        """Count frames, and lines of serial ports, whatever is shown."""
        for record in records:
            if isinstance(record, Record):
                self.traffic.take(record)
            else:
                self._serial.take(record)

    def take_decoded(self, decoded_frames: Iterable[tuple[AnyRecord, Decoded | None]]) -> None:
        """Count frames, and keep what the latest of each identifier means."""
        for record, decoded in decoded_frames:
            self.take((record,))
            frame = record.frame
            if decoded is not None and frame is not None and not isinstance(frame, ErrorFrame):
                self._meanings[record.channel, any_ident(frame)] = decoded

    def press(self, key: str) -> None:
        """Act on a key; one without a meaning does nothing."""
        if key in self._acts:
            self._acts[key]()

    def lines(self, now_us: int, lost: int, width: int, height: int, unread: int = 0) -> list[str]:
        """Return what a screen shows at a time."""
        self._now_us = now_us
        snapshot, rows = self._held or self._snapshot()
        below = line_table(rows, snapshot.at_us, width)[: height // 2]
        view = replace(self.view, unread=unread)
        return render(snapshot, view, lost, width, height - len(below)) + below

    def final(self, lost: int, snapshot: Snapshot | None = None) -> list[str]:
        """Return the whole table of all that came, or of a snapshot, as plain text."""
        view = replace(self.view, held=False, top=0, styled=False, keys=False)
        rows = self._serial.rows()
        snapshot = snapshot or self.traffic.snapshot()
        now_us = max([snapshot.at_us, *(row.last_us for row in rows)])
        below = line_table(rows, now_us, UNBOUNDED)
        return render(snapshot, view, lost, UNBOUNDED, UNBOUNDED) + below

    def _meaning(self, row: IdRow) -> str:
        decoded = self._meanings.get((row.channel, row.ident))
        return data_text(row, False) if decoded is None else meaning_text(decoded)

    def _snapshot(self) -> tuple[Snapshot, tuple[LineRow, ...]]:
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
    """Write what a frame means, with the node and where the names are from."""
    node = "" if decoded.node is None else f"{decoded.node} "
    source = f" ({decoded.source})" if decoded.source else ""
    return in_cells(f"{node}{decoded.kind} {decoded.text}".rstrip() + source)


def _next(order: Order) -> Order:
    return ORDERS[(ORDERS.index(order) + 1) % len(ORDERS)]
