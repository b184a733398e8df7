"""A run of the tester: which checks are judged, in which order, and what came of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Final

from tickrig.host.canopen.conform.bus.exchange import Exchange
from tickrig.host.canopen.conform.bus.steps import Player
from tickrig.host.canopen.conform.bus.traffic import ASSUMED_BIT_RATE, Allowance, ForeignLoad
from tickrig.host.canopen.conform.check import STIMULUS, Check, Level
from tickrig.host.canopen.conform.judge import Judge
from tickrig.host.canopen.conform.notation.bound_check import BoundCheck, bind_check
from tickrig.host.canopen.conform.notation.names import Names, Unbound
from tickrig.host.canopen.conform.notation.suite import read_suite
from tickrig.host.canopen.conform.plan import Plan
from tickrig.host.canopen.conform.verdict import Outcome, Report, Result, Verdict
from tickrig.host.links.link import StampedLink
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.nmt import NMT_COB_ID, NmtCommand

SETTLE_MS: Final = 10
"""So long after an NMT command a node is in its new state."""


class ConformRun:
    """Judges one node.

    Args:
        link: the bus; nobody else may read from this link.
        node_id: of the node, 1..127.
        plan: what was chosen.
        names: what stands for names in checks.
        features: what the node has, in the words of `needs`.
        checks: more than those that come with the package, such as those made of an EDS.
        source: the bus, as the user named it.
        on_result: called with each result when it is there.
    """

    def __init__(  # noqa: PLR0913 - a run, by keyword
        self,
        link: StampedLink,
        node_id: int,
        plan: Plan,
        *,
        names: Names,
        features: frozenset[str],
        checks: Iterable[Check] = (),
        source: str = "",
        on_result: Callable[[Result], object] = lambda result: None,
    ) -> None:
        self._node_id, self._plan, self._source = node_id, plan, source
        self._names, self._features, self._on_result = names, features, on_result
        suite = [check for group in read_suite() for check in group.checks]
        self._checks = [check for check in (*suite, *checks) if plan.chooses(check)]
        bit_rate = plan.bit_rate or ASSUMED_BIT_RATE
        self._exchange = Exchange(
            link,
            node_id,
            Allowance(bit_rate, plan.max_load),
            ForeignLoad(bit_rate),
            plan.resolution_us,
        )
        player = Player(self._exchange, node_id, plan.stimulus)
        self._judge = Judge(self._exchange, player)

    def run(self) -> Report:
        """Judge the node, and return the report; whatever happens, what was changed is restored."""
        results = []
        for check in self._checks:
            result = self._result(check)
            results.append(result)
            self._on_result(result)
        duration_us = self._exchange.now_us - self._exchange.start_us
        return Report(
            self._source, self._node_id, self._plan.level, tuple(results), duration_us=duration_us
        )

    def _result(self, check: Check) -> Result:
        missing = check.needs - self._features - {STIMULUS}
        if missing:
            return _not_applicable(check, f"the node has no {', '.join(sorted(missing))}")
        if STIMULUS in check.needs and self._plan.stimulus is None:
            return _not_applicable(check, "needs somebody at the inputs: --stimulus")
        try:
            bound = bind_check(check, self._names)
        except Unbound as error:
            return _not_applicable(check, error.reason)
        first = self._go(bound)
        if first.verdict is not Verdict.FAIL:
            return Result(check, first)
        return Result(check, self._go(bound), first)

    def _go(self, bound: BoundCheck) -> Outcome:
        """Judge a check once, from the state in which each begins."""
        if self._plan.level >= Level.COMMUNICATION:
            enter = bytes((NmtCommand.ENTER_PRE_OPERATIONAL, self._node_id))
            self._exchange.send(CanFrame(NMT_COB_ID, enter))
            self._exchange.wait(SETTLE_MS)
        return self._judge.judge(bound)


def _not_applicable(check: Check, reason: str) -> Result:
    return Result(check, Outcome(Verdict.NOT_APPLICABLE, reason))
