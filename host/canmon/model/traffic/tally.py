"""All that is counted of the frames of one identifier."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from operator import or_
from typing import Any, Final, NamedTuple

from tickrig.host.canmon.model.traffic.gaps import GapRow, Gaps
from tickrig.wire.can import CanFrame
from tickrig.wire.can_bits import frame_bits
from tickrig.wire.can_fd import FdFrame

PAYLOAD_BITS: Final = 64


class BitRow(NamedTuple):
    """What changed in the payloads of one identifier.

    A payload is a number here: bit 0 of byte 0 is bit 0, bit 7 of byte 7 is bit 63; in CAN FD
    it goes on to bit 511.

    Attributes:
        latest: bits in which the latest payload differs from the one before.
        planes: plane n holds bit n of each payload bit's count of changes.
        notched: bits whose changes are known and not shown.
    """

    latest: int = 0
    planes: tuple[int, ...] = ()
    notched: int = 0

    @property
    def changed(self) -> int:
        """All bits that ever changed and are not notched."""
        return reduce(or_, self.planes, 0) & ~self.notched

    def counts(self) -> tuple[int, ...]:
        """Return how often each bit changed: of 64 bits, in CAN FD of as many as changed.

        >>> BitRow(planes=(0b01, 0b11)).counts()[:3]
        (3, 2, 0)
        """
        highest = max(map(int.bit_length, self.planes), default=0)
        return tuple(
            sum((plane >> bit & 1) << place for place, plane in enumerate(self.planes))
            for bit in range(max(PAYLOAD_BITS, -(-highest // 8) * 8))
        )


class BitMemory:
    """Counts the changes of each bit, all bits at once: the counts lie across big numbers.

    A payload that is shorter than the one before counts as filled up with zeros.

    Attributes:
        notched: bits whose changes are known.
    """

    __slots__ = ("_latest", "_payload", "_planes", "notched")

    def __init__(self, payload: int) -> None:
        self._payload, self._latest, self.notched = payload, 0, 0
        self._planes: list[int] = []

    def take(self, payload: int) -> None:
        """Compare a payload with the one before."""
        self._latest = carry = payload ^ self._payload
        self._payload = payload
        planes, place = self._planes, 0
        while carry:
            if place == len(planes):
                planes.append(0)
            planes[place], carry = planes[place] ^ carry, planes[place] & carry
            place += 1

    def same(self) -> None:
        """Note that the payload came again as it was."""
        self._latest = 0

    def notch(self) -> None:
        """Take all bits that have changed as known."""
        self.notched |= reduce(or_, self._planes, 0)

    def row(self) -> BitRow:
        """Return what changed."""
        return BitRow(self._latest, tuple(self._planes), self.notched)


class IdRow(NamedTuple):
    """What one identifier did on one bus.

    Attributes:
        channel: the bus.
        ident: see `ident_of` and `fd_ident`.
        frames: how many.
        first_us: when the first of them came.
        last_us: when the latest came.
        frame: the latest.
        gap_us: the latest gap, None before the second frame.
        gaps: all gaps, None before the second frame.
        bits: bits of all frames on the bus; those of CAN FD as `BitRates` has it.
        changed: which payload bits change.
    """

    channel: str
    ident: int
    frames: int
    first_us: int
    last_us: int
    frame: CanFrame | FdFrame
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

    Args:
        at_us: when the first frame came.
        frame: the frame; those that follow are of its kind.
        measure: tells its bits on the bus.

    Attributes:
        length: bits of the latest frame on the bus.
        memory: which payload bits change.
    """

    __slots__ = (
        *("_bits", "_first_us", "_frame", "_gap_us", "_gaps", "_last_us", "_measure"),
        *("length", "memory"),
    )

    def __init__(
        self, at_us: int, frame: CanFrame | FdFrame, measure: Callable[[Any], int] = frame_bits
    ) -> None:
        self._first_us = self._last_us = at_us
        self._frame, self._gaps, self._measure = frame, Gaps(), measure
        self.length = self._bits = measure(frame)
        self._gap_us: int | None = None
        self.memory = BitMemory(int.from_bytes(frame.data, "little"))

    def take(self, at_us: int, frame: CanFrame | FdFrame) -> None:
        """Count a frame after the first."""
        gap_us = self._gap_us = max(0, at_us - self._last_us)
        self._last_us = at_us
        self._gaps.take(gap_us)
        if frame == self._frame:
            self.memory.same()
        else:
            self._frame, self.length = frame, self._measure(frame)
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
