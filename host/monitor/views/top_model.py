"""What `canmon top` shows, driven by frames, keys and the time."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from tickrig.host.monitor.frames.ident import ident_of
from tickrig.host.monitor.frames.record import Record
from tickrig.host.monitor.traffic.line_traffic import LineRow, LineTraffic, line_table
from tickrig.host.monitor.traffic.tally import IdRow
from tickrig.host.monitor.traffic.traffic import Snapshot, Traffic
from tickrig.host.monitor.views.top_columns import data_text
from tickrig.host.monitor.views.top_table import UNBOUNDED, Order, View, render
from tickrig.wire.can import CanFrame

if TYPE_CHECKING:
    from tickrig.host.monitor.decode.decoded import Decoded
    from tickrig.host.monitor.frames.record import AnyRecord

PAGE: Final = 10
"""Rows that a key for a page goes."""

ORDERS: Final = tuple(Order)


class TopModel:
    """Traffic and the view of it.

    Args:
        bit_rate: of the buses, None if it is not known.

    Attributes:
        traffic: what was heard.
        view: how it is shown.
    """

    def __init__(self, bit_rate: int | None = None) -> None:
        self.traffic, self._serial = Traffic(), LineTraffic()
        self.view = View(styled=True, bit_rate=bit_rate, keys=True)
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
            if decoded is not None and isinstance(record.frame, CanFrame):
                self._meanings[record.channel, ident_of(record.frame)] = decoded

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
    return f"{node}{decoded.kind} {decoded.text}".rstrip() + source


def _next(order: Order) -> Order:
    return ORDERS[(ORDERS.index(order) + 1) % len(ORDERS)]
