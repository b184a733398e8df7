"""Common interface of virtual time, real time and real hardware for a test."""

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


_T = TypeVar("_T")

Address = str | dict[str, Any]
"""URL of a line for `serial.serial_for_url`, or options of a bus for `can.Bus`."""


class _HostDoors(Protocol):
    """Opens the wires of a bench for hosts; each wire has a name.

    A wire of the wrong kind raises ValueError. A wire without an address raises `NotOnThisBench`.
    """

    def link(self, wire: str) -> Link[Any]:
        """Connect a host with a wire.

        Args:
            wire: name of the wire.

        Returns:
            The link. It carries bytes on a serial line, or frames on a CAN bus.
        """
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
        """Return the address at which a program can open a wire itself."""
        ...

    def close(self) -> None:
        """Close everything open, and withdraw all names."""


class BenchMode(ABC):
    """Base class of the modes of a bench: where its devices are, and how its time passes.

    Operations that a mode does not support raise `NotOnThisBench`.

    Args:
        rig: rig with the emulated devices. If the devices of the bench are real, the rig has an
            equivalent device for each of them. Such a rig only provides information, such as names
            and wires; its time does not advance.
        tolerance: permitted deviations from the expected times and values in a test.

    Attributes:
        name: name of the mode: `virtual`, `real` or `hardware`.
        tolerance: permitted deviations from the expected times and values in a test.
        doors: connections for hosts. The first connection starts the time.
    """

    name: ClassVar[str]
    doors: _HostDoors

    def __init__(self, rig: BenchRig, tolerance: Tolerances) -> None:
        self._rig, self.tolerance = rig, tolerance

    def _query(self, question: Callable[[BenchRig], _T]) -> _T:
        """Return a value from the rig without changing it."""
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
        """Execute a request of the control socket; raise ValueError if the request is refused."""

    @abstractmethod
    def act(self, action: Callable[[BenchRig], _T]) -> _T:
        """Run a function on the rig between two ticks."""

    @abstractmethod
    def fault(
        self, owner: str, spec: FaultSpec, condition: Condition | None, for_us: int | None
    ) -> None:
        """Start or schedule a fault.

        Args:
            owner: name of the device or wire with the fault, or empty if the fault may belong to
                any.
            spec: the fault with its arguments and its time.
            condition: condition that starts the fault, or None.
            for_us: duration of the fault in microseconds, or None if it stays.
        """

    @property
    def orders(self) -> Sequence[FaultOrder]:
        """The scheduled faults, including those of the rig file, in order."""
        return self._rig.orders

    @property
    def never_begun(self) -> list[str]:
        """Descriptions of the faults whose condition was never true."""
        return [
            f"{order.spec.text}: {order.when} was never true"
            for order in self.orders
            if order.when and order.due_us is None
        ]

    def check_fault(self, owner: str, name: str) -> None:
        """Raise ValueError if a fault does not exist.

        Args:
            owner: name of the device or wire with the fault, or empty if the fault may belong to
                any.
            name: name of the fault.
        """
        self._query(lambda rig: rig.state.full_fault_name(owner, name))

    def describe(self, owner: str) -> BenchDescription:
        """Return the inputs, outputs and faults of a device.

        Args:
            owner: name of the device, or empty for all devices of the bench.
        """
        return self._query(lambda rig: rig.describe(owner))

    @abstractmethod
    def clear(self, owner: str, fault: str) -> None:
        """Clear a fault, or cancel a scheduled fault."""

    @abstractmethod
    def switch_power(self, owner: str, *, on: bool) -> None:
        """Switch the supply of a device, or of all devices if `owner` is empty."""

    def hear(self, listener: Callable[[WireLine], None]) -> None:
        """Call a listener with each line and frame from now on."""
        self._query(lambda rig: rig.journal.listeners.append(listener))

    def observe(self, owner: str, text: str, seen: Condition, within_us: int) -> bool:
        """Return whether something is observed: call `seen`, or show the text to a human."""
        return self.wait_until(seen, within_us + self.tolerance.time_us)

    def perform(self, owner: str, text: str, do: Callable[[], object]) -> None:
        """Run an action at a device, or ask a human to do it.

        Args:
            owner: name of the device, or empty for all devices.
            text: description of the action, which a human reads.
            do: function that executes the action with an emulator.
        """
        do()

    def meanwhile(self, host: Callable[[int], object]) -> None:  # noqa: B027 - nothing to do
        """Keep a host running, in steps of microseconds, while a human answers."""

    @abstractmethod
    def run_for(self, duration_us: int) -> None:
        """Advance the time."""

    @abstractmethod
    def wait_until(self, done: Callable[[], bool], within_us: int) -> bool:
        """Advance the time until a condition is true; return False after the time-out."""

    def await_until(
        self, done: Callable[[], bool], within_us: int, where: Callable[[], str]
    ) -> bool:
        """Advance the time until a condition is true, for a test that is a coroutine.

        Args:
            done: function that returns whether the condition is true.
            within_us: longest wait in microseconds.
            where: function that returns file and line of the coroutine's wait, for messages.

        Returns:
            True if the condition is true, or False after the time-out.
        """
        return self.wait_until(done, within_us)

    @abstractmethod
    def save_trace(self, path: Path) -> None:
        """Write a trace of the run; raise OSError if that fails."""

    def journal(self) -> tuple[WireLine, ...]:
        """Return the latest lines, frames and actions."""
        return self._query(lambda rig: rig.journal.lines())

    def mappings(self) -> tuple[WireLine, ...]:
        """Return earlier frames, no longer in the journal, that define the contents of PDOs."""
        return self._query(lambda rig: rig.journal.mappings())

    def unfinished(self) -> tuple[WireLine, ...]:
        """Return incomplete lines of serial lines."""
        return self._query(lambda rig: rig.journal.unfinished())

    @abstractmethod
    def too_slow(self) -> str:
        """Return a message if the bench was too slow to judge a failed test, otherwise ""."""

    def hung(self) -> str:
        """Return an error message if a host has waited endlessly, otherwise ""."""
        return ""

    @abstractmethod
    def fork(self) -> BenchMode:
        """Return a twin that continues independently."""

    @abstractmethod
    def close(self) -> None:
        """Release all resources."""


