"""Arbitration: the bits that nodes compare, and the sender and start of the next frame."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from heapq import heapify, heappop, heappush
from typing import TYPE_CHECKING, Final

from tickrig.emulators.rig.kernel import ArbiterFields, in_kernel
from tickrig.wire.can import CanFrame

if TYPE_CHECKING:
    from tickrig.emulators.can.end import CanEnd

_CAN_ID_PLACE: Final = 21  # of an 11-bit CAN-ID in the arbitration field
_NUMBER_BITS: Final = 24
_NUMBER_MASK: Final = (1 << _NUMBER_BITS) - 1
_FIRST_NUMBER: Final = -1
"""Number of the node of the fault `babble`; other nodes are numbered from 0."""


def priority(frame: CanFrame) -> int:
    """Return the arbitration field of a frame as a number, for comparison with other frames.

    The frame with the smallest number wins, because dominant bits are 0. With equal identifiers a
    data frame wins over a remote frame, and an 11-bit identifier over a 29-bit identifier (ISO
    11898-1, arbitration).

    >>> frames = [CanFrame.parse(t) for t in ("101#", "100#", "100#R", "04000000#", "04000000#R")]
    >>> [str(frame) for frame in sorted(frames, key=priority)]
    ['100#', '100#R', '04000000#', '04000000#R', '101#']
    """
    can_id = frame[0]
    if frame[3]:
        return (can_id >> 18) << 21 | 3 << 19 | (can_id & 0x3_FFFF) << 1 | frame[2]
    return can_id << _CAN_ID_PLACE | (1 << 20 if frame[2] else 0)


def dominant(frames: Sequence[CanFrame]) -> CanFrame:
    """Of frames with the same identifier, return the frame whose bits are dominant."""
    return min(frames, key=lambda frame: (frame.dlc, frame.data))


class CanArbiter(ArbiterFields):
    """Decides which nodes of an emulated CAN bus send next, by the identifiers of their frames.

    All times are whole numbers of the unit that the `CanSegment` of the bus has chosen.

    Attributes:
        heads: a heap with a whole number for each node that has frames to send. The high bits are
            the priority of the first frame in the node's queue, and the low bits are the number of
            the node.
        free: earliest time at which a frame can start.
        slow: whether a node may have to wait although the bus is free. Then `take_waiting` must be
            called instead of the faster `take`.
    """

    __slots__ = ()

    def __init__(self) -> None:
        self.free, self.slow = 0, False
        self.heads: list[int] = []
        self._ends: dict[int, CanEnd] = {}

    def join(self, end: CanEnd) -> None:
        """Add a node to the arbitration."""
        self._ends[end.number - _FIRST_NUMBER] = end

    def leave(self, end: CanEnd) -> None:
        """Remove a node."""
        self._remove(end)
        del self._ends[end.number - _FIRST_NUMBER]

    def put_back(self, ends: Iterable[CanEnd]) -> None:
        """Enter the nodes that still have a frame to send into the next arbitration."""
        for end in ends:
            if end.waiting:
                self.push(end)

    @in_kernel
    def push(self, end: CanEnd) -> None:
        """Enter a node that has a frame to send into the next arbitration."""
        frame = end.next
        rank = priority(frame) if frame[2] or frame[3] else frame[0] << _CAN_ID_PLACE
        head = rank << _NUMBER_BITS | end.number - _FIRST_NUMBER
        heappush(self.heads, head)

    def take(self) -> list[CanEnd]:
        """Remove the nodes that win the arbitration, and return them.

        There is one winner, or several if their frames have the same identifier.
        """
        heads = self.heads
        head = heappop(heads)
        winners = [self._ends[head & _NUMBER_MASK]]
        while heads and heads[0] >> _NUMBER_BITS == head >> _NUMBER_BITS:
            winners.append(self._ends[heappop(heads) & _NUMBER_MASK])
        return winners

    def take_waiting(self, *, everybody: bool = False) -> tuple[int, list[CanEnd]]:
        """Remove and return the nodes that send next.

        Some nodes may have to wait although the bus is free. Such a node takes part in the
        arbitration only if its wait has ended at the start of the frame. The method `take` is
        faster, but it ignores these waits.

        Args:
            everybody: whether to choose all nodes that may send at the start of the frame. This is
                needed on a bus with a short circuit, where no arbitration is possible. If false,
                only the nodes that win the arbitration are chosen.

        Returns:
            The start of the next frame, and the nodes.
        """
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
        """Exclude a node from the arbitration."""
        number = end.number - _FIRST_NUMBER
        self.heads = [head for head in self.heads if head & _NUMBER_MASK != number]
        heapify(self.heads)
