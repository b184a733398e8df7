"""The bench: devices, operations on them, and one common time."""

from __future__ import annotations

import time
from collections.abc import Callable, Coroutine, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Self, TypeVar, cast

from tickrig._lazy import LazyModule
from tickrig.device.twin.snapshot import MachineSnapshot
from tickrig.emulators.bench.operator import parse_fault_spec
from tickrig.emulators.serial.emulator import LineSettings
from tickrig.emulators.testing.bench import plan_parts, tasks
from tickrig.emulators.testing.bench.bench_rig import BenchDescription, Parts, text_of
from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.emulators.testing.bench.modes.mode import BenchMode
from tickrig.emulators.testing.bench.modes.virtual_mode import VirtualMode
from tickrig.emulators.testing.rig_file.plan import RigPlan, Tolerances
from tickrig.host.links.link import Closing
from tickrig.host.text import notebook
from tickrig.host.text.names import near
from tickrig.host.text.values import Setting, format_time, us_of
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    import can
    import canopen
    import serial

    from tickrig.emulators.record.replay import BenchRecording
    from tickrig.emulators.testing.bench.modes import hardware_mode, real_mode
    from tickrig.emulators.testing.bench.modes.operators import Terminal
    from tickrig.emulators.testing.rig_file import reader
    from tickrig.host.links.link import Link
else:  # two of them are for POSIX
    hardware_mode = LazyModule("tickrig.emulators.testing.bench.modes.hardware_mode")
    real_mode = LazyModule("tickrig.emulators.testing.bench.modes.real_mode")
    reader = LazyModule("tickrig.emulators.testing.rig_file.reader")  # it makes nodes


