"""A bench of real devices: ports, buses, and an operator."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, NoReturn, TypeVar

from tickrig.emulators.bench.operator import FaultOrder, FaultSpec
from tickrig.emulators.bench.running_emulator import keeping_time
from tickrig.emulators.testing.bench.bench_rig import BenchRig, RigState
from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.emulators.testing.bench.modes.door_journal import DoorJournal, PortRecord
from tickrig.emulators.testing.bench.modes.door_watch import CpuWaits, HostPace, too_slow
from tickrig.emulators.testing.bench.modes.doors import Doors, LinePlace
from tickrig.emulators.testing.bench.modes.mode import BenchMode
from tickrig.emulators.testing.bench.modes.operators import Operators, Terminal
from tickrig.emulators.testing.bench.mounts import LineMount, Mount
from tickrig.emulators.testing.bench.plan_parts import parts_of
from tickrig.emulators.testing.bench.tasks import Condition, text_of
from tickrig.emulators.testing.rig_file.plan import BusPlan, HardwarePlan, RigPlan
from tickrig.host.control.requests import Object

# Addresses of the wires of real devices.


def _places_of(
    plan: RigPlan, hardware: HardwarePlan, mounts: Mapping[str, Mount]
) -> dict[str, LinePlace | BusPlan]:
    """Return the addresses of the wires by name; unknown addresses are omitted.

    Args:
        plan: content of the rig file.
        hardware: section of the rig file for real devices.
        mounts: wires of an equivalent emulated bench, with the rates of the devices.
    """
    places: dict[str, LinePlace | BusPlan] = dict(hardware.buses)
    for wire, port in hardware.ports.items():
        mount = mounts[wire]
        assert isinstance(mount, LineMount)
        baud = port.baud or mount.settings.baud
        places[wire] = LinePlace(port.port, baud, plan.wires[wire].framing)
    return places


_T = TypeVar("_T")

_Begin = Callable[[int], None]
"""An action that has waited, called with the time."""

_POLL_US: Final = 5_000
"""Period at which conditions are checked."""


class HardwareMode(BenchMode):
    """Mode of a bench whose devices are real, as described in the rig file.

    Each device is at a port or on a bus, and a human at the terminal operates it. If an emulator
    stands in for a device, the bench operates the emulator by its control socket. The bench checks
    conditions whenever there is traffic, and also while the bench waits.

    Args:
        plan: content of a rig file with the section `[hardware]`.
        terminal: terminal of the human.

    Raises:
        ValueError: the plan has no addresses of the devices, or names an unknown device.
        PortGone: an emulator that stands in for a device is missing.
    """

    name = "hardware"

    def __init__(self, plan: RigPlan, terminal: Terminal | None = None) -> None:
        if plan.hardware is None:
            raise ValueError("the rig file has no [hardware], which says where the devices are")
        self._plan, self._where = plan, plan.hardware
        self._terminal, self._begun_ns = terminal or Terminal(), time.monotonic_ns()
        like = BenchRig("bench", RigState(parts_of(_without_stores(plan)), keeps=False))
        super().__init__(like, plan.hardware.tolerance)
        self._pace, self._pending = HostPace(), list[tuple[Condition, _Begin, FaultOrder]]()
        self._looking = self._begun = False
        mounts = like.state.mounts
        self._record = PortRecord(plan, mounts, lambda: self.now_us)
        self._journal = journal = like.journal = DoorJournal(
            lambda: self.now_us, self._look, self._record
        )
        places = _places_of(plan, self._where, mounts)
        self.doors = Doors(
            places, lambda wire: journal.watch(mounts[wire], self._pace), self._begin
        )
        self._waits = CpuWaits()
        self._operators = Operators(plan, self._where, like, self._terminal, journal)
        self._stack = ExitStack()
        self._stack.enter_context(keeping_time())
        for close in (self._operators.close, self.doors.close):
            self._stack.callback(close)

    @property
    def devices(self) -> tuple[str, ...]:
        """The names of all devices."""
        return tuple(self._plan.devices)

    @property
    def wires(self) -> tuple[str, ...]:
        """The names of all wires."""
        return tuple(self._plan.wires)

    @property
    def now_us(self) -> int:
        """The time since the bench was opened."""
        return (time.monotonic_ns() - self._begun_ns) // 1_000

    def request(self, do: str, **fields: Any) -> Object:
        """Execute a request by the operator; raise ValueError if the request is refused."""
        return self._operators.request(do, fields)

    def fault(
        self, owner: str, spec: FaultSpec, condition: Condition | None, for_us: int | None
    ) -> None:
        """Start or schedule a fault by the operator."""
        text = "" if condition is None else text_of(condition)
        order = FaultOrder(spec, self.now_us, for_us, text)
        begin = self._operators.fault(owner, order)
        self._rig.orders.append(order)
        if condition is None:
            begin(self.now_us)
        else:
            self._pending.append((condition, begin, order))
            self._look()

    def clear(self, owner: str, fault: str) -> None:
        """Let the operator clear a fault. If the fault waits for its condition, cancel it, too."""
        self._rig.cancel(self._rig.state.full_fault_name(owner, fault))
        self._operators.clear(owner, fault)

    def switch_power(self, owner: str, *, on: bool) -> None:
        """Switch the supply of a device, or of all devices if `owner` is empty."""
        self._operators.switch_power(owner, on=on)

    def observe(self, owner: str, text: str, seen: Condition, within_us: int) -> bool:
        """Return whether something is observed at a real device.

        If the operator of the device is a human, the human is asked. Otherwise the result is
        whether the condition `seen` becomes true in time.
        """
        answer = self._operators.sees(owner, text)
        return super().observe(owner, text, seen, within_us) if answer is None else answer

    def perform(self, owner: str, text: str, do: Callable[[], object]) -> None:
        """Run an action of several steps."""
        if not self._operators.have_done(owner, text):
            do()

    def meanwhile(self, host: Callable[[int], object]) -> None:
        """Keep a host running while a human answers."""
        self._terminal.hosts.append(host)

    def run_for(self, duration_us: int) -> None:
        """Advance the time."""
        self.wait_until(lambda: False, duration_us)

    def wait_until(self, done: Condition, within_us: int) -> bool:
        """Advance the time until a condition is true; return False after the time-out."""
        self._begin()
        until_us = self.now_us + within_us
        while True:
            left_us = until_us - self.now_us
            self._journal.look()
            self._look()
            if done():
                return True
            if left_us <= 0:
                return False
            wait_us = min(left_us, _POLL_US)
            with self._pace.waiting(wait_us):
                time.sleep(wait_us / 1e6)

    def too_slow(self) -> str:
        """Return why the verdict of a failed test is not valid, or "" if the verdict is valid.

        A verdict is not valid if the host or an emulator was too late. But if a human has answered
        no to a question, the verdict is always valid.
        """
        if self._operators.said_no:
            return ""
        host_us = max(self._pace.late_us, self._waits.worst_us)
        return too_slow(host=host_us, emulator=self._operators.late_us)

    def act(self, action: Callable[[BenchRig], _T]) -> NoReturn:
        """Raise NotOnThisBench: there is no rig."""
        raise NotOnThisBench("this works on emulated devices alone: here are real ones")

    def save_trace(self, path: Path) -> None:
        """Write traffic and operator actions; raise OSError if that fails."""
        self._record.save(path)

    def fork(self) -> NoReturn:
        """Raise NotOnThisBench: real devices cannot be copied."""
        raise NotOnThisBench("real devices have no twins")

    def close(self) -> None:
        """Close all ports, and release the operator."""
        self._stack.close()

    def _begin(self) -> None:
        """Switch the devices on, now that their traffic is received."""
        if not self._begun:
            self._begun = True
            self._operators.begin()

    def _look(self) -> None:
        """Run the actions whose condition is now true."""
        self._waits.look(self.now_us)
        if self._looking:
            return
        self._looking = True
        try:
            for entry in tuple(self._pending):
                condition, begin, order = entry
                is_cancelled = not self._rig.is_ordered(order)
                if is_cancelled or condition():
                    self._pending.remove(entry)
                    if not is_cancelled:
                        begin(self.now_us)
        finally:
            self._looking = False


def _without_stores(plan: RigPlan) -> RigPlan:
    """Return the plan without store files: real devices have their own memory."""
    devices = {name: replace(device, store=None) for name, device in plan.devices.items()}
    return replace(plan, devices=devices)
