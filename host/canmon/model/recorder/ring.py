"""What came before a trigger."""

from __future__ import annotations

from collections import deque
from typing import Final

from tickrig.host.canmon.model.frames.record import Record
from tickrig.host.canmon.model.logs.mark import Mark
from tickrig.host.canmon.model.recorder.plan import MAX_PRE_FRAMES, Span

Entry = Record | Mark


MAX_MARKS: Final = 1_000
"""That are kept among frames; the index has all of them."""


class PreTrigger:
    """Keeps the latest frames, and the marks among them.

    Args:
        span: how many before the latest, or for how long.

    Attributes:
        short: frames of the span had to go, for there were too many of them.
    """

    def __init__(self, span: Span) -> None:
        self._us, self._most = span.us, 1 + (MAX_PRE_FRAMES if span.frames is None else span.frames)
        self._entries: deque[Entry] = deque()
        self._frames, self.short = 0, False

    def add(self, record: Record) -> None:
        """Keep one more frame; give up what is too old."""
        self._entries.append(record)
        self._frames += 1
        if self._us is not None:
            # a mark has the time of another clock: it goes when all frames before it are gone
            begin_us, first = record.at_us - self._us, self._entries[0]
            while first.at_us < begin_us or isinstance(first, Mark):
                self._give_up()
                first = self._entries[0]
            self.short = self.short or self._frames > self._most
        while self._frames > self._most:
            self._give_up()

    def mark(self, mark: Mark) -> None:
        """Keep a mark."""
        if len(self._entries) - self._frames < MAX_MARKS:
            self._entries.append(mark)

    def drain(self) -> list[Entry]:
        """Return all that is kept, the oldest first, and keep nothing."""
        found = list(self._entries)
        self._entries.clear()
        self._frames = 0
        return found

    def _give_up(self) -> None:
        self._frames -= isinstance(self._entries.popleft(), Record)
