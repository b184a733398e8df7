"""Play a scenario on an emulator."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import assert_never

from tickrig.emulators.bench.fault_spec import FaultSpec
from tickrig.emulators.bench.running_emulator import RunningEmulator
from tickrig.emulators.bench.transcript import Transcript
from tickrig.emulators.record.byte_text import escape
from tickrig.emulators.record.trace import Mark
from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.scenario.scenario import (
    Clear,
    End,
    Expect,
    Line,
    Press,
    Release,
    Send,
    Set,
    Watch,
)
from tickrig.host.text.values import format_time


@dataclass(frozen=True, slots=True)
class _Expectation:
    """A line that is waited for."""

    line: Line
    expect: Expect
    pattern: re.Pattern[str]


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
        scenario: Sequence[Line],
        transcript: Transcript,
        *,
        stays: bool = False,
    ) -> None:
        self._emulator, self._transcript = emulator, transcript
        self._open: list[_Expectation] = []
        self.met = self.missed = 0
        emulator.log.listeners.append(self._hear)
        for line in scenario:
            emulator.event_queue.put(line, line.at_us, partial(self._carry_out, line))
        if not stays and not any(isinstance(line.action, End) for line in scenario):
            end_us = max((_end_us(line) for line in scenario), default=0)
            emulator.event_queue.put(self, end_us, self._end)

    def finish(self, now_us: int) -> None:
        """Count the expectations that are still open as missed."""
        for item in list(self._open):
            self._miss(item, now_us)
            self._emulator.event_queue.drop(item)

    def _carry_out(self, line: Line, now_us: int) -> None:
        """Do it; what the device itself refuses counts as missed."""
        try:
            self._do(line, now_us)
        except ValueError as error:
            self.missed += 1
            self._transcript.tell(now_us, "?", f"{line.place}: {error}")

    def _do(self, line: Line, now_us: int) -> None:
        operator = self._emulator.operator
        match line.action:
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
            case Expect() as expect:
                self._expect(now_us, expect, line)
            case End():
                self._end(now_us)
            case _ as never:
                assert_never(never)

    def _expect(self, now_us: int, expect: Expect, line: Line) -> None:
        pattern = re.compile(".*".join(map(re.escape, expect.text.split("*"))))
        item = _Expectation(line, expect, pattern)
        self._open.append(item)
        self._emulator.event_queue.put(item, now_us + expect.within_us, partial(self._miss, item))

    def _hear(self, heard: WireLine) -> None:
        text = escape(heard.data)
        if heard.mark is Mark.FROM_DEVICE:
            for item in [item for item in self._open if item.pattern.fullmatch(text)]:
                self._open.remove(item)
                self._emulator.event_queue.drop(item)
                self.met += 1

    def _miss(self, item: _Expectation, now_us: int) -> None:
        self._open.remove(item)
        self.missed += 1
        expect, since = item.expect, format_time(item.line.at_us)
        within = f"within {expect.within_us / 1_000:g} ms of {since}"
        self._transcript.tell(now_us, "?", f"{item.line.place}: no line {expect.text!r} {within}")

    def _end(self, now_us: int) -> None:
        self.finish(now_us)
        self._emulator.stop()


def _end_us(line: Line) -> int:
    """Return when an action is done with."""
    waits = line.action.within_us if isinstance(line.action, Expect) else 0
    return line.at_us + waits
