"""A checker whose frames are decoded where a rule asks what they mean."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from tickrig.host.canmon.model.check.checker import Checker, Unjudged
from tickrig.host.canmon.model.check.rule import TrafficFinding
from tickrig.host.canmon.model.check.rules import NO_EDS, EdsHeartbeats, Rules
from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.traffic import BitRates

if TYPE_CHECKING:
    from tickrig.host.canmon.model.decode.decoder import Decoder


# The frames around findings.

_Shown = tuple[Record, Decoded]


@dataclass(slots=True)
class _Waiting:
    """A finding, the frames that are shown with it, and how many more are wanted."""

    finding: TrafficFinding
    around: list[_Shown]
    wanted: int


class Surroundings:
    """Gives findings the frames before and after them; they wait for the latter.

    Args:
        frames: how many on either side.
        rules: names of the rules whose findings want them.
    """

    def __init__(self, frames: int, rules: Iterable[str]) -> None:
        self._frames, self._rules = frames, frozenset(rules)
        self._before: deque[_Shown] = deque(maxlen=frames)
        self._waiting: deque[_Waiting] = deque()

    def take(
        self, record: Record, decoded: Decoded, found: Sequence[TrafficFinding]
    ) -> list[TrafficFinding]:
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

    def flush(self, found: Sequence[TrafficFinding] = ()) -> list[TrafficFinding]:
        """Return all that wait, and what was found where no frame came."""
        for finding in found:
            self._add(finding, None)
        for one in self._waiting:
            one.wanted = 0
        return self._complete()

    def _add(self, finding: TrafficFinding, shown: _Shown | None) -> None:
        if finding.rule not in self._rules or not self._frames:
            self._waiting.append(_Waiting(finding, [], 0))
            return
        around = [*self._before, *([shown] if shown else [])]
        self._waiting.append(_Waiting(finding, around, self._frames))

    def _complete(self) -> list[TrafficFinding]:
        complete = []
        while self._waiting and not self._waiting[0].wanted:
            one = self._waiting.popleft()
            complete.append(one.finding._replace(around=tuple(one.around)))
        return complete


_QUIET_US: Final = 1_000_000
"""On a bus that is silent a finding waits so long for the frames behind it, and what has not come
in time for frames that this machine has not taken yet."""


class DecodedCheck:
    """Holds frames against rules; what an expression finds has the frames around it.

    Args:
        rules: what must hold.
        rates: bit rates of the buses, for the load.
        decoder: None where no rule asks.
        around: frames that are shown before and after what such a rule finds.
        eds_heartbeats: what EDS files say of 1017h, in ms by node-ID.
    """

    def __init__(
        self,
        rules: Rules,
        rates: BitRates,
        decoder: Decoder | None,
        around: int,
        eds_heartbeats: EdsHeartbeats = NO_EDS,
    ) -> None:
        self._checker, self._decoder = Checker(rules, *rates, eds_heartbeats), decoder
        self._around = Surroundings(around, (one.name for one in rules.expressions))
        self._latest_us = 0

    def take(self, records: Sequence[Record]) -> list[TrafficFinding]:
        """Return what is wrong with frames."""
        checker, decoder = self._checker, self._decoder
        if decoder is None:
            return [finding for record in records for finding in checker.take(record)]
        found = []
        self._latest_us = records[-1].at_us if records else self._latest_us
        for record in records:
            decoded = decoder.take(record)
            found += self._around.take(record, decoded, checker.take(record, decoded))
        return found

    def wait(self, now_us: int, has_clock: bool) -> list[TrafficFinding]:
        """Return what has not come in time and what waits too long, where no frame comes.

        Args:
            now_us: the time at the source, by the clock of this machine.
            has_clock: the source keeps that clock, as a bus does and a pipe need not.
        """
        if now_us - self._latest_us <= _QUIET_US:
            return []
        # A pipe may be late by any time: there only frames tell that a deadline has passed.
        return self._around.flush(self._checker.advance(now_us - _QUIET_US) if has_clock else ())

    def end(
        self, end_us: int, lost: Iterable[str], judged_us: int, errors: Iterable[str]
    ) -> list[TrafficFinding]:
        """Return what is missing, as `Checker.end` does."""
        return self._around.flush(self._checker.end(end_us, lost, judged_us, errors))

    def unjudged(self, end_us: int, without_errors: str) -> Unjudged:
        """Return what was not judged, as `Checker.unjudged` does."""
        return self._checker.unjudged(end_us, without_errors)
