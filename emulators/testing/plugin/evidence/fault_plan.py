"""Which faults a test ordered, and what came of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from tickrig.emulators.bench.fault_order import FaultOrder
from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.testing.bench.bench import HARDWARE, Bench
from tickrig.emulators.testing.plugin.evidence.signal_names import fault_names
from tickrig.emulators.testing.report.bench_report import PlannedFault
from tickrig.host.text.page_text import seconds
from tickrig.host.text.trace import Mark


@dataclass(slots=True)
class _Effect:
    """A fault that came: its names, its rate, when it began and ended."""

    names: tuple[str, str]
    rate: str
    from_us: int
    to_us: int | None = None


class FaultPlan:
    """Notes the faults of a bench as they come, from its beginning.

    Args:
        bench: the bench.
    """

    def __init__(self, bench: Bench) -> None:
        self._mode = bench._mode
        wire_faults, faults = fault_names(bench)
        self._known = wire_faults | faults
        self._present: dict[str, _Effect] = {}
        self._effects: list[_Effect] = []
        for line in self._mode.journal():
            self._hear(line)
        self._mode.hear(self._hear)

    def faults(self) -> tuple[PlannedFault, ...]:
        """Return what was ordered and what came, in the order in which that began."""
        left, outcomes = list(self._effects), list[PlannedFault]()
        for order in reversed(self._mode.orders):  # of two for one time the last one holds
            outcomes.insert(0, self._outcome_of(order, self._take(order, left)))
        outcomes += [PlannedFault(self._name(one), one.from_us, one.to_us) for one in left]
        return tuple(sorted(outcomes, key=_begun_us))

    def _hear(self, line: WireLine) -> None:
        if line.mark is not Mark.PHYSICAL:
            return
        name, _, value = line.data.decode("ascii", "replace").partition("=")
        full = f"{line.source}/{name}"
        if not {name, full} & self._known:
            return
        if (before := self._present.pop(full, None)) is not None:
            before.to_us = line.at_us
        if value != "0":
            rate = "" if value in ("", "1") else f"={value}"
            effect = self._present[full] = _Effect((name, full), rate, line.at_us)
            self._effects.append(effect)

    def _take(self, order: FaultOrder, left: list[_Effect]) -> _Effect | None:
        """Return what came of an order, and take it away; None if nothing did."""
        for effect in left:
            if order.spec.name in effect.names and self._is_due(order, effect.from_us):
                left.remove(effect)
                return effect
        return None

    def _is_due(self, order: FaultOrder, at_us: int) -> bool:
        if order.due_us is None:
            return False
        return at_us == order.due_us or (self._by_hand and at_us >= order.ordered_us)

    @property
    def _by_hand(self) -> bool:
        """Whether an operator makes faults, who is never there to the microsecond."""
        return self._mode.name == HARDWARE

    def _outcome_of(self, order: FaultOrder, effect: _Effect | None) -> PlannedFault:
        if effect is None:
            rate = "" if order.spec.rate is None else f"={order.spec.rate:g}"
            when = order.when or f"{seconds(order.spec.from_us)} s"
            return PlannedFault(order.spec.name + rate, None, None, when, order.ordered_us)
        from_us, to_us = max(effect.from_us, order.spec.from_us), effect.to_us
        if to_us is None and order.to_us <= self._mode.now_us:  # by an operator
            to_us = order.to_us
        return PlannedFault(self._name(effect), from_us, to_us, order.when, order.ordered_us)

    def _name(self, effect: _Effect) -> str:
        return effect.names[len(self._mode.devices) > 1] + effect.rate


def _begun_us(fault: PlannedFault) -> int:
    times: Iterator[int | None] = iter((fault.ordered_us, fault.from_us, 0))
    return next(at_us for at_us in times if at_us is not None)
