"""Links that say when each frame was on the bus."""

from __future__ import annotations

from typing import Protocol

from tickrig.host.links.link import Link
from tickrig.wire.can import CanFrame, Frames

Stamped = tuple[tuple[int, CanFrame], ...]
"""Frames, each with the time at which it had ended on the bus, on the clock of its link."""


class StampedLink(Link[Frames], Protocol):
    """A link to a CAN bus for who judges silence: late reading is no silence of the bus."""

    def hear(self, timeout_us: int, /) -> tuple[int, Stamped]:
        """Wait for a first frame; return a time, and all that had arrived by then.

        Raises:
            LinkClosed: the bus is gone.
        """
        ...
