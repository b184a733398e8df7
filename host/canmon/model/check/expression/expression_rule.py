"""A rule that was written as an expression, held against decoded frames one by one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

from tickrig.host.canmon.model.check.expression.demand import Demand
from tickrig.host.canmon.model.check.expression.scope import Scope
from tickrig.host.canmon.model.check.expression.slice_parser import Slice, with_slices
from tickrig.host.canmon.model.check.rule import ONE_TIME, CheckedTraffic, Finding
from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.decode.filter_terms import KINDS, MissingSignals, signal_place
from tickrig.host.canmon.model.frames.record import Record
from tickrig.host.text.names import closest

MOST_NAMES: Final = 1_000
"""So many names of signals are kept, to tell what a misspelt one may mean."""


UNMAPPED: Final = "unmapped"
NO_MAPPING: Final = "; PDOs came that nobody mapped: name them by --eds"


class ExpressionRule:
    """One rule, for one node where it was written for several.

    A signal that it names must come: a name may be misspelt, and a rule that judges nothing
    does not hold.

    Args:
        name: as findings and reports have it.
        demand: what must hold.
        scopes: when; always where there are none.
        paths: the signals that it names.
        slices: those of them that are bits of frames.
        mapped: it speaks of what PDOs carry, or of PDOs by their numbers.
    """

    def __init__(  # noqa: PLR0913 - what a rule is made of
        self,
        name: str,
        demand: Demand,
        scopes: Sequence[Scope],
        paths: Iterable[str],
        slices: Sequence[Slice],
        *,
        mapped: bool,
    ) -> None:
        self.name, self._demand, self._scopes = name, demand, tuple(scopes)
        self._slices = tuple(slices)
        self._missing = MissingSignals(paths)
        self._mapped, self._unmapped = mapped, False
        self._looks, self._names = mapped or bool(self._missing), set[str]()
        self._running, self._began, self._found, self._forced = False, False, False, False

    @property
    def due_us(self) -> int:
        """Until when `advance` has nothing to say."""
        return self._demand.due_us

    def take(self, record: Record, decoded: Decoded) -> Finding | None:
        """Return how a frame breaks it."""
        if self._slices:
            decoded = with_slices(record, decoded, self._slices)
        if self._looks:
            self._look(decoded)
        # without a scope nothing is asked once it runs: a third of the time of a rule
        if (self._scopes or not self._running) and not self._in_force(record, decoded):
            return None
        text = self._demand.judge(record, decoded)
        if not text:
            return None
        self._found = True
        return Finding(record.at_us, self.name, text, record)

    def advance(self, now_us: int) -> list[Finding]:
        """Return what had not come in time before a frame of this time; listening goes on."""
        if now_us <= self.due_us:
            return []
        self._found = True
        return [
            Finding(fault.at_us, self.name, fault.text, fault.record)
            for fault in self._demand.expire()
        ]

    def end(self, end_us: int) -> list[Finding]:
        """Return what is missing at a time; nothing is changed by it."""
        texts = list(self._demand.end(end_us, self._running or not self._began))
        if not (texts or self._found):
            texts = [f"no signal {path} came{self._near(path)}" for path in self._missing.paths]
        hint = "" if self._demand.came or not self._unmapped else NO_MAPPING
        return [Finding(end_us, self.name, text + hint) for text in texts]

    def unjudged(self, evidence: CheckedTraffic) -> str:
        """Say why it has judged nothing; empty if it has."""
        if not self._forced:
            return f"it was never in force: {' '.join(scope.text for scope in self._scopes)}"
        if self._demand.timed and evidence.untimed:
            return ONE_TIME
        if self._demand.judged:
            return ""
        hint = "" if self._demand.came or not self._unmapped else NO_MAPPING
        return self._demand.doubt + hint

    def _in_force(self, record: Record, decoded: Decoded) -> bool:
        self._began = True
        held = [scope.holds(record, decoded) for scope in self._scopes]  # each must see it
        running = all(held)
        if running != self._running:
            self._running = running
            if running:
                self._forced = True
                self._demand.begin(record.at_us)
            else:
                self._demand.pause()
        return running

    def _look(self, decoded: Decoded) -> None:
        """See which signals come, until all have, and whether PDOs come that nobody mapped."""
        if self._mapped and decoded.kind == UNMAPPED:
            self._unmapped = True
        self._missing.take(decoded)
        self._looks = bool(self._missing) or (self._mapped and not self._unmapped)
        if len(self._names) < MOST_NAMES:
            self._names.update(signal.name for signal in decoded.signals)

    def _near(self, path: str) -> str:
        _, name, _ = signal_place(path)
        near = closest(name, [*KINDS, *sorted(self._names)])
        return f"; did you mean {near[0]}?" if near and near[0] != name else ""