class BenchTranscript(str):
    """The events of a bench as text, which Jupyter shows line by line."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        return notebook.listing(self.splitlines())


# What a test does to one device of a bench, and where its host connects.

Duration = int | str
"""Microseconds, or a text such as `"100ms"`."""

LIMIT: Final = "3600s"
"""How long hosts may wait in virtual time until the test advances the time itself."""

_NO_LIMIT: Final = "none"

PRESS: Final = "100ms"
SOON: Final = "100ms"


class BenchDevice:
    """A device of a bench, as tests use it: its inputs, outputs, faults and host connections.

    `describe` lists the names of inputs, outputs, buttons and faults.

    Args:
        mode: the mode of the bench.
        name: name of the device. If the name is empty, the object stands for all devices, and the
            names of signals are `NAME/signal`.

    Attributes:
        name: name of the device.
    """

    def __init__(self, mode: BenchMode, name: str = "") -> None:
        self._mode, self.name = mode, name

    def describe(self) -> BenchDescription:
        """Return all inputs, outputs and faults; `print` shows them as a readable list.

        >>> from tickrig import Bench
        >>> with Bench("rrc") as bench:
        ...     about = bench.describe()
        >>> about.inputs["gauge"].unit, about.outputs["state"].text, about.faults["flip"].rated
        ('', 'state of the RRC', True)
        """
        return self._mode.describe(self.name)

    def _repr_html_(self) -> str:
        """Return a table of the signals with their values, and of the faults, for Jupyter."""
        return notebook.heading(self.name, self._mode.wire_of(self.name)) + self._signals_html()

    def _signals_html(self) -> str:
        described, values = self.describe(), dict[str, object]()
        if self._mode.name != HARDWARE:  # there a human would be asked for each
            values = {name: self.get(name) for name in described.named}
        return described.tables(values)

    def set(self, name: str, *values: Setting | Sequence[Setting]) -> None:
        """Set an input of the device, or all inputs of a group.

        Args:
            name: name of the input or group, such as `stick`.
            values: one value for an input, or one value for each input of a group. A list of values
                is accepted, too.

        Raises:
            ValueError: the input is unknown, or does not accept the values.
            NotOnThisBench: the bench cannot set the input.
        """
        each = values[0] if len(values) == 1 and isinstance(values[0], list | tuple) else values
        self._mode.request("set", name=self._full(name), value=list(each))

    def get(self, name: str) -> Setting:
        """Return the present value of an input or output of the device.

        Args:
            name: name of the input or output, such as `state`.

        Raises:
            ValueError: the name is unknown.
        """
        full = self._full(name)
        values = self._mode.request("get", names=[full])["values"]
        assert isinstance(values, dict)
        value: Setting = values[full]
        return value

    def press(self, name: str, for_: Duration = PRESS) -> None:
        """Press a button of the device, and release it after a duration.

        Args:
            name: name of the button.
            for_: duration of the press in bench time, from the tick in which the device sees the
                button pressed.
        """
        self._mode.request("press", name=self._full(name), duration_us=us_of(for_))

    def fault(
        self, spec: str, *, when: tasks.Condition | None = None, for_: Duration | None = None
    ) -> None:
        """Start a fault of the device or its wire: now, at a time, or when a condition is true.

        Args:
            spec: name and arguments of the fault, such as `cut`, `cut@2s-3s`, `cut@+1s-+2s` with
                times from now, or `flip=0.001`.
            when: condition that starts the fault, such as `on_line("OK:output", nth=3)`. With a
                condition, `spec` must not have a time.
            for_: duration of the fault. By default the fault lasts until it is cleared.

        Raises:
            ValueError: the fault is unknown, or its arguments are invalid.
            NotOnThisBench: the bench cannot make the fault.
        """
        check = partial(self._mode.check_fault, self.name)
        wanted = parse_fault_spec(spec, check, self._mode.now_us)
        for_us = None if for_ is None else us_of(for_)
        if when is not None:
            tasks.check_condition(when)
            if "@" in spec:
                raise ValueError(f"{spec}: it waits for something, so it has no time; see for_")
        self._mode.fault(self.name, wanted, when, for_us)

    def clear(self, name: str) -> None:
        """End a fault, or cancel a scheduled fault.

        Args:
            name: name of the fault.

        Raises:
            ValueError: the fault is unknown.
        """
        self._mode.clear(self.name, name)

    def switch_off(self) -> None:
        """Switch off the supply of the device, or of all devices of the bench.

        Raises:
            NotOnThisBench: the bench cannot switch the supply.
        """
        self._mode.switch_power(self.name, on=False)

    def switch_on(self) -> None:
        """Switch the supply on again.

        Raises:
            NotOnThisBench: the bench cannot switch the supply.
        """
        self._mode.switch_power(self.name, on=True)

    def perform(self, text: str, do: Callable[[], object]) -> None:
        """Run an action of several steps on an emulated device, or ask a human operator to do it.

        Args:
            text: description of the action for a human operator, such as `switch VR2 off, unless it
                is off`.
            do: function that executes the action with an emulator. If a human executes the action,
                `do` is not called.

        Raises:
            OperatorRefused: the human did not execute the action.
            NotOnThisBench: the bench cannot run the action.
        """
        self._mode.perform(self.name, text, do)

    def observe(self, text: str, seen: tasks.Condition, within: Duration = SOON) -> bool:
        """Return whether something is observed on the device.

        For an emulator a function decides. For a real device a human operator answers yes or no.

        Args:
            text: description of the observation, such as `the motors drive forward at 30 %`.
            seen: function that returns whether the observation is true for an emulator.
            within: longest wait, to which the tolerance of the bench is added.
        """
        return self._mode.observe(self.name, text, seen, us_of(within))

    def on_line(self, pattern: str, nth: int = 1) -> tasks.LineTrigger:
        """Return a condition that becomes true when a line or CAN frame has passed on the wire.

        Such a condition can start a fault or end a wait.

        Args:
            pattern: the whole line without its end, such as `OK:output`, or the whole frame, such
                as `701#05`. A `*` in the pattern matches anything.
            nth: number of the occurrence, counted from this call. The first occurrence has the
                number 1.
        """
        source = self._mode.wire_of(self.name) if self.name else ""
        trigger = tasks.LineTrigger(pattern, nth, source)
        self._mode.hear(trigger.hear)
        return trigger

    @property
    def link(self) -> Link[Any]:
        """New connection for a host on the device's wire.

        The link carries bytes on a serial line, or frames on a CAN bus.
        """
        return self._mode.doors.link(self._wire())

    def serial(self, **options: Any) -> serial.Serial:
        """Open the device's serial line for a host, as a pyserial port.

        Args:
            options: options of `serial.Serial`. The `timeout` counts in the time of the bench.
        """
        return cast("serial.Serial", self._mode.doors.serial(self._wire(), options))

    @property
    def url(self) -> str:
        """URL of the device's serial line, for a host program that opens the line itself.

        `serial.serial_for_url` opens the URL while the bench is open: `tickrig://rrc`,
        `/dev/pts/7`, `COM3`.
        """
        address = self._mode.doors.address(self._wire())
        if not isinstance(address, str):
            raise ValueError(f"{self._wire()} is a CAN bus, which has no URL: see bus_options")
        return address

    @property
    def bus_options(self) -> dict[str, Any]:
        """Options for a program that opens the CAN bus itself: `can.Bus(**bench.bus_options)`."""
        address = self._mode.doors.address(self._wire())
        if isinstance(address, str):
            raise ValueError(f"{self._wire()} is a serial line, which has no bus: see url")
        return dict(address)

    def can_bus(self, **options: Any) -> can.BusABC:
        """Open the CAN bus as a python-can bus.

        Args:
            options: options of `can.Bus`.
        """
        return self._mode.doors.can_bus(self._wire(), options)

    def canopen_network(self) -> canopen.Network:
        """Connect the canopen library to the CAN bus as a master."""
        return self._mode.doors.canopen_network(self._wire())

    def _wire(self) -> str:
        """Return the wire of this device, or the only wire."""
        if self.name:
            return self._mode.wire_of(self.name)
        if len(self._mode.wires) > 1:
            known = ", ".join(self._mode.devices)
            raise ValueError(f"this bench has several wires: take that of a device; known: {known}")
        return self._mode.wires[0]

    def _full(self, name: str) -> str:
        """Return the full name of a signal; for a single device the prefix is optional."""
        if len(self._mode.devices) == 1:
            return name.removeprefix(f"{self._mode.devices[0]}/")
        return f"{self.name}/{name}" if self.name else name


T = TypeVar("T")


VIRTUAL: Final = "virtual"
_REAL: Final = "real"
HARDWARE: Final = "hardware"


class Bench(BenchDevice, Closing):
    """Devices on a bench, for a test: in virtual time, in real time, or real devices.

    Links, serial objects, buses, networks, `run_for` and `wait_until` all advance the time of the
    same rig. They all stop for scheduled releases of buttons and for scheduled faults.

    Args:
        device: the only device, as an object or as the name of a device type.
        seed: seed of all random numbers.
        line: parameters of the serial lines, if they differ from those of the device type.
        mode: `virtual` for virtual time, or `real` for real time with ptys and buses for the hosts.
        sdo_timeout: time after which CANopen nodes abort a transfer if the SDO client is silent.
            The default is 5 s, or the time-out of the given slave.
        limit: longest time that hosts may wait in virtual time until the test calls `run_for` or
            `wait_until`. A host that waits longer gets an error. One wait counts as one minute at
            most. `"none"` means no limit.
        devices: several devices by name. CANopen slaves share a bus.

    Raises:
        ValueError: there is no device, or a name is unknown. The SDO time-out is 0, or there is an
            SDO time-out but no node. The limit is not a time.

    >>> from tickrig.device.rrc.machine import Rrc
    >>> with Bench(Rrc(), seed=1) as bench:
    ...     bench.run_for("1s")
    ...     bench.press("power_button", for_="100ms")
    ...     bench.wait_until(lambda: bench.get("state") == "Standby", within="2s")
    True
    """

    def __init__(  # noqa: PLR0913 - each by its name
        self,
        device: plan_parts.BenchedDevice | None = None,
        /,
        *,
        seed: int = 0,
        line: LineSettings | None = None,
        mode: str = VIRTUAL,
        sdo_timeout: Duration | None = None,
        limit: Duration = LIMIT,
        **devices: plan_parts.BenchedDevice,
    ) -> None:
        named = {**({} if device is None else {plan_parts.name_of(device): device}), **devices}
        if not named:
            raise ValueError("a bench has at least one device")
        sdo_timeout_us = None if sdo_timeout is None else us_of(sdo_timeout)
        parts = Parts(mounts=plan_parts.mounts_of(named, seed, line, sdo_timeout_us), seed=seed)
        self._start(_emulated(mode, parts, RigPlan(), _limit_us_of(limit)))

    def _start(self, mode: BenchMode) -> None:
        super().__init__(mode)
        self._tasks: list[tasks.Task[Any]] = []
        self._devices = {name: BenchDevice(mode, name) for name in mode.devices}

    @classmethod
    def of_plan(
        cls,
        plan: RigPlan,
        mode: str = VIRTUAL,
        terminal: Terminal | None = None,
        limit: Duration = LIMIT,
    ) -> Self:
        """Return the bench that the content of a rig file describes.

        Args:
            plan: content of the rig file.
            mode: `virtual`, or `real` with the ports for hosts in the plan, or `hardware` with the
                ports of devices in the plan.
            terminal: terminal of the operator of real devices. The default is standard input and
                output.
            limit: longest time that hosts may wait, as in `Bench`.

        Raises:
            ValueError: a device cannot be made, or an option, an input, a fault or the mode is
                unknown.
            PortGone: a bus cannot be opened, or an emulator in place of a device is missing.
            OSError: no port is free, or a link or socket cannot be made.
        """
        if mode == HARDWARE:
            return cls.of_mode(hardware_mode.HardwareMode(plan, terminal))
        return cls.of_mode(_emulated(mode, plan_parts.parts_of(plan), plan, _limit_us_of(limit)))

    @classmethod
    def of_mode(cls, mode: BenchMode) -> Self:
        """Return the bench of a mode."""
        bench = cls.__new__(cls)
        bench._start(mode)
        return bench

    def __setitem__(self, name: str, value: object) -> None:
        """Raise TypeError: an input is set by `set`, which checks the value."""
        raise TypeError(f"an input is set by a call: bench.set({name!r}, {value!r})")

    def __getitem__(self, name: str) -> BenchDevice:
        """Return a device; raise KeyError if the name is unknown."""
        if name not in self._devices:
            raise KeyError(f"no device {name!r}; {near(name, self._devices)}")
        return self._devices[name]

    @property
    def mode(self) -> str:
        """`virtual`, `real` or `hardware`."""
        return self._mode.name

    @property
    def tolerance(self) -> Tolerances:
        """Tolerance of times and manual settings on this bench."""
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
        """Advance the time.

        Args:
            duration: duration in microseconds, or a text such as `"100ms"`.
        """
        self._mode.run_for(us_of(duration))

    def wait_until(self, done: Callable[[], bool], within: Duration) -> bool:
        """Advance the time of the bench until a condition is true.

        Args:
            done: function that returns whether the condition is true. The function must have no
                side effects.
            within: longest wait.

        Returns:
            True if the condition is true, or False after the time-out.
        """
        tasks.check_condition(done)
        return self._mode.wait_until(done, us_of(within))

    async def sleep(self, duration: Duration) -> None:
        """Wait for a duration of bench time, in an async test; other tasks run during the wait.

        Args:
            duration: duration in microseconds, or a text such as `"100ms"`.
        """
        await tasks.Wait(_never, self.now_us + us_of(duration))

    async def until(self, done: tasks.Condition, within: Duration | None = None) -> bool:
        """Wait in an async test until a condition is true.

        Args:
            done: function that returns whether the condition is true, such as `on_line("OK:beep")`.
                The function must have no side effects.
            within: longest wait. Without this argument the wait ends after one day in virtual time,
                and has no limit in real time.

        Returns:
            True if the condition is true, or False after the time-out.
        """
        return await tasks.Wait(done, NEVER if within is None else self.now_us + us_of(within))

    async def edge(self, name: str, within: Duration | None = None) -> Setting:
        """Wait in an async test until an input or output changes, and return its new value.

        Args:
            name: name of the input or output.
            within: longest wait. Without this argument the wait ends after one day in virtual time,
                and has no limit in real time.

        Returns:
            The new value, or the unchanged value after the time-out.
        """
        before = self.get(name)
        await self.until(lambda: self.get(name) != before, within)
        return self.get(name)

    def start(self, body: Coroutine[Any, Any, T]) -> tasks.Task[T]:
        """Start a coroutine that runs beside the test while the time of the bench advances.

        Args:
            body: the coroutine. It awaits `sleep`, `until`, `edge` or a task, and must not advance
                the time itself.

        Returns:
            The task. Use `await` or the method `result` of the task to get the result of the
            coroutine.

        Raises:
            NotOnThisBench: the devices are real; use `run` for a single coroutine.
        """
        try:
            task = self._mode.act(lambda rig: tasks.Task(rig, body))
        except NotOnThisBench:
            body.close()
            raise
        self._tasks.append(task)
        return task

    def check_tasks(self) -> None:
        """Raise the exception of the first task whose result was not read."""
        for task in self._tasks:
            task.check()

    def run(self, body: Coroutine[Any, Any, T]) -> T:
        """Run a coroutine on the bench to its end, and return its result.

        The time of the bench advances while the coroutine waits.

        Args:
            body: the coroutine. It awaits `sleep`, `until`, `edge`, or tasks that it starts.

        Raises:
            TypeError: the coroutine awaits an object that the bench cannot wait for, such as
                `asyncio.sleep`.
            RuntimeError: an awaited condition does not become true within a day of virtual time, or
                can never become true.
            AssertionError: the waits of the coroutine together exceed the limit of the bench.

        >>> from tickrig.device.rrc.machine import Rrc
        >>> async def body(bench):
        ...     await bench.sleep("1s")
        ...     bench.press("power_button")
        ...     return await bench.edge("state")
        >>> with Bench(Rrc()) as bench:
        ...     bench.run(body(bench))
        'Standby'
        """
        return tasks.run_body(self._mode, body)

    def meanwhile(self, host: Callable[[int], object]) -> None:
        """Keep a host running while a human answers a question of the bench.

        Without this, watchdogs that the host must serve would expire during a long answer.

        Args:
            host: function of the host that is called repeatedly with a duration in microseconds,
                such as `client.run_for`.
        """
        self._mode.meanwhile(host)

    def patched_time(self) -> AbstractContextManager[Any]:
        """Run hosts that call `time.sleep` or `time.monotonic` in the time of the bench.

        In virtual time, within the `with` block, these functions use the time of the bench:

        - `time.sleep`, `monotonic`, `time` and `perf_counter`
        - `wait` of threading's events and conditions
        - `get` and `put` of queues

        Host code may have stored such a function elsewhere, for example as an attribute of a class.
        The stored function is replaced, too (docs/reference/bench/hosts.md). In real time nothing
        changes.

        Returns:
            A context manager. Its value in a `with` statement is the clock of the bench, which has
            the functions of the module `time`.
        """
        if isinstance(self._mode, VirtualMode):
            return self._mode.patched_time()
        return nullcontext(time)

    def transcript(self) -> BenchTranscript:
        """Return the latest lines, frames and actions on the bench, with time, wire and direction.

        The latest 10,000 lines are kept. If there were more, the first line of the text has the
        number of earlier lines.

        Returns:
            The transcript as a text, which Jupyter shows line by line.
        """
        return BenchTranscript(text_of(self._mode.journal()))

    def trace(self) -> BenchRecording:
        """Return the recording of the run as an object, for example for `trace().to_pandas()`.

        `save_trace` saves the same recording in a file.

        Raises:
            OSError: no temporary file can be written.
        """
        from tempfile import TemporaryDirectory  # noqa: PLC0415 - slow

        from tickrig.emulators.record.replay import read_trace  # noqa: PLC0415 - slow

        with TemporaryDirectory(prefix="tickrig.") as folder:
            path = Path(folder) / "bench.trace"
            self.save_trace(path)
            return read_trace(path)

    def _repr_html_(self) -> str:
        mode = self._mode
        time = mode.name if mode.name == HARDWARE else f"{mode.name} time"
        devices = [(name, mode.wire_of(name)) for name in self.devices]
        return "".join(
            (
                notebook.heading("bench", time, f"{format_time(mode.now_us)} s"),
                notebook.table(("device", "wire"), devices),
                self._signals_html(),
            )
        )

    def save_trace(self, path: Path | str) -> None:
        """Save a recording of the run: traffic, inputs and faults of all devices.

        `tickrig replay` reads the file. With real devices the file has the traffic of their ports
        and the operator's actions, and `tickrig compare` reads it.

        Args:
            path: path of the file; an existing file is replaced.

        Raises:
            OSError: the file cannot be written.
        """
        self._mode.save_trace(Path(path))

    def fork(self) -> Bench:
        """Return a copy of the bench that continues independently in virtual time.

        The copy has the devices, wires, faults and pending events, but no hosts and no triggers.

        Raises:
            NotOnThisBench: the bench is not in virtual time.
        """
        return Bench.of_mode(self._mode.fork())

    def snapshot(self, *hosts: object) -> MachineSnapshot:
        """Return a snapshot that can restore the present state of the bench any number of times.

        The snapshot restores the same bench: references to the bench and to its links stay valid. A
        snapshot is made much faster than a copy by `fork`. When the snapshot is restored, tasks,
        triggers and hosts that were added later are removed.

        Args:
            hosts: hosts and other objects of a test, which are restored together with the bench.

        Returns:
            The snapshot, whose method `restore()` restores everything.

        Raises:
            NotOnThisBench: the bench is not in virtual time.
            TypeError: an object in a host cannot be restored, such as a file or a thread.

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
        if not isinstance(self._mode, VirtualMode):
            raise NotOnThisBench("time that has passed comes back in virtual time alone")
        return MachineSnapshot(self, *hosts)

    def close(self) -> None:
        """Release all resources."""
        self._mode.close()


