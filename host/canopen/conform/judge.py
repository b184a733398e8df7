"""Judges one check: plays its steps, and says what came of them."""

from __future__ import annotations

from tickrig.host.canopen.conform.bus.exchange import Exchange
from tickrig.host.canopen.conform.bus.step_failed import Disturbed, NotAllowed, StepFailed
from tickrig.host.canopen.conform.bus.steps import Player
from tickrig.host.canopen.conform.notation.bound_check import BoundCheck
from tickrig.host.canopen.conform.verdict import Outcome, Verdict


class Judge:
    """Plays checks on a node that is in the state in which each begins.

    Args:
        exchange: the bus.
        player: plays steps on it.
    """

    def __init__(self, exchange: Exchange, player: Player) -> None:
        self._exchange, self._player = exchange, player

    def judge(self, bound: BoundCheck) -> Outcome:
        """Play a check once."""
        self._exchange.begin(bound.can_ids)
        start_us = self._exchange.now_us
        verdict, reason = self._play(bound)
        begun_us = self._exchange.start_us
        lines = self._exchange.evidence.lines()
        return Outcome(
            verdict, reason, lines, start_us - begun_us, self._exchange.now_us - begun_us
        )

    def _play(self, bound: BoundCheck) -> tuple[Verdict, str]:
        number = 0
        try:
            for step in bound.steps:
                number += 1
                self._player.play(step)
        except NotAllowed as error:
            return Verdict.NOT_APPLICABLE, str(error)
        except Disturbed as error:
            return Verdict.INCONCLUSIVE, str(error)
        except StepFailed as error:
            return self._failed(bound, f"step {number}: {error}")
        return Verdict.PASS, ""

    def _failed(self, bound: BoundCheck, reason: str) -> tuple[Verdict, str]:
        if self._exchange.disturbances:
            return Verdict.INCONCLUSIVE, f"{reason}; {', '.join(self._exchange.disturbances)}"
        if bound.check.choice:
            return Verdict.IMPLEMENTATION_DEFINED, f"{bound.check.choice}; {reason}"
        return Verdict.FAIL, reason
