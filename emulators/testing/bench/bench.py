"""The bench: devices, the hands at them, and time that passes in one place."""

from __future__ import annotations

import time
from collections.abc import Callable, Coroutine
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Self, TypeVar

from tickrig.emulators.serial.emulator import LineSettings
from tickrig.emulators.testing.bench.bench_device import BenchDevice, Duration
from tickrig.emulators.testing.bench.bench_rig import Parts
from tickrig.emulators.testing.bench.build import BenchedDevice, mounts_of, name_of
from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.emulators.testing.bench.journal import text_of
from tickrig.emulators.testing.bench.modes.mode import BenchMode
from tickrig.emulators.testing.bench.modes.virtual_mode import VirtualMode
from tickrig.emulators.testing.bench.plan_parts import parts_of
from tickrig.emulators.testing.bench.plan_rig import rig_of
from tickrig.emulators.testing.bench.tasks import Task, Wait, run_body
from tickrig.emulators.testing.bench.triggers import Condition, check_condition
from tickrig.emulators.testing.rig_file.plan import RigPlan, Tolerances
from tickrig.emulators.testing.rig_file.reader import read_rig_file
from tickrig.host.links.closing import Closing
from tickrig.host.text.names import near
from tickrig.host.text.values import Setting, us_of
from tickrig.wire.instant import NEVER

T = TypeVar("T")

if TYPE_CHECKING:
    from tickrig.device.twin.snapshot import MachineSnapshot
    from tickrig.emulators.testing.bench.modes.hardware.terminal import Terminal

VIRTUAL: Final = "virtual"
REAL: Final = "real"
HARDWARE: Final = "hardware"