def open_bench(
    path: Path | str,
    *,
    mode: str = VIRTUAL,
    seed: int | None = None,
    limit: Duration = LIMIT,
) -> Bench:
    """Open the bench that a rig file describes.

    Args:
        path: path of the rig file.
        mode: `virtual`, `real` or `hardware`.
        seed: seed of all random numbers, or None to use the seed in the file.
        limit: longest time that hosts may wait, as in `Bench`.

    Raises:
        OSError: the file cannot be read, or a port is not available.
        RigFileError: the file has errors; the message lists all of them.
        ValueError: a device cannot be made.
        PortGone: a bus cannot be opened.
    """
    plan = reader.read_rig_file(Path(path))
    plan = plan if seed is None else replace(plan, seed=seed)
    return Bench.of_plan(plan, mode, limit=limit)


def _limit_us_of(limit: Duration) -> int:
    """Return a limit in microseconds, or `NEVER` for no limit.

    Raises:
        ValueError: the limit is not a time.

    >>> _limit_us_of("2s"), _limit_us_of("none") == _limit_us_of(0) == NEVER
    (2000000, True)
    """
    return NEVER if limit == _NO_LIMIT else us_of(limit) or NEVER


def _never() -> bool:
    return False


def _emulated(mode: str, parts: Parts, plan: RigPlan, limit_us: int) -> BenchMode:
    """Start emulated devices in virtual or in real time."""
    if mode == VIRTUAL:
        return VirtualMode(plan_parts.rig_of(parts, plan), limit_us)
    if mode != _REAL:
        raise ValueError(f"a bench of emulated devices is virtual or real, not {mode!r}")
    return real_mode.RealMode.open(
        parts.mounts, plan.real, lambda outside: plan_parts.rig_of(parts, plan, outside)
    )
