"""What virtual time, real time and real hardware have in common for a test."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final, Protocol, TypeVar

from tickrig.emulators.bench.control import EmulatorControl
from tickrig.emulators.bench.operator import FaultOrder, FaultSpec
from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.testing.bench.bench_rig import BenchDescription, BenchRig
from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.emulators.testing.bench.tasks import Condition, text_of, when
from tickrig.emulators.testing.rig_file.plan import Tolerances
from tickrig.host.control.requests import VERSION, Object

if TYPE_CHECKING:
    import can
    import canopen
    import serial

    from tickrig.host.links.link import Link


T = TypeVar("T")

Address = str | dict[str, Any]
"""What `serial.serial_for_url` takes of a line, and by keyword `can.Bus` of a bus."""


class HostDoors(Protocol):
    """Opens the wires of a bench for hosts; each wire by its name.

    A wire of the other kind raises ValueError, one that is nowhere `NotOnThisBench`.
    """

    def link(self, wire: str) -> Link[Any]:
        """Connect a host: bytes on a serial line, frames on a bus."""
        ...

    def serial(self, wire: str, options: dict[str, Any]) -> serial.SerialBase:
        """Open a serial line by pyserial."""
        ...

    def can_bus(self, wire: str, options: dict[str, Any]) -> can.BusABC:
        """Open a bus by python-can."""
        ...

    def canopen_network(self, wire: str) -> canopen.Network:
        """Connect the canopen library to a bus."""
        ...

    def address(self, wire: str) -> Address:
        """Return where a program opens a wire by itself."""
        ...

    def close(self) -> None:
        """Close what is open, and offer nothing any more."""


class BenchMode(ABC):
    """Where the devices are, and how time passes.

    What a mode cannot do raises `NotOnThisBench`.

    Args:
        rig: with the devices, or, of real devices, with such ones: it does not run then.
        tolerance: what is still right.

    Attributes:
        name: `virtual`, `real` or `hardware`.
        tolerance: what is still right.
        doors: where hosts come in; the first one that does lets time begin.
    """

    name: ClassVar[str]
    doors: HostDoors

    def __init__(self, rig: BenchRig, tolerance: Tolerances) -> None:
        self._rig, self.tolerance = rig, tolerance

    def _query(self, question: Callable[[BenchRig], T]) -> T:
        """Return what the rig says; nothing is done to it."""
        return question(self._rig)

    @property
    def devices(self) -> tuple[str, ...]:
        """The names of all devices."""
        return tuple(self._rig.state.assembly.parts)

    @property
    def wires(self) -> tuple[str, ...]:
        """The names of all wires."""
        return tuple(self._rig.state.mounts)

    @property
    @abstractmethod
    def now_us(self) -> int:
        """The time since the bench was opened."""

    def wire_of(self, device: str) -> str:
        """Return the name of the wire that a device is on."""
        return self._rig.state.wire_of(device)

    @abstractmethod
    def request(self, do: str, **fields: Any) -> Object:
        """Ask as the control socket is asked; ValueError if it is refused."""

    @abstractmethod
    def act(self, action: Callable[[BenchRig], T]) -> T:
        """Do something to the rig between two ticks."""

    @abstractmethod
    def fault(
        self, owner: str, spec: FaultSpec, condition: Condition | None, for_us: int | None
    ) -> None:
        """Let a fault of a device, a wire or (empty) any come, or note that it shall."""

    @property
    def orders(self) -> Sequence[FaultOrder]:
        """The faults that were ordered, by the rig file too, in this order."""
        return self._rig.orders

    def check_fault(self, owner: str, name: str) -> None:
        """Raise ValueError unless a device, a wire or (empty) any has a fault of this name."""
        self._query(lambda rig: rig.state.full_fault_name(owner, name))

    def describe(self, owner: str) -> BenchDescription:
        """Return what there is at a device, at all of them if it is empty."""
        return self._query(lambda rig: rig.describe(owner))

    @abstractmethod
    def clear(self, owner: str, fault: str) -> None:
        """Let a fault go, and its future too."""

    @abstractmethod
    def switch_power(self, owner: str, *, on: bool) -> None:
        """Give or take the supply of a device, of all if it is empty."""

    def hear(self, listener: Callable[[WireLine], None]) -> None:
        """Tell of each line and frame from now on."""
        self._query(lambda rig: rig.journal.listeners.append(listener))

    def observe(self, owner: str, text: str, seen: Condition, within_us: int) -> bool:
        """Say whether something is seen at a device, or by a human who is asked the text."""
        return self.wait_until(seen, within_us + self.tolerance.time_us)

    def perform(self, owner: str, text: str, do: Callable[[], object]) -> None:
        """Have something done at a device: by the test itself, or by a human who is told."""
        do()

    def meanwhile(self, host: Callable[[int], object]) -> None:  # noqa: B027 - nothing to do
        """Let a host go on, so many microseconds at a time, while a human is asked."""

    @abstractmethod
    def run_for(self, duration_us: int) -> None:
        """Let time pass."""

    @abstractmethod
    def wait_until(self, done: Callable[[], bool], within_us: int) -> bool:
        """Let time pass until something is so; False if it was not in time."""

    @abstractmethod
    def save_trace(self, path: Path) -> None:
        """Write a trace of all that happened; OSError if it cannot be."""

    def journal(self) -> tuple[WireLine, ...]:
        """Return the latest lines and frames, and what was done."""
        return self._query(lambda rig: rig.journal.lines())

    def mappings(self) -> tuple[WireLine, ...]:
        """Return the frames before the journal's which say what PDOs carry."""
        return self._query(lambda rig: rig.journal.mappings())

    def unfinished(self) -> tuple[WireLine, ...]:
        """Return what has begun on serial lines and did not end."""
        return self._query(lambda rig: rig.journal.unfinished())

    @abstractmethod
    def too_slow(self) -> str:
        """Say why no failure is to be believed: real time was not kept; empty if it was."""

    @abstractmethod
    def fork(self) -> BenchMode:
        """Return a twin that goes on by itself from here."""

    @abstractmethod
    def close(self) -> None:
        """Give everything back."""


