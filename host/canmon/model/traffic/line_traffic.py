"""The traffic of serial lines: one row for each kind of message, and its table for `canmon top`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from tickrig.host.canmon.model.frames.quantity import ms_text, rate_text, s_text
from tickrig.host.canmon.model.frames.record import ARROWS
from tickrig.host.text.page_text import in_cells

if TYPE_CHECKING:
    from tickrig.host.canmon.model.decode.decoded import Decoded
    from tickrig.host.canmon.model.frames.record import LineRecord

ANSWERS: Final = ("ok", "refused", "event")
"""Signals that name a kind of answer."""

COMMAND: Final = "command"
STATUS: Final = "status"
OTHER: Final = "other"


class LineRow(NamedTuple):
    """One kind of message on one line, in one direction.

    Attributes:
        channel: name of the line.
        sent: to the device.
        word: what kind of message.
        messages: how many.
        first_us: when the first came.
        last_us: when the latest came.
        gap_us: since the one before it; None for the first.
        text: what the latest says.
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
        """Messages a second, on average; 0 of one alone."""
        span_us = self.last_us - self.first_us
        return (self.messages - 1) * 1e6 / span_us if span_us > 0 else 0.0


class LineTraffic:
    """Counts messages; what it keeps grows with their kinds, not with their number."""

    def __init__(self) -> None:
        self._rows: dict[tuple[str, bool, str], LineRow] = {}

    def take(self, line: LineRecord) -> None:
        """Count a message."""
        at_us, decoded = line.at_us, line.decoded
        key = line.channel, line.sent, word_of(decoded)
        row = self._rows.get(key)
        self._rows[key] = (
            LineRow(*key, 1, at_us, at_us, None, decoded.text)
            if row is None
            else LineRow(
                *key, row.messages + 1, row.first_us, at_us, at_us - row.last_us, decoded.text
            )
        )

    def clear(self) -> None:
        """Forget everything."""
        self._rows.clear()

    def rows(self) -> tuple[LineRow, ...]:
        """Return the rows by line, direction and kind."""
        return tuple(self._rows[key] for key in sorted(self._rows))


def word_of(decoded: Decoded) -> str:
    """Return the kind of a message: its command, or what kind of answer it is."""
    if not decoded.signals:
        return OTHER
    first = decoded.signals[0]
    if first.name == COMMAND:
        return str(first.value)
    return first.name if first.name in ANSWERS else STATUS


def line_table(rows: tuple[LineRow, ...], now_us: int, width: int) -> list[str]:
    """Return the table; nothing where there are no rows."""
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
