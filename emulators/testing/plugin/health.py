"""What the outputs of devices are when a test is over."""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping
from contextlib import suppress
from functools import partial
from typing import Final

from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.testing.bench.bench import HARDWARE, Bench
from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.emulators.testing.bench.mounts import LineMount
from tickrig.emulators.testing.plugin.journal_text import buses_of, fault_names
from tickrig.host.text.trace import Mark
from tickrig.host.text.values import Setting, counted, format_time
from tickrig.wire.can import ErrorFrame, describe_error_frame
from tickrig.wire.errors import FramingError

# What is wrong with a bench though no test ordered it.

ERRORS: Final = "error frames"
LOST: Final = "lost"


class Health:
    """Listens on a bench from its beginning.

    What is on a wire, or lost there, is ordered if a fault of this wire, or of any device, came
    before. A line on which no host spoke may overflow: nobody reads there.

    Args:
        bench: the bench. Of real devices only the error frames are known.
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
        """Return what is wrong, each in a line; nothing if all is well.

        Args:
            allowed: what may be nevertheless: `ERRORS`, `LOST`.
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
        """Note that a host spoke."""
        if mark is Mark.TO_DEVICE:
            self._spoken |= {wire}

    def _hear(self, line: WireLine) -> None:
        if line.mark is Mark.PHYSICAL:
            self._done(line)
        elif line.source in self._buses and line.source not in self._errors:
            self._on_bus(line)

    def _done(self, line: WireLine) -> None:
        """Note that a fault came."""
        name = line.data.decode().partition("=")[0]
        names = {name, f"{line.source}/{name}"}
        if line.source in self._wires and names & self._wire_faults:
            self._faulty |= {line.source}
        elif names & (self._faults | self._wire_faults):
            self._faulty = self._wires

    def _on_bus(self, line: WireLine) -> None:
        """Note the first error frame of a bus on which no fault was."""
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
    """Return why the trace of a bench is not whole."""
    recorder = rig.state.recorder
    return [f"the trace: {recorder.error}"] if recorder and recorder.error else []


SafeState = Mapping[str, Setting] | Callable[[Bench], object] | None
"""Values of outputs by name, or a check: False, or a text that says what is unsafe."""


def with_plan(
    safe: SafeState, plan: Mapping[str, Mapping[str, Setting]], bench: Bench
) -> SafeState:
    """Return what is safe by the rig file and by the fixture, whose values come first.

    Args:
        safe: of the fixture.
        plan: of the rig file, by device and output.
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
    """Return a name without the device that is alone on its bench."""
    return name.removeprefix(f"{bench.devices[0]}/") if len(bench.devices) == 1 else name


def check_safe(bench: Bench, safe: SafeState) -> None:
    """Raise ValueError if something is asked for that the bench has not."""
    for name in safe if isinstance(safe, Mapping) and bench.mode != HARDWARE else ():
        bench.get(name)


def unsafe(bench: Bench, safe: SafeState) -> list[str]:
    """Return what is not as it has to be when a test is over, each in a line."""
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
