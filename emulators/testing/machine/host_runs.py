"""Runs of a host, each from the same snapshot of its bench."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from contextlib import AbstractContextManager, ExitStack, nullcontext
from typing import Any, Final, Self

from tickrig.emulators.testing.bench.bench import Bench
from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.emulators.testing.machine.bench_machine import BenchMachine
from tickrig.emulators.testing.machine.step import CALL, HostStep
from tickrig.emulators.testing.machine.world import World
from tickrig.host.text.names import near
from tickrig.host.text.values import us_of
from tickrig.wire.instant import NEVER

LAST_LINES: Final = 12


class HostHangsError(AssertionError):
    """A host does not come back: a call, or a whole run, takes longer than the machine says."""


class HostRuns:
    """Runs of one machine; a `with` block, in which the bench is open.

    Args:
        kind: the machine.

    Raises:
        ValueError: a fault or input of it is not on its bench.
        NotOnThisBench: its bench is not in virtual time.
    """

    def __init__(self, kind: type[BenchMachine]) -> None:
        if not isinstance(kind, type):
            raise TypeError(f"give the class {type(kind).__name__}, not an object of it")
        self.machine, self._stack = kind(), ExitStack()
        self.done: list[HostStep] = []
        self._broken: Exception | None = None
        self._end_us = self._back_us = NEVER
        self._invariants = kind.invariants()

    def __enter__(self) -> Self:
        """Open the bench, warm it up, and keep what it is then."""
        try:
            self._open()
        except BaseException:
            self._stack.close()
            raise
        return self

    def _open(self) -> None:
        machine = self.machine
        made = machine.make_bench()
        if not isinstance(made, Bench):
            raise TypeError(f"{type(machine).__name__}.make_bench returned {made!r:.60}, no Bench")
        machine.bench = bench = self._stack.enter_context(made)
        if bench.mode != "virtual":
            raise NotOnThisBench(f"a search is in virtual time, not {bench.mode}")
        machine.world = World(bench, machine.faults, machine.inputs)
        with self._time():
            machine.warm_up()
        machine.world.begin()
        bench._mode.act(BenchRig.drop_unheard)
        self._snapshot = bench.snapshot(machine)

    def _time(self) -> AbstractContextManager[object]:
        """Return what hosts live in meanwhile; it takes 0.1 ms, and nobody else should be in it."""
        return self.machine.bench.patched_time() if self.machine.patched else nullcontext()

    def __exit__(self, *exception: object) -> None:
        """Close the bench."""
        self._stack.close()

    def run(self, steps: Sequence[HostStep]) -> None:
        """Do the steps from the snapshot on; raise what the host does wrong.

        Raises:
            HostHangsError: the host waits for ever.
            Exception: what the machine, or the host in it, raised.
        """
        self._snapshot.restore()
        self.done, self._broken = list(steps), None
        self._end_us = self.machine.bench.now_us + us_of(self.machine.longest)
        self.machine.bench._mode.act(lambda rig: rig.rig.watchers.append(self._watch))
        with self._time():
            self._run_all(steps)

    def _run_all(self, steps: Sequence[HostStep]) -> None:
        try:
            self._judged(self.machine.connect)
            for step in steps:
                self._do(step)
            self._judged(self._settle)
            self._judged(self.machine.end)
        finally:
            self.machine.disconnect()

    def _settle(self) -> None:
        """Let the devices act on what was asked last: a run is judged after that."""
        bench = self.machine.bench
        bench.run_for(bench._mode.act(lambda rig: rig.settling_us))

    def _do(self, step: HostStep) -> None:
        self._judged(step.do, self.machine.bench)
        if step.verb == CALL:
            self._judged(self._rule(step), **step.arguments)
        self._check()

    def _rule(self, step: HostStep) -> Any:
        rules = self.machine.rules()
        if step.what not in rules:
            raise ValueError(f"no rule {step.what!r}; {near(step.what, rules)}")
        method = getattr(self.machine, step.what)
        wanted = list(inspect.signature(method).parameters)
        if set(step.arguments) - set(wanted):
            raise ValueError(f"{step.what} takes ({', '.join(wanted)}), got {step}")
        return method

    def _judged(self, act: Any, *args: Any, **arguments: Any) -> None:
        """Do something of the host; raise what was broken meanwhile, if a host has swallowed it.

        One that waits for ever is told so wherever it waits: a search shortens one mistake then.
        """
        self._back_us = self.machine.bench.now_us + us_of(self.machine.patience)
        hangs = ""
        try:
            act(*args, **arguments)
        except Exception:
            if not (hangs := self._hangs(self.machine.bench.now_us)):
                raise
        finally:
            self._back_us = NEVER
        if hangs or isinstance(self._broken, HostHangsError):
            raise HostHangsError(hangs or str(self._broken))
        if self._broken is not None:
            raise self._broken

    def _hangs(self, now_us: int) -> str:
        """Say how the host does not come back, if it does not."""
        if now_us > self._back_us:
            return f"the host does not come back within {self.machine.patience}"
        if now_us > self._end_us:
            return f"the run does not end within {self.machine.longest}"
        return ""

    def _watch(self, now_us: int) -> None:
        """Look after each step of the rig; the first that is broken counts."""
        if hangs := self._hangs(now_us):
            self._broken = HostHangsError(hangs)
            raise self._broken
        if self._broken is None:
            try:
                self._check()
            except Exception as error:  # raised where the test is, not amid the rig
                self._broken = error

    def _check(self) -> None:
        for name in self._invariants:
            getattr(self.machine, name)()

    def last_lines(self) -> str:
        """Return what passed last, and what was done."""
        return "\n".join(self.machine.bench.transcript().splitlines()[-LAST_LINES:])
