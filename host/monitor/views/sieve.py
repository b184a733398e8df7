"""The rows of a trace that a filter passes: all of them, and the latest of each identifier."""

from __future__ import annotations

from typing import NamedTuple

from tickrig.host.monitor.decode.filter.filter import Filter
from tickrig.host.monitor.views.trace import Key, Ring, Trace, TraceRow, key_of


class Latest(NamedTuple):
    """One identifier of one bus.

    Attributes:
        row: its latest frame that passed.
        frames: how many passed.
    """

    row: TraceRow
    frames: int


class Sieve:
    """Follows a trace.

    Args:
        trace: where rows come from; those that it keeps already are taken.
        wanted: which rows pass; None for all.

    Attributes:
        passed: rows that passed; the trace itself if all do.
    """

    def __init__(self, trace: Trace, wanted: Filter | None = None) -> None:
        self._trace, self.wanted = trace, wanted
        self.passed: Ring = trace if wanted is None else Ring()
        self._latest: dict[Key, Latest] = {}
        self._seen = 0
        self.follow()

    def follow(self) -> None:
        """Take the rows that the trace has got since."""
        wanted = self.wanted
        for row in self._trace.rows(self._seen, self._trace.count - self._seen):
            decoded = row.decoded
            if wanted is not None:
                if decoded is None or not wanted.matches(row.heard, decoded):
                    continue
                self.passed.append(row)
            key = key_of(row.heard)
            before = self._latest.get(key)
            self._latest[key] = Latest(row, 1 if before is None else before.frames + 1)
        self._seen = self._trace.count

    def latest(self) -> list[Latest]:
        """Return the latest row of each identifier, by bus and identifier."""
        return [self._latest[key] for key in sorted(self._latest)]

    def clear(self) -> None:
        """Begin anew, the trace too."""
        self._trace.clear()
        self.passed.clear()
        self._latest.clear()
        self._seen = 0