class Bench(BenchDevice, Closing):
    """Devices on a bench, for a test: in virtual time, in real time, or real ones.

    Time passes in one place: links, serial objects, buses, networks, `run_for` and `wait_until`
    all step the same rig, and none steps past a button that is to be let go or a fault that is
    to come.

    Args:
        device: the only device: itself, or its type by name.
        seed: of all chance.
        line: what the serial lines are like, if the type of the device does not say it.
        mode: `virtual` time, or `real` time with hosts at ptys and buses.
        sdo_timeout: silence of an SDO client after which CANopen nodes abort a transfer; 5 s, or
            what a slave was made with, unless given.
        devices: several, by name; CANopen slaves share a bus.

    Raises:
        ValueError: no device, or a name that is no device; an SDO time-out of 0, or without a node.

    >>> from tickrig.device.rrc.machine import Rrc
    >>> with Bench(Rrc(), seed=1) as bench:
    ...     bench.run_for("1s")
    ...     bench.press("power_button", for_="100ms")
    ...     bench.wait_until(lambda: bench.get("state") == "Standby", within="2s")
    True
    """

    def __init__(
        self,
        device: BenchedDevice | None = None,
        /,
        *,
        seed: int = 0,
        line: LineSettings | None = None,
        mode: str = VIRTUAL,
        sdo_timeout: Duration | None = None,
        **devices: BenchedDevice,
    ) -> None:
        named = {**({} if device is None else {name_of(device): device}), **devices}
        if not named:
            raise ValueError("a bench has at least one device")
        sdo_timeout_us = None if sdo_timeout is None else us_of(sdo_timeout)
        parts = Parts(mounts=mounts_of(named, seed, line, sdo_timeout_us), seed=seed)
        self._start(_emulated(mode, parts, RigPlan()))

    def _start(self, mode: BenchMode) -> None:
        super().__init__(mode)
        self._tasks: list[Task[Any]] = []
        self._devices = {name: BenchDevice(mode, name) for name in mode.devices}

    @classmethod
    def of_plan(cls, plan: RigPlan, mode: str = VIRTUAL, terminal: Terminal | None = None) -> Self:
        """Return the bench of a rig file.

        Args:
            plan: what the file says.
            mode: `virtual`; `real`: where its hosts are is in the plan; or `hardware`: where its
                devices are is in the plan.
            terminal: where the operator of real devices is; standard input and output unless given.

        Raises:
            Refused: a device cannot be made.
            ValueError: an option, input, fault or mode that there is not.
            PortGone: a bus cannot be opened, or an emulator that plays a device is not there.
            OSError: no port is to be had, or no link or socket can be made.
        """
        if mode == HARDWARE:
            from tickrig.emulators.testing.bench.modes.hardware.hardware_mode import (  # noqa: PLC0415 - POSIX
                HardwareMode,
            )

            return cls.of_mode(HardwareMode(plan, terminal))
        return cls.of_mode(_emulated(mode, parts_of(plan), plan))

    @classmethod
    def of_mode(cls, mode: BenchMode) -> Self:
        """Return the bench of a mode."""
        bench = cls.__new__(cls)
        bench._start(mode)
        return bench

    def __getitem__(self, name: str) -> BenchDevice:
        """Return a device; KeyError if there is none of this name."""
        if name not in self._devices:
            raise KeyError(f"no device {name!r}; {near(name, self._devices)}")
        return self._devices[name]

    @property
    def mode(self) -> str:
        """`virtual`, `real` or `hardware`."""
        return self._mode.name

    @property
    def tolerance(self) -> Tolerances:
        """How far times, and what a hand does, may be off on this bench."""
        return self._mode.tolerance

    @property
    def devices(self) -> tuple[str, ...]:
        """The names of all devices."""
        return tuple(self._devices)

    @property
    def now_us(self) -> int:
        """The time since the bench was opened."""
        return self._mode.now_us

    def run_for(self, duration: Duration) -> None:
        """Let time pass.

        Args:
            duration: microseconds, or a text as `"100ms"`.
        """
        self._mode.run_for(us_of(duration))

    def wait_until(self, done: Callable[[], bool], within: Duration) -> bool:
        """Let time pass until something is so.

        Args:
            done: says whether it is; it only looks.
            within: for how long at most.

        Returns:
            False if the time was over first.
        """
        check_condition(done)
        return self._mode.wait_until(done, us_of(within))

    async def sleep(self, duration: Duration) -> None:
        """Wait in an async body; other tasks go on meanwhile.

        Args:
            duration: microseconds, or a text as `"100ms"`.
        """
        await Wait(_never, self.now_us + us_of(duration))

    async def until(self, done: Condition, within: Duration | None = None) -> bool:
        """Wait in an async body until something is so.

        Args:
            done: says whether it is, such as `on_line("OK:beep")`; it only looks.
            within: for how long at most; unless given for ever, in virtual time for a day.

        Returns:
            False if the time was over first.
        """
        return await Wait(done, NEVER if within is None else self.now_us + us_of(within))

    async def edge(self, name: str, within: Duration | None = None) -> Setting:
        """Wait in an async body until an input or output changes.

        Args:
            name: of the input or output.
            within: for how long at most; unless given for ever, in virtual time for a day.

        Returns:
            Its value then: the old one if the time was over first.
        """
        before = self.get(name)
        await self.until(lambda: self.get(name) != before, within)
        return self.get(name)

    def start(self, body: Coroutine[Any, Any, T]) -> Task[T]:
        """Let an async body run beside the test from now on, whoever makes time pass.

        Args:
            body: it awaits `sleep`, `until`, `edge` or a task, and makes no time pass itself.

        Returns:
            The task; `await` it, or ask it for its `result()`.

        Raises:
            NotOnThisBench: real devices; `run` runs a body alone.
        """
        try:
            task = self._mode.act(lambda rig: Task(rig, body))
        except NotOnThisBench:
            body.close()
            raise
        self._tasks.append(task)
        return task

    def check_tasks(self) -> None:
        """Raise what a task raised whose result nobody has asked for, of the first of these."""
        for task in self._tasks:
            task.check()

    def run(self, body: Coroutine[Any, Any, T]) -> T:
        """Run an async body to its end, and return what it returns.

        Args:
            body: it awaits `sleep`, `until`, `edge` or tasks that it starts.

        Raises:
            TypeError: it awaits something else, such as `asyncio.sleep`.
            RuntimeError: what it waits for never comes, or not within a day of virtual time.

        >>> from tickrig.device.rrc.machine import Rrc
        >>> async def body(bench):
        ...     await bench.sleep("1s")
        ...     bench.press("power_button")
        ...     return await bench.edge("state")
        >>> with Bench(Rrc()) as bench:
        ...     bench.run(body(bench))
        'Standby'
        """
        return run_body(self._mode, body)

    def meanwhile(self, host: Callable[[int], object]) -> None:
        """Let a host go on while a human takes his time, so that no watchdog bites.

        Args:
            host: is called again and again with microseconds, as `client.run_for`.
        """
        self._mode.meanwhile(host)

    def patched_time(self) -> AbstractContextManager[Any]:
        """Let hosts live in the time of the bench that call `time.sleep` or `time.monotonic`.

        In virtual time, from `with` to its end, `time.sleep`, `monotonic`, `time` and
        `perf_counter`, `wait` of threading's events and conditions, `get` and `put` of queues
        make the time of the bench pass, wherever the code of a host has kept them
        (docs/reference/bench/hosts.md). In real time they do so anyway.

        Returns:
            A context manager; it gives the clock, with the functions of `time`.
        """
        if isinstance(self._mode, VirtualMode):
            return self._mode.patched_time()
        return nullcontext(time)

    def transcript(self) -> str:
        """Return the latest lines and frames, and what was done: time, where, direction, text.

        10,000 are kept; a line above them says how many came before.
        """
        return text_of(self._mode.journal())

    def save_trace(self, path: Path | str) -> None:
        """Save what all devices received, sent and suffered, for `tickrig replay`.

        Of real devices it has what passed their ports and what the operator did, for
        `tickrig compare`.

        Args:
            path: the file; one that exists is replaced.

        Raises:
            OSError: the file cannot be written.
        """
        self._mode.save_trace(Path(path))

    def fork(self) -> Bench:
        """Return a twin of the bench that goes on from here by itself, in virtual time.

        It has the devices, wires, faults and pending events, but no hosts and no triggers.

        Raises:
            NotOnThisBench: not in virtual time.
        """
        return Bench.of_mode(self._mode.fork())

    def snapshot(self, *hosts: object) -> MachineSnapshot:
        """Return what puts the bench back to what it is now, as often as wanted.

        It is the same bench afterwards: who has it, or a link of it, keeps it. That costs a small
        part of a `fork`. A task, a trigger or a host that came since is not there any more.

        Args:
            hosts: what is to be put back with it: hosts, and what else a test has.

        Returns:
            The snapshot; `restore()` puts it all back.

        Raises:
            NotOnThisBench: not in virtual time.
            TypeError: something in a host cannot be put back, as a file or a thread.

        >>> from tickrig.device.rrc.machine import Rrc
        >>> with Bench(Rrc()) as bench:
        ...     bench.run_for("1s")
        ...     warm = bench.snapshot()
        ...     bench.press("power_button")
        ...     bench.run_for("1s")
        ...     print(bench.get("state"))
        ...     warm.restore()
        ...     print(bench.get("state"), bench.now_us)
        Standby
        WaitPowerOn 1000000
        """
        from tickrig.device.twin.snapshot import MachineSnapshot  # noqa: PLC0415 - seldom

        if not isinstance(self._mode, VirtualMode):
            raise NotOnThisBench("time that has passed comes back in virtual time alone")
        return MachineSnapshot(self, *hosts)

    def close(self) -> None:
        """Give everything back."""
        self._mode.close()


def open_bench(path: Path | str, *, mode: str = VIRTUAL, seed: int | None = None) -> Bench:
    """Open the bench that a rig file describes.

    Args:
        path: the rig file.
        mode: `virtual`, `real` or `hardware`.
        seed: of all chance, instead of that of the file.

    Raises:
        OSError: the file cannot be read, or a port cannot be had.
        RigFileError: all that is wrong with the file.
        Refused: a device cannot be made.
        PortGone: a bus cannot be opened.
    """
    plan = read_rig_file(Path(path))
    return Bench.of_plan(plan if seed is None else replace(plan, seed=seed), mode)


def _never() -> bool:
    return False


def _emulated(mode: str, parts: Parts, plan: RigPlan) -> BenchMode:
    """Start emulated devices in virtual or in real time."""
    if mode == VIRTUAL:
        return VirtualMode(rig_of(parts, plan))
    if mode != REAL:
        raise ValueError(f"a bench of emulated devices is virtual or real, not {mode!r}")
    from tickrig.emulators.testing.bench.modes.real.real_mode import (  # noqa: PLC0415 - POSIX
        RealMode,
    )

    return RealMode.open(parts.mounts, plan.real, lambda outside: rig_of(parts, plan, outside))