# Common part of benches of emulated devices, in virtual and in real time.

POWER: Final = {"rrc_power": 1, "power_cut": 0, "power_off": 0}
"""Inputs for the supply of a device, each with its value while the supply is on."""


class EmulatedMode(BenchMode):
    """Base class of the modes with emulated devices, in virtual and in real time."""

    @cached_property
    def _control(self) -> EmulatorControl:
        """The object that answers requests."""
        return EmulatorControl(self._rig)

    def _query(self, question: Callable[[BenchRig], _T]) -> _T:
        return self.act(question)

    def request(self, do: str, **fields: object) -> Object:
        """Execute a request of the control socket; raise ValueError if the request is refused."""
        request = {"v": VERSION, "do": do, **fields}
        return _answer_of(self.act(lambda rig: self._control.answer(request)))

    def fault(
        self, owner: str, spec: FaultSpec, condition: Condition | None, for_us: int | None
    ) -> None:
        """Start or schedule a fault."""
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
        """Clear a fault, or cancel a scheduled fault."""
        self.act(lambda rig: _clear(rig, rig.state.full_fault_name(owner, fault)))

    def switch_power(self, owner: str, *, on: bool) -> None:
        """Switch the supply of a device, or of all devices if `owner` is empty."""
        for name in [owner] if owner else self.devices:
            inputs = self._rig.state.assembly.parts[name].inputs
            found = next((item for item in POWER if item in inputs.table), None)
            if found is None:
                raise NotOnThisBench(f"{name} has no input that is its supply")
            full = self._rig.state.assembly.full_name(name, found)
            self.request("set", name=full, value=POWER[found] if on else 1 - POWER[found])

    def save_trace(self, path: Path) -> None:
        """Write a trace of the run; raise OSError if that fails."""
        self.act(lambda rig: rig.save_trace(path))


def _answer_of(answer: Object) -> Object:
    """Return an answer; if the answer is a refusal, raise ValueError with its text."""
    if not answer["ok"]:
        raise ValueError(str(answer["error"]))
    return answer


def _arm(rig: BenchRig, order: FaultOrder, condition: Condition | None) -> None:
    """Start or schedule a fault."""

    def begin() -> None:
        now_us = rig.effective_us
        rig.operator.fault(now_us, order.begin(now_us))

    def begin_unless_cancelled() -> None:
        if rig.is_ordered(order):
            begin()

    rig.operator.check_fault(order.spec)
    if condition is None:
        begin()
        rig.orders.append(order)
    else:
        rig.orders.append(order)
        when(rig, lambda: not rig.is_ordered(order) or condition(), begin_unless_cancelled)


def _clear(rig: BenchRig, fault: str) -> None:
    """Clear a fault, and cancel it if it waits for a time or a condition."""
    rig.operator.clear(fault)
    rig.cancel(fault)
