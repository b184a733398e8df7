"""Arbitration: the bits that nodes compare, whose frame is next, and when it starts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from heapq import heapify, heappop, heappush
from typing import TYPE_CHECKING, Final

from tickrig.emulators.rig.kernel import ArbiterFields, in_kernel
from tickrig.wire.can import CanFrame

if TYPE_CHECKING:
    from tickrig.emulators.can.end import CanEnd

_NUMBER_BITS: Final = 24
_NUMBER_MASK: Final = (1 << _NUMBER_BITS) - 1
_FIRST_NUMBER: Final = -1
"""Of the node that the fault `babble` adds; the others are counted from 0."""


def priority(frame: CanFrame) -> int:
    """Return the arbitration field as a number; the smallest wins, dominant bits being 0.

    With equal identifiers data come before remote frames, and 11-bit before
    29-bit identifiers (ISO 11898-1, arbitration).

    >>> frames = [CanFrame.parse(t) for t in ("101#", "100#", "100#R", "04000000#", "04000000#R")]
    >>> [str(frame) for frame in sorted(frames, key=priority)]
    ['100#', '100#R', '04000000#', '04000000#R', '101#']
    """
    can_id = frame[0]
    if frame[3]:
        return (can_id >> 18) << 21 | 3 << 19 | (can_id & 0x3_FFFF) << 1 | frame[2]
    return can_id << 21 | (1 << 20 if frame[2] else 0)


def first_difference(frames: Sequence[CanFrame]) -> int:
    """Return at which bit, counted without stuff bits, frames of one priority begin to differ."""
    control = 39 if frames[0].extended else 19
    if len({frame.dlc for frame in frames}) > 1:
        return control
    least, most = (int.from_bytes(pick(f.data for f in frames), "big") for pick in (min, max))
    return control + 8 * frames[0].dlc - (least ^ most).bit_length()


def dominant(frames: Sequence[CanFrame]) -> CanFrame:
    """Return the frame that would be heard if the other senders gave way."""
    return min(frames, key=lambda frame: (frame.dlc, frame.data))


class CanArbiter(ArbiterFields):
    """The first frames of all queues, sorted as the bits on the bus would sort them.

    All times are in the units of the segment.

    Attributes:
        heads: a heap of whole numbers, which sort faster than tuples: the priority of the
            first frame of a queue, and below it the number of the node.
        free: no frame starts before this.
        slow: some node has to wait longer than the bus is busy.
    """

    __slots__ = ()

    def __init__(self) -> None:
        self.free, self.slow = 0, False
        self.heads: list[int] = []
        self._ends: dict[int, CanEnd] = {}

    def join(self, end: CanEnd) -> None:
        """Know a node, which may then take part."""
        self._ends[end.number - _FIRST_NUMBER] = end

    def leave(self, end: CanEnd) -> None:
        """Know a node no longer."""
        self._remove(end)
        del self._ends[end.number - _FIRST_NUMBER]

    def enter(self, end: CanEnd, now: int) -> None:
        """Let a node whose queue was empty take part from now on."""
        end.held = max(end.held, now)
        self.push(end)

    def put_back(self, ends: Iterable[CanEnd]) -> None:
        """Let nodes take part again, those that still have a frame to send."""
        for end in ends:
            if end.waiting:
                self.push(end)

    @in_kernel
    def push(self, end: CanEnd) -> None:
        """Let a node take part again, which has a frame to send."""
        head = priority(end.next) << _NUMBER_BITS | end.number - _FIRST_NUMBER
        heappush(self.heads, head)

    def take(self) -> list[CanEnd]:
        """Take the winner out; several nodes with the same identifier all win."""
        heads = self.heads
        head = heappop(heads)
        winners = [self._ends[head & _NUMBER_MASK]]
        while heads and heads[0] >> _NUMBER_BITS == head >> _NUMBER_BITS:
            winners.append(self._ends[heappop(heads) & _NUMBER_MASK])
        return winners

    def take_waiting(self, *, everybody: bool = False) -> tuple[int, list[CanEnd]]:
        """Take the winner of those that wait least, or all of them; the start comes first."""
        waiting = {head: self._ends[head & _NUMBER_MASK] for head in sorted(self.heads)}
        start = max(self.free, min(end.held for end in waiting.values()))
        able = [head for head, end in waiting.items() if end.held <= start]
        rank = able[0] >> _NUMBER_BITS
        winners = [waiting[head] for head in able if everybody or head >> _NUMBER_BITS == rank]
        self.slow = any(end.held > self.free for end in waiting.values())
        for end in winners:
            self._remove(end)
        return start, winners

    def _remove(self, end: CanEnd) -> None:
        """Let a node take part no longer."""
        number = end.number - _FIRST_NUMBER
        self.heads = [head for head in self.heads if head & _NUMBER_MASK != number]
        heapify(self.heads)
