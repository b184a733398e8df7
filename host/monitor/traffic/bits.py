"""Which bits of a payload change, and how often: the memory of a bus."""

from __future__ import annotations

from functools import reduce
from operator import or_
from typing import Final, NamedTuple

PAYLOAD_BITS: Final = 64


class BitRow(NamedTuple):
    """What changed in the payloads of one identifier.

    A payload is a number here: bit 0 of byte 0 is bit 0, bit 7 of byte 7 is bit 63.

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
        """Return how often each of the 64 bits changed.

        >>> BitRow(planes=(0b01, 0b11)).counts()[:3]
        (3, 2, 0)
        """
        return tuple(
            sum((plane >> bit & 1) << place for place, plane in enumerate(self.planes))
            for bit in range(PAYLOAD_BITS)
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
