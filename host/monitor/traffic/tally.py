"""All that is counted of the frames of one identifier."""

from __future__ import annotations

from typing import NamedTuple

from tickrig.host.monitor.traffic.bits import BitMemory, BitRow
from tickrig.host.monitor.traffic.gaps import GapRow, Gaps
from tickrig.wire.can import CanFrame
from tickrig.wire.can_bits import frame_bits


class IdRow(NamedTuple):
    """What one identifier did on one bus.

    Attributes:
        channel: the bus.
        ident: see `ident_of`.
        frames: how many.
        first_us: when the first of them came.
        last_us: when the latest came.
        frame: the latest.
        gap_us: the latest gap, None before the second frame.
        gaps: all gaps, None before the second frame.
        bits: bits of all frames on the bus.
        changed: which payload bits change.
    """

    channel: str
    ident: int
    frames: int
    first_us: int
    last_us: int
    frame: CanFrame
    gap_us: int | None
    gaps: GapRow | None
    bits: int
    changed: BitRow

    @property
    def rate_hz(self) -> float:
        """Frames a second, from the first to the latest; 0 if that took no time."""
        span_us = self.last_us - self.first_us
        return (self.frames - 1) * 1e6 / span_us if span_us > 0 else 0.0


class Tally:
    """Counts the frames of one identifier on one bus.

    A frame with an earlier time than the one before it has a gap of 0.

    Attributes:
        length: bits of the latest frame on the bus.
        memory: which payload bits change.
    """

    __slots__ = ("_bits", "_first_us", "_frame", "_gap_us", "_gaps", "_last_us", "length", "memory")

    def __init__(self, at_us: int, frame: CanFrame) -> None:
        self._first_us = self._last_us = at_us
        self._frame, self._gaps = frame, Gaps()
        self.length = self._bits = frame_bits(frame)
        self._gap_us: int | None = None
        self.memory = BitMemory(int.from_bytes(frame.data, "little"))

    def take(self, at_us: int, frame: CanFrame) -> None:
        """Count a frame after the first."""
        gap_us = self._gap_us = max(0, at_us - self._last_us)
        self._last_us = at_us
        self._gaps.take(gap_us)
        if frame == self._frame:
            self.memory.same()
        else:
            self._frame, self.length = frame, frame_bits(frame)
            self.memory.take(int.from_bytes(frame.data, "little"))
        self._bits += self.length

    def row(self, channel: str, ident: int) -> IdRow:
        """Return what was counted."""
        return IdRow(
            channel,
            ident,
            self._gaps.count + 1,
            self._first_us,
            self._last_us,
            self._frame,
            self._gap_us,
            self._gaps.row(),
            self._bits,
            self.memory.row(),
        )
