"""What a report shows of the bench of a test, taken before the bench is closed."""

from __future__ import annotations

from contextlib import suppress
from typing import Final, NamedTuple

from tickrig.emulators.testing.bench.bench import Bench
from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.emulators.testing.plugin.evidence.fault_plan import FaultPlan
from tickrig.emulators.testing.plugin.evidence.journal_text import decoded
from tickrig.emulators.testing.plugin.evidence.signal_names import names_of
from tickrig.emulators.testing.report.bench_report import (
    JournalLine,
    PlannedFault,
    SignalSeries,
)
from tickrig.emulators.testing.report.signal_sampler import SignalSampler

JOURNAL_LINES: Final = 1_000
SAMPLES: Final = 1_000
"""Of each signal."""


class BenchEvidence(NamedTuple):
    """What a report shows of a bench.

    Attributes:
        mode: of the bench.
        now_us: when it was closed.
        journal: the last that happened.
        left_out: how many lines came before these.
        faults: what was ordered, and what came.
        series: signals that changed.
        trace: what `tickrig replay` reads; empty if nothing was recorded.
    """

    mode: str
    now_us: int
    journal: tuple[JournalLine, ...]
    left_out: int
    faults: tuple[PlannedFault, ...]
    series: tuple[SignalSeries, ...] = ()
    trace: str = ""


class BenchWitness:
    """Looks at a bench from its beginning.

    Args:
        bench: the bench.
    """

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self._samplers: list[SignalSampler] = []
        self._plan = FaultPlan(bench)
        with suppress(NotOnThisBench):
            bench._mode.act(self._begin)

    def evidence(self) -> BenchEvidence:
        """Return what a report shows."""
        mode = self._bench._mode
        lines = mode.journal()
        shown = list(decoded(self._bench))[-JOURNAL_LINES:]
        evidence = BenchEvidence(
            mode.name,
            mode.now_us,
            tuple(JournalLine(line.at_us, line.source, line.mark, text) for line, text in shown),
            max(0, lines[-1].number - JOURNAL_LINES) if lines else 0,
            self._plan.faults(),
        )
        with suppress(NotOnThisBench):
            return mode.act(lambda rig: self._of_rig(rig, evidence))
        return evidence

    def _begin(self, rig: BenchRig) -> None:
        assembly = rig.state.assembly
        for device, part in assembly.parts.items():
            sampler = SignalSampler(part, names_of(part), assembly.full_name(device, ""), SAMPLES)
            sampler.take(rig.rig.now_us)
            rig.rig.watchers.append(sampler.take)
            self._samplers.append(sampler)

    def _of_rig(self, rig: BenchRig, evidence: BenchEvidence) -> BenchEvidence:
        for sampler in self._samplers:  # what changed since the last step too
            sampler.take(rig.rig.now_us)
        recorder = rig.state.recorder
        trace = recorder.lines(rig.rig.now_us) if recorder and recorder.keeps else ()
        series = [series for sampler in self._samplers for series in sampler.series()]
        return evidence._replace(
            series=tuple(one for one in series if len({value for _, value in one.points}) > 1),
            trace="".join(f"{line}\n" for line in trace),
        )
