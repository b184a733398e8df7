"""Checks bench and host after a test: outputs, losses, clocks, threads, coroutines."""

from __future__ import annotations

import re
import sys
import threading
import warnings
from collections.abc import Callable, Collection, Container, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from functools import partial
from threading import Thread
from traceback import format_exception_only, walk_tb
from typing import Any, Final

from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.testing.bench.bench import HARDWARE, VIRTUAL, Bench
from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.emulators.testing.bench.mounts import LineMount
from tickrig.emulators.testing.host_clock.host_code import is_host, place_of
from tickrig.emulators.testing.host_clock.patched_time import unpatched_time_fails
from tickrig.emulators.testing.plugin.journal_text import buses_of, fault_names
from tickrig.host.text.trace import Mark
from tickrig.host.text.values import Setting, counted, format_time
from tickrig.wire.can import ErrorFrame, describe_error_frame
from tickrig.wire.errors import FramingError

# What is wrong with a bench though no test ordered it.

ERRORS: Final = "error frames"
LOST: Final = "lost"


class Health:
    """Records errors and lost data on the wires of a bench, for the verdict of a test.

    Errors and lost data on a wire are not reported after a fault was injected on this wire or in
    any device, because the fault may be their cause. Lost data on a serial line are also not
    reported if no host has sent data on this line, because then no host reads the line.

    Args:
        bench: bench of the test. For real devices only error frames are known.
    """

    def __init__(self, bench: Bench) -> None:
        self._mode = bench._mode
        self._wires = frozenset(self._mode.wires)
        self._buses = self._spoken = frozenset(buses_of(bench))
        self._faulty, self._errors = frozenset[str](), dict[str, str]()
        self._mode.hear(self._hear)
        self._wire_faults, self._faults = fault_names(bench)
        with suppress(NotOnThisBench):
            self._mode.act(self._begin)

    def complaints(self, allowed: Container[str] = ()) -> tuple[str, ...]:
        """Return the problems found on the wires of the bench, as one text for each problem.

        Args:
            allowed: problems that the test permits: `ERRORS`, `LOST`.
        """
        found = [] if ERRORS in allowed else list(self._errors.values())
        with suppress(NotOnThisBench):
            if LOST not in allowed:
                found += self._mode.act(self._lost)
                found += self._mode.act(self._unread)
            found += self._mode.act(_broken_off)
            found += self._mode.act(_without_value)
        return tuple(found)

    def _begin(self, rig: BenchRig) -> None:
        if rig.operator.active_faults:
            self._faulty = self._wires
        for mount in rig.state.mounts.values():
            if isinstance(mount, LineMount):
                mount.tap.listeners.append(partial(self._pass, mount.name))

    def _lost(self, rig: BenchRig) -> list[str]:
        return [
            f"{name}: {counted(on.lost, self._unit(name))} found a buffer full"
            for name, on in rig.state.mounts.items()
            if on.lost and name in self._spoken - self._faulty
        ]

    def _unread(self, rig: BenchRig) -> list[str]:
        return [
            f"{name}: {counted(port.lost, 'byte')} dropped at its port: the host did not read"
            for name, ports in rig.ports.items()
            for port in ports
            if port.lost and port.spoken and name not in self._faulty
        ]

    def _unit(self, wire: str) -> str:
        return "frame" if wire in self._buses else "byte"

    def _pass(self, wire: str, at_us: int, mark: Mark, data: bytes) -> None:
        """Record that a host has sent data."""
        if mark is Mark.TO_DEVICE:
            self._spoken |= {wire}

    def _hear(self, line: WireLine) -> None:
        if line.mark is Mark.PHYSICAL:
            self._done(line)
        elif line.source in self._buses and line.source not in self._errors:
            self._on_bus(line)

    def _done(self, line: WireLine) -> None:
        """Record that a fault has occurred."""
        name = line.data.decode().partition("=")[0]
        names = {name, f"{line.source}/{name}"}
        if line.source in self._wires and names & self._wire_faults:
            self._faulty |= {line.source}
        elif names & (self._faults | self._wire_faults):
            self._faulty = self._wires

    def _on_bus(self, line: WireLine) -> None:
        """Record the first error frame of a bus on which no fault has occurred."""
        if line.source in self._faulty or line.data[:1] not in b"23" or len(line.data) != 25:
            return
        try:
            frame = ErrorFrame.parse(line.data.decode())
        except FramingError:
            return
        self._errors[line.source] = (
            f"{line.source}: an error frame that no fault ordered, at "
            f"{format_time(line.at_us)} s: {describe_error_frame(frame)}"
        )


def _without_value(rig: BenchRig) -> list[str]:
    """Return the signals of the rig file that could not set their inputs."""
    problems = [driver.problems for driver in rig.state.drivers]
    return [f"signal {line}" for each in problems for line in each.values()]


def _broken_off(rig: BenchRig) -> list[str]:
    """Return why the trace of a bench is incomplete."""
    recorder = rig.state.recorder
    return [f"the trace: {recorder.error}"] if recorder and recorder.error else []


# What outputs are when a test is over.

SafeState = Mapping[str, Setting] | Callable[[Bench], object] | None
"""Values of outputs by name, or a function that returns False or a text if the state is unsafe."""


