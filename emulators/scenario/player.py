"""Play a scenario on an emulator."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import assert_never

from tickrig.emulators.bench.fault_spec import FaultSpec
from tickrig.emulators.bench.running_emulator import RunningEmulator
from tickrig.emulators.bench.transcript import Transcript
from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.scenario.scenario import (
    Clear,
    End,
    Press,
    Release,
    ScenarioStep,
    Send,
    Set,
    Watch,
)
from tickrig.host.text.byte_text import escape
from tickrig.host.text.trace import Mark
from tickrig.host.text.values import format_time


class Player:
    """Carries out a scenario as the emulator's time passes.

    Args:
        emulator: the emulator; it must not have run yet.
        scenario: what to do.
        transcript: where misses are told and outputs are watched.
        stays: let the emulator run on when the scenario has no `end`.

    Attributes:
        met: how many expectations were met.
        missed: how many were not.
    """

    def __init__(
        self,
        emulator: RunningEmulator,
        scenario: Sequence[ScenarioStep],
        transcript: Transcript,
        *,
        stays: bool = False,
    ) -> None:
        self._emulator, self._transcript = emulator, transcript
        self._open: list[ScenarioStep] = []
        self.met = self.missed = 0
        emulator.log.listeners.append(self._hear)
        for step in scenario:
            emulator.event_queue.put(step, step.at_us or 0, partial(self._carry_out, step))
        if not stays and not any(isinstance(step.what, End) for step in scenario):
            end_us = max(((step.at_us or 0) + step.within_us for step in scenario), default=0)
            emulator.event_queue.put(self, end_us, self._end)

    def finish(self, now_us: int) -> None:
        """Count the expectations that are still open as missed."""
        for item in list(self._open):
            self._miss(item, now_us)
            self._emulator.event_queue.drop(item)

    def _carry_out(self, step: ScenarioStep, now_us: int) -> None:
        """Do it; what the device itself refuses counts as missed."""
        try:
            self._do(step, now_us)
        except ValueError as error:
            self.missed += 1
            self._transcript.write(now_us, "?", f"{step.place}: {error}")

    def _do(self, step: ScenarioStep, now_us: int) -> None:
        operator = self._emulator.operator
        match step.what:
            case Send(data, shown):
                self._transcript.send(now_us, data, shown)
            case Set(name, values):
                operator.set(name, *values)
            case Press(name, duration_us):
                operator.press(now_us, name, duration_us)
            case Release(name):
                operator.release(name)
            case FaultSpec() as spec:
                operator.fault(now_us, spec)
            case Clear(name):
                operator.clear(name)
            case Watch(names):
                self._transcript.watch(now_us, *names)
            case None:
                self._open.append(step)
                queue = self._emulator.event_queue
                queue.put(step, now_us + step.within_us, partial(self._miss, step))
            case End():
                self._end(now_us)
            case _ as never:
                assert_never(never)

    def _hear(self, line: WireLine) -> None:
        text = escape(line.data)
        if line.mark is Mark.FROM_DEVICE:
            for item in [item for item in self._open if item.wanted[0].matches(text)]:
                self._open.remove(item)
                self._emulator.event_queue.drop(item)
                self.met += 1

    def _miss(self, step: ScenarioStep, now_us: int) -> None:
        self._open.remove(step)
        self.missed += 1
        text, since = step.wanted[0].text, format_time(step.at_us or 0)
        within = f"within {step.within_us / 1_000:g} ms of {since}"
        self._transcript.write(now_us, "?", f"{step.place}: no line {text!r} {within}")

    def _end(self, now_us: int) -> None:
        self.finish(now_us)
        self._emulator.stop()