# What benches of emulated devices have in common, in virtual and in real time.

POWER: Final = {"rrc_power": 1, "power_cut": 0, "power_off": 0}
"""Inputs that are the supply of a device, each with its value while that is there."""


class EmulatedMode(BenchMode):
    """The part of a `BenchMode` of emulated devices that does not ask what time it is."""

    @cached_property
    def _control(self) -> EmulatorControl:
        """What answers requests."""
        return EmulatorControl(self._rig)

    def _query(self, question: Callable[[BenchRig], T]) -> T:
        return self.act(question)

    def request(self, do: str, **fields: object) -> Object:
        """Ask as the control socket is asked; ValueError if it is refused."""
        request = {"v": VERSION, "do": do, **fields}
        return _answer_of(self.act(lambda rig: self._control.answer(request)))

    def fault(
        self, owner: str, spec: FaultSpec, condition: Condition | None, for_us: int | None
    ) -> None:
        """Let a fault come, or note that it shall."""
        text = "" if condition is None else text_of(condition)
        self.act(
            lambda rig: _arm(
                rig,
                FaultOrder(
                    replace(spec, name=rig.state.full_fault_name(owner, spec.name)),
                    rig.effective_us,
                    for_us,
                    text,
                ),
                condition,
            )
        )

    def clear(self, owner: str, fault: str) -> None:
        """Let a fault go, and its future too."""
        self.act(lambda rig: rig.operator.clear(rig.state.full_fault_name(owner, fault)))

    def switch_power(self, owner: str, *, on: bool) -> None:
        """Give or take the supply of a device, of all if it is empty."""
        for name in [owner] if owner else self.devices:
            inputs = self._rig.state.assembly.parts[name].inputs
            found = next((item for item in POWER if item in inputs.table), None)
            if found is None:
                raise NotOnThisBench(f"{name} has no input that is its supply")
            full = self._rig.state.assembly.full_name(name, found)
            self.request("set", name=full, value=POWER[found] if on else 1 - POWER[found])

    def save_trace(self, path: Path) -> None:
        """Write a trace of all that happened; OSError if it cannot be."""
        self.act(lambda rig: rig.save_trace(path))


def _answer_of(answer: Object) -> Object:
    """Return an answer; ValueError with its text if it is a refusal."""
    if not answer["ok"]:
        raise ValueError(str(answer["error"]))
    return answer


def _arm(rig: BenchRig, order: FaultOrder, condition: Condition | None) -> None:
    """Let a fault come, or note that it shall."""

    def begin() -> None:
        now_us = rig.effective_us
        rig.operator.fault(now_us, order.begin(now_us))

    rig.operator.check_fault(order.spec)
    if condition is None:
        begin()
    else:
        when(rig, condition, begin)
    rig.orders.append(order)