def with_plan(
    safe: SafeState, plan: Mapping[str, Mapping[str, Setting]], bench: Bench
) -> SafeState:
    """Return the requirements on outputs after a test: those of a fixture and of the rig file.

    If the fixture and the rig file require a value of the same output, the value of the fixture is
    used. If the fixture gives a function, the result is a function that checks both requirements.

    Args:
        safe: value of the fixture `bench_safe`. It has the required values by the names of outputs,
            or is a function that checks the bench. None means no requirements.
        plan: required values of the rig file, by device and output.
        bench: the bench.
    """
    alone = len(bench.devices) == 1
    of_plan = {
        name if alone else f"{device}/{name}": value
        for device, values in plan.items()
        for name, value in values.items()
    }
    if not of_plan:
        return safe
    if not callable(safe):
        return of_plan | {_short(name, bench): value for name, value in (safe or {}).items()}
    check = safe

    def both(bench: Bench) -> object:
        if found := unsafe(bench, of_plan):
            return "; ".join(found)
        return check(bench)

    return both


def _short(name: str, bench: Bench) -> str:
    """Return a name without the name of the device, if the bench has only one device."""
    return name.removeprefix(f"{bench.devices[0]}/") if len(bench.devices) == 1 else name


def check_safe(bench: Bench, safe: SafeState) -> None:
    """Raise ValueError if the table of required values names an output that the bench lacks."""
    for name in safe if isinstance(safe, Mapping) and bench.mode != HARDWARE else ():
        bench.get(name)


def unsafe(bench: Bench, safe: SafeState) -> list[str]:
    """Return the outputs that are not safe after a test, one per line."""
    if safe is None:
        return []
    if isinstance(safe, Mapping):
        found = [(name, bench.get(name), value) for name, value in safe.items()]
        return [
            f"{name} is {present}, and safe is {value}"
            for name, present, value in found
            if present != value
        ]
    said = safe(bench)
    if isinstance(said, str):
        return [said] if said else []
    return ["bench_safe says that it is not safe"] if said is False else []


# Threads of hosts that die: pytest only warns of them.

THREADS: Final = "threads"


@contextmanager
def dead_threads(note: Callable[[str], None]) -> Iterator[None]:
    """Record threads that start in the `with` block of a test and end with an exception.

    The record has the name of the thread, the line and the exception. Threads that started before
    the test are not recorded, but pytest warns about them as about all threads. A thread that ends
    by `sys.exit()` is recorded only if its exit status is an error.

    Args:
        note: function that is called with a line of text, in the thread that ends.
    """
    others, before = set(threading.enumerate()), threading.excepthook

    def hook(died: threading.ExceptHookArgs) -> None:
        if died.thread not in others and not _has_ended(died.exc_value):
            note(_text(died))
        before(died)

    threading.excepthook = hook
    try:
        yield
    finally:
        threading.excepthook = before


def _has_ended(error: BaseException | None) -> bool:
    return isinstance(error, SystemExit) and not error.code


def _text(died: threading.ExceptHookArgs) -> str:
    name = died.thread.name if died.thread else "?"
    what = format_exception_only(died.exc_type, died.exc_value)[-1].strip()
    return f"thread {name!r} has died at {_place(died)}: {what.removeprefix(_module(died))}"


def _module(died: threading.ExceptHookArgs) -> str:
    return f"{died.exc_type.__module__}."


def _place(died: threading.ExceptHookArgs) -> str:
    """Return the place of an error in the code of the host, or else in any code."""
    places = [(frame, line) for frame, line in walk_tb(died.exc_traceback)]
    own = [
        (frame, line)
        for frame, line in places
        if is_host(frame.f_globals.get("__name__") or "", frame.f_code.co_filename)
    ]
    frame, line = (own or places)[-1]
    return place_of(frame.f_code.co_filename, line)


# Coroutines that a test makes and forgets: what stands in them never happens.

_WARNING: Final = r"coroutine '.*' was never awaited"
"""Warning of Python about a coroutine that is discarded without being awaited."""

_TOLD: Final = re.compile(r"coroutine '(.*)' was never awaited(?s:.*)  File \"(.*)\", line (\d+)")


@contextmanager
def never_awaited(note: Callable[[str], None]) -> Iterator[None]:
    """Record coroutines that are discarded without being awaited, during a `with` block.

    Filters of warnings have no effect on the record.

    Args:
        note: function that is called with a line of text for each coroutine.
    """
    depth = sys.get_coroutine_origin_tracking_depth()
    with warnings.catch_warnings():
        # By default only the first per line is reported; with "error" it is raised in a finalizer,
        # where Python only prints it.
        warnings.filterwarnings("always", _WARNING, RuntimeWarning)
        show = warnings.showwarning

        def showwarning(message: Warning | str, *where: Any, **more: Any) -> None:
            if told := _TOLD.match(str(message)):
                name, file, line = told.groups()
                note(f"{name} was called and not awaited at {place_of(file, int(line))}")
            show(message, *where, **more)

        warnings.showwarning = showwarning
        # Without it the warning does not say where the coroutine was made.
        sys.set_coroutine_origin_tracking_depth(max(1, depth))
        try:
            yield
        finally:
            sys.set_coroutine_origin_tracking_depth(depth)


CLOCK: Final = "clock"
LONG_WAITS: Final = "long waits"


def guard(
    mode: str, allowed: Container[str], others: Collection[Thread]
) -> AbstractContextManager[None]:
    """Return a context manager in which a use of the machine's clock makes a test fail.

    If the bench is not in virtual time, or if the test may use the machine's clock, the context
    manager does nothing.

    Args:
        mode: mode of the bench.
        allowed: names that the markers `allows` of the test allow.
        others: threads that ran before the bench was opened. They may use the machine's clock.
    """
    if mode != VIRTUAL or CLOCK in allowed:
        return nullcontext()
    return unpatched_time_fails(others=others)
