"""When a bus was busy, and how much of its time."""

from __future__ import annotations

from collections import deque
from typing import Final

from tickrig.device.twin import Part

KEPT_SPANS: Final = 32_768


class BusyTime(Part):
    """The latest spans of time in which a bus was busy; frames behind each other are one span.

    Times are whole numbers of any unit.
    """

    __slots__ = ("_since", "_spans", "_until")

    def __init__(self) -> None:
        self._since = self._until = 0
        self._spans: deque[tuple[int, int]] = deque(maxlen=KEPT_SPANS)

    def note(self, since: int, until: int) -> None:
        """Add a span that begins at the end of the latest one, or later."""
        if since != self._until:
            self._spans.append((self._since, self._until))
            self._since = since
        self._until = until

    def permille(self, first: int, now: int, present: tuple[int, int]) -> int:
        """Return the share of the time from `first` to `now`, in 0.1 %.

        Args:
            first: when it begins.
            now: when it ends.
            present: the span of the frame that is on the bus.
        """
        spans = (*self._spans, (self._since, self._until), present)
        busy = sum(max(0, min(until, now) - max(since, first)) for since, until in spans)
        return 1_000 * busy // (now - first) if now > first else 0
