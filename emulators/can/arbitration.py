"""Arbitration: the bits that nodes compare, whose frame is next, and when it starts."""

from __future__ import annotations

from collections.abc import Sequence
from heapq import heapify, heappop, heappush
from typing import TYPE_CHECKING

from tickrig.wire.can import CanFrame

if TYPE_CHECKING:
    from tickrig.emulators.can.end import CanEnd


def priority(frame: CanFrame) -> int:
    """Return the arbitration field as a number; the smallest wins, dominant bits being 0.

    With equal identifiers data come before remote frames, and 11-bit before
    29-bit identifiers (ISO 11898-1, arbitration).

    >>> frames = [CanFrame.parse(t) for t in ("101#", "100#", "100#R", "04000000#", "04000000#R")]
    >>> [str(frame) for frame in sorted(frames, key=priority)]
    ['100#', '100#R', '04000000#', '04000000#R', '101#']
    """
    can_id, _, remote, extended, _ = frame
    if extended:
        return (can_id >> 18) << 21 | 3 << 19 | (can_id & 0x3_FFFF) << 1 | remote
    return can_id << 21 | remote << 20


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


class CanArbiter:
    """The first frames of all queues, sorted as the bits on the bus would sort them.

    All times are in the units of the segment.

    Attributes:
        heads: a heap of priority, number of the node, node.
        free: no frame starts before this.
        slow: some node has to wait longer than the bus is busy.
    """

    __slots__ = ("free", "heads", "slow")

    def __init__(self) -> None:
        self.free, self.slow = 0, False
        self.heads: list[tuple[int, int, CanEnd]] = []

    def enter(self, end: CanEnd, now: int) -> None:
        """Let a node whose queue was empty take part from now on."""
        end.held = max(end.held, now)
        heappush(self.heads, (priority(end.queue[0]), end.number, end))

    def put_back(self, ends: list[CanEnd]) -> None:
        """Let nodes take part again, those that still have a frame to send."""
        for end in ends:
            if end.queue:
                heappush(self.heads, (priority(end.queue[0]), end.number, end))

    def remove(self, end: CanEnd) -> None:
        """Let a node take part no longer."""
        self.heads = [head for head in self.heads if head[2] is not end]
        heapify(self.heads)

    def take(self) -> list[CanEnd]:
        """Take the winner out; several nodes with the same identifier all win."""
        heads = self.heads
        rank, _, end = heappop(heads)
        winners = [end]
        while heads and heads[0][0] == rank:
            winners.append(heappop(heads)[2])
        return winners

    def take_waiting(self, *, everybody: bool = False) -> tuple[int, list[CanEnd]]:
        """Take the winner of those that wait least, or all of them; the start comes first."""
        start = max(self.free, min(head[2].held for head in self.heads))
        able = sorted(head for head in self.heads if head[2].held <= start)
        winners = [end for rank, _, end in able if everybody or rank == able[0][0]]
        self.slow = any(head[2].held > self.free for head in self.heads)
        for end in winners:
            self.remove(end)
        return start, winners
