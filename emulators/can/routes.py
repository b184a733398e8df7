"""Delivery by table: which ends of a bus receive which CAN-ID."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from tickrig.device.twin import Cache, Part
from tickrig.wire.can import CanFrame

if TYPE_CHECKING:
    from tickrig.emulators.can.end import CanEnd

EXTENDED: Final = 1 << 29
"""Marks a 29-bit CAN-ID in a filter, as it does in a COB-ID (CiA 301)."""

CACHED_ROUTES: Final = 4_096


class CanRoutes(Part):
    """The ends of a bus and their filters, looked up once for each CAN-ID.

    Attributes:
        ends: all ends, in the order in which they joined.
        unfiltered: those of them whose filter is out of use until they are polled.
    """

    def __init__(self) -> None:
        self.ends: list[CanEnd] = []
        self.unfiltered: list[CanEnd] = []
        self._table: Cache[int, tuple[CanEnd, ...]] = Cache()

    def forget(self) -> None:
        """Begin anew: an end joined, left or has another filter."""
        self._table.clear()

    def receivers(self, frame: CanFrame) -> tuple[CanEnd, ...]:
        """Return the ends that receive a frame; its sender may be among them."""
        key = frame[0] | EXTENDED if frame[3] else frame[0]
        found = self._table.get(key)
        if found is None:
            found = self._table[key] = self._look_up(key)
        return (*found, *self._passing(key)) if self.unfiltered else found

    def _passing(self, key: int) -> Iterator[CanEnd]:
        """Give the unfiltered ends that a CAN-ID would not reach by the filters."""
        for end in self.unfiltered:
            if end.accepts is not None and key not in end.accepts:
                yield end

    def _look_up(self, key: int) -> tuple[CanEnd, ...]:
        if len(self._table) >= CACHED_ROUTES:
            self._table.clear()
        return tuple(end for end in self.ends if end.accepts is None or key in end.accepts)
