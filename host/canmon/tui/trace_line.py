"""Rows of the trace as lines with styles.

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

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter
from typing import Final

from tickrig.host.canmon.model import frames
from tickrig.host.canmon.model.top_model import meaning_text
from tickrig.host.canmon.model.trace import TraceRow
from tickrig.host.tui import Line, line_text
from tickrig.wire.can import CanFrame, ErrorFrame

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
