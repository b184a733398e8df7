"""A checker whose frames are decoded where a rule asks what they mean."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Final

from tickrig.host.canmon.model.check.checker import Checker, Unjudged
from tickrig.host.canmon.model.check.rule import Finding
from tickrig.host.canmon.model.check.rules import NO_EDS, EdsHeartbeats, Rules
from tickrig.host.canmon.model.check.surroundings import Surroundings
from tickrig.host.canmon.model.frames.record import Record
from tickrig.host.canmon.model.traffic.bit_rates import BitRates

if TYPE_CHECKING:
    from tickrig.host.canmon.model.decode.decoder import Decoder

QUIET_US: Final = 1_000_000
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

    def take(self, records: Sequence[Record]) -> list[Finding]:
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

    def wait(self, now_us: int, has_clock: bool) -> list[Finding]:
        """Return what has not come in time and what waits too long, where no frame comes.

        Args:
            now_us: the time at the source, by the clock of this machine.
            has_clock: the source keeps that clock, as a bus does and a pipe need not.
        """
        if now_us - self._latest_us <= QUIET_US:
            return []
        return self._around.flush(self._checker.advance(now_us - QUIET_US) if has_clock else ())

    def end(
        self, end_us: int, lost: Iterable[str], judged_us: int, errors: Iterable[str]
    ) -> list[Finding]:
        """Return what is missing, as `Checker.end` does."""
        return self._around.flush(self._checker.end(end_us, lost, judged_us, errors))

    def unjudged(self, end_us: int, without_errors: str) -> Unjudged:
        """Return what was not judged, as `Checker.unjudged` does."""
        return self._checker.unjudged(end_us, without_errors)
