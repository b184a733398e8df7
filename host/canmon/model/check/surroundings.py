"""The frames around findings."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from tickrig.host.canmon.model.check.rule import Finding
from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.frames.record import Record

Shown = tuple[Record, Decoded]


@dataclass(slots=True)
class _Waiting:
    """A finding, the frames that are shown with it, and how many more are wanted."""

    finding: Finding
    around: list[Shown]
    wanted: int


class Surroundings:
    """Gives findings the frames before and after them; they wait for the latter.

    Args:
        frames: how many on either side.
        rules: names of the rules whose findings want them.
    """

    def __init__(self, frames: int, rules: Iterable[str]) -> None:
        self._frames, self._rules = frames, frozenset(rules)
        self._before: deque[Shown] = deque(maxlen=frames)
        self._waiting: deque[_Waiting] = deque()

    def take(self, record: Record, decoded: Decoded, found: Sequence[Finding]) -> list[Finding]:
        """Take a frame and what was found at it; return findings that wait no longer, in order."""
        shown = record, decoded
        for one in self._waiting:
            if one.wanted:
                one.around.append(shown)
                one.wanted -= 1
        for finding in found:
            self._add(finding, shown)
        self._before.append(shown)
        return self._complete()

    def flush(self, found: Sequence[Finding] = ()) -> list[Finding]:
        """Return all that wait, and what was found where no frame came."""
        for finding in found:
            self._add(finding, None)
        for one in self._waiting:
            one.wanted = 0
        return self._complete()

    def _add(self, finding: Finding, shown: Shown | None) -> None:
        if finding.rule not in self._rules or not self._frames:
            self._waiting.append(_Waiting(finding, [], 0))
            return
        around = [*self._before, *([shown] if shown else [])]
        self._waiting.append(_Waiting(finding, around, self._frames))

    def _complete(self) -> list[Finding]:
        complete = []
        while self._waiting and not self._waiting[0].wanted:
            one = self._waiting.popleft()
            complete.append(one.finding._replace(around=tuple(one.around)))
        return complete
