"""Data of a test's bench for a report, taken before the bench is closed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Final, NamedTuple

from tickrig.device.physical import OutputSignal
from tickrig.emulators.bench.operator import FaultOrder
from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.rig.emulated import HasSignals, read_signal
from tickrig.emulators.testing.bench.bench import HARDWARE, Bench
from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.emulators.testing.plugin.journal_text import decoded, fault_names, names_of
from tickrig.emulators.testing.report import bench_report
from tickrig.host.text.page_text import seconds
from tickrig.host.text.trace import Mark

# Keep what signals of a device were while a test ran.

_MOST: Final = 4_000
"""Number of samples kept of a signal. If there are more samples, all spikes are kept, but not all
samples."""


class SignalSampler:
    """Records how signals of a device change over time, for curves and reports.

    Only changes take memory.

    Args:
        device: the device with the signals.
        names: names of inputs and outputs. An unknown name raises ValueError.
        prefix: text before each name in the series, such as `left_drive/`.
        most: number of samples kept of each signal, at least 4.
    """

    def __init__(
        self, device: HasSignals, names: Iterable[str], prefix: str = "", most: int = _MOST
    ) -> None:
        self._device, self._prefix, self._most = device, prefix, most
        self._points: dict[str, list[bench_report.Point]] = {name: [] for name in names}
        self._latest: dict[str, bench_report.Point] = {}
        for name in self._points:
            self._find(name)

    def take(self, now_us: int) -> None:
        """Record the present values of the signals.

        The rig calls this method after each step, as one of its `watchers`. It is also called at
        the end.

        Args:
            now_us: present time in microseconds, which is not earlier than in the last call.
        """
        for name, points in self._points.items():
            value = read_signal(self._device, name)
            before = self._latest.get(name)
            if before is None or before[1] != value:
                if before is not None and isinstance(value, float) and points[-1] != before:
                    points.append(before)  # a line goes on from here, not from the last change
                points.append((now_us, value))
                if len(points) > 2 * self._most:
                    points[:] = bench_report.thinned(points, self._most)
            self._latest[name] = now_us, value

    def series(self) -> tuple[bench_report.SignalSeries, ...]:
        """Return the recorded signals: fractional numbers as lines, others as steps."""
        return tuple(self._series_of(name, points) for name, points in self._points.items())

    def _series_of(self, name: str, points: list[bench_report.Point]) -> bench_report.SignalSeries:
        kept = list(points)
        if kept and kept[-1] != self._latest[name]:
            kept.append(self._latest[name])
        kept = bench_report.thinned(kept, self._most)
        steps = not any(isinstance(value, float) for _, value in kept)
        return bench_report.SignalSeries(self._prefix + name, self._find(name), tuple(kept), steps)

    def _find(self, name: str) -> str:
        """Return the unit of a signal."""
        output: OutputSignal | None = self._device.outputs.get(name)
        return (output or self._device.inputs.find(name)).unit


# Which faults a test ordered, and what came of them.


@dataclass(slots=True)
class _Effect:
    """A fault that occurred, with its names, its rate, its beginning and its end."""

    names: tuple[str, str]
    rate: str
    from_us: int
    to_us: int | None = None


class _OrderedFaults:
    """Records the faults of a bench when they occur, from the beginning.

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

    def faults(self) -> tuple[bench_report.PlannedFault, ...]:
        """Return the requested faults and the faults that occurred, in order of their start."""
        left, outcomes = list(self._effects), list[bench_report.PlannedFault]()
        for order in reversed(self._mode.orders):  # of two for one time the last one holds
            outcomes.insert(0, self._outcome_of(order, self._take(order, left)))
        outcomes += [
            bench_report.PlannedFault(self._name(one), one.from_us, one.to_us) for one in left
        ]
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
        """Remove and return the effect of a request, or None if the fault has not occurred."""
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
        """Whether an operator makes faults, whose times are not exact."""
        return self._mode.name == HARDWARE

    def _outcome_of(self, order: FaultOrder, effect: _Effect | None) -> bench_report.PlannedFault:
        if effect is None:
            when = order.when or f"{seconds(order.spec.from_us)} s"
            return bench_report.PlannedFault(order.spec.text, None, None, when, order.ordered_us)
        from_us, to_us = max(effect.from_us, order.spec.from_us), effect.to_us
        if to_us is None and order.to_us <= self._mode.now_us:  # by an operator
            to_us = order.to_us
        return bench_report.PlannedFault(
            self._name(effect), from_us, to_us, order.when, order.ordered_us
        )

    def _name(self, effect: _Effect) -> str:
        return effect.names[len(self._mode.devices) > 1] + effect.rate


def _begun_us(fault: bench_report.PlannedFault) -> int:
    times: Iterator[int | None] = iter((fault.ordered_us, fault.from_us, 0))
    return next(at_us for at_us in times if at_us is not None)


_JOURNAL_LINES: Final = 1_000
_SAMPLES: Final = 1_000
"""Largest number of samples of each signal."""


class BenchEvidence(NamedTuple):
    """What a report shows about the bench of a test.

    Attributes:
        mode: mode of the bench: `virtual`, `real` or `hardware`.
        now_us: time of the bench when it was closed, in microseconds.
        journal: last events on the bench.
        left_out: number of earlier lines that are not in `journal`.
        faults: requested faults, and faults that occurred.
        series: values of the signals that changed.
        trace: recording of the bench for `tickrig replay`, or empty if nothing was recorded.
    """

    mode: str
    now_us: int
    journal: tuple[bench_report.JournalLine, ...]
    left_out: int
    faults: tuple[bench_report.PlannedFault, ...]
    series: tuple[bench_report.SignalSeries, ...] = ()
    trace: str = ""


class BenchWitness:
    """Collects what a report shows about a bench, while a test uses the bench.

    Args:
        bench: the bench.
    """

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self._samplers: list[SignalSampler] = []
        self._plan = _OrderedFaults(bench)
        with suppress(NotOnThisBench):
            bench._mode.act(self._begin)

    def evidence(self) -> BenchEvidence:
        """Return the data for a report."""
        mode = self._bench._mode
        lines = mode.journal()
        shown = list(decoded(self._bench))[-_JOURNAL_LINES:]
        evidence = BenchEvidence(
            mode.name,
            mode.now_us,
            tuple(
                bench_report.JournalLine(line.at_us, line.source, line.mark, text)
                for line, text in shown
            ),
            max(0, lines[-1].number - _JOURNAL_LINES) if lines else 0,
            self._plan.faults(),
        )
        with suppress(NotOnThisBench):
            return mode.act(lambda rig: self._of_rig(rig, evidence))
        return evidence

    def _begin(self, rig: BenchRig) -> None:
        assembly = rig.state.assembly
        for device, part in assembly.parts.items():
            sampler = SignalSampler(part, names_of(part), assembly.full_name(device, ""), _SAMPLES)
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
