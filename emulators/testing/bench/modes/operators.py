"""Who is at which real device, and what is asked of whom."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import replace
from typing import Any, Protocol

from tickrig.emulators.bench.operator import FaultOrder, FaultSpec
from tickrig.emulators.rig.emulated import HasSignals
from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.emulators.testing.bench.modes.door_journal import DoorJournal
from tickrig.emulators.testing.bench.modes.emulator_operator import EmulatorOperator
from tickrig.emulators.testing.bench.modes.human_operator import (
    HumanOperator,
    PowerSwitch,
    Terminal,
)
from tickrig.emulators.testing.rig_file.plan import HardwarePlan, RigPlan
from tickrig.emulators.testing.signals.sources import SignalSpec
from tickrig.host.control.requests import Object
from tickrig.host.text.names import near
from tickrig.host.text.values import Setting
from tickrig.wire.instant import NEVER

# The hands at one real device, and the eyes on it.


class _DeviceOperator(Protocol):
    """An operator: a human at the terminal, or an emulator that stands in for one.

    Names are those of the device alone, without the name of the device.

    Attributes:
        said_no: a human saw what should not be; that counts however late the machine was.
        quick: does something the moment that it is to be done.
    """

    said_no: bool
    quick: bool

    @property
    def late_us(self) -> int:
        """How late the device was, as far as anybody knows."""
        ...

    def prepare(self, like: HasSignals) -> None:
        """Bring the device to where such a one begins, without its power, if that can be done."""

    def begin(self) -> None:
        """Give it its power, if `prepare` took it."""

    def set(self, name: str, values: tuple[Setting, ...]) -> None:
        """Set an input, or all inputs of a group."""

    def set_all(self, values: Mapping[str, Setting]) -> None:
        """Set several inputs, before the device has its power."""

    def get(self, name: str) -> Setting:
        """Return the present value of an input or output."""
        ...

    def press(self, name: str, duration_us: int) -> None:
        """Press a button and let it go."""

    def fault(self, spec: FaultSpec, now_us: int, for_us: int | None) -> None:
        """Let a fault come; its times are those of the bench, where it is `now_us`."""

    def clear(self, fault: str) -> None:
        """Let a fault go."""

    def sees(self, text: str) -> bool | None:
        """Say whether something is seen; None if the device itself is to be asked."""
        ...

    def have_done(self, text: str) -> bool:
        """Have something done, told in words; False if nobody is here who understands them."""
        ...

    def switch_power(self, *, on: bool) -> None:
        """Give or take the supply."""

    def close(self) -> None:
        """Go home."""


class Operators:
    """The operators of a bench, with their devices by name.

    Args:
        plan: the rig file.
        where: what it says of real devices.
        like: such devices, for their tables; nothing runs there.
        terminal: where the human is.
        journal: gets what is done.

    Raises:
        PortGone: an emulator that plays a device is not there.
    """

    def __init__(
        self,
        plan: RigPlan,
        where: HardwarePlan,
        like: BenchRig,
        terminal: Terminal,
        journal: DoorJournal,
    ) -> None:
        self._plan, self._where, self._like = plan, where, like
        self._terminal, self._journal = terminal, journal
        self._operators: dict[str, _DeviceOperator] = {}
        self._waiting: list[str] = []
        with ExitStack() as undo:
            undo.callback(self.close)
            for name in plan.devices:
                self._operators[name] = self._operator_of(name)
            for name, operator in self._operators.items():
                operator.prepare(like.state.assembly.parts[name])
                self._waiting.append(name)
                self._start(name, operator)
            undo.pop_all()

    def begin(self) -> None:
        """Give the devices their power that were brought to where they begin."""
        for device in self._waiting:
            self._operators[device].begin()
        self._waiting.clear()

    @property
    def said_no(self) -> bool:
        """Whether a human saw what should not be."""
        return any(operator.said_no for operator in self._operators.values())

    @property
    def late_us(self) -> int:
        """How late the worst of the devices was."""
        return max((operator.late_us for operator in self._operators.values()), default=0)

    def close(self) -> None:
        """Let all go."""
        for operator in self._operators.values():
            operator.close()

    def request(self, do: str, fields: dict[str, Any]) -> Object:
        """Have done what a control socket would; ValueError if it is refused."""
        match do:
            case "set":
                self._set(fields["name"], fields["value"])
            case "press":
                self._press(fields["name"], fields["duration_us"])
            case "get":
                return {"values": {name: self._get(name) for name in fields["names"]}}
            case _:
                raise NotOnThisBench(f"real devices do not answer {do!r}")
        return {}

    def _set(self, name: str, values: list[Setting]) -> None:
        pairs = self._like.operator.check_set(name, *values)
        device, signal = self._owner(name)
        self._operator_at(device).set(signal, tuple(values))
        changes = {member.removeprefix(f"{device}/"): value for member, value in pairs}
        self._journal.note(device, f"{signal}={' '.join(map(str, values))}", **changes)

    def _press(self, name: str, duration_us: int) -> None:
        self._like.operator.check_press(name, duration_us)
        device, button = self._owner(name)
        self._operator_at(device).press(button, duration_us)
        self._journal.note(device, f"{button} pressed for {duration_us / 1e6:g} s", **{button: 1})
        self._journal.record.changed(device, button, 0, duration_us)

    def _get(self, name: str) -> Setting:
        device, signal = self._owner(name)
        return self._operator_at(device).get(signal)

    def fault(self, owner: str, order: FaultOrder) -> Callable[[int], None]:
        """Return what has a fault made, at a time of the bench.

        Args:
            owner: a device or wire, empty for any.
            order: the fault, which gets its full name; one that waits is no good a moment later.
        """
        name = self._like.state.full_fault_name(owner, order.spec.name)
        spec = order.spec = replace(order.spec, name=name)
        self._like.operator.check_fault(spec)
        device, fault = self._fault_owner(name)
        operator, wanted = self._operator_at(device), replace(spec, name=fault)
        is_input = name in self._like.state.assembly.inputs.table
        if order.when and not operator.quick:
            raise NotOnThisBench(f"no hand makes {fault} the moment that something is so")

        def begin(now_us: int) -> None:
            order.begin(now_us)
            operator.fault(wanted, now_us, order.for_us)
            said = wanted.text
            lasts = (spec.from_us, spec.to_us, order.for_us) == (0, NEVER, None)
            self._journal.note(device, said, **({fault: 1} if is_input and lasts else {}))

        return begin

    def clear(self, owner: str, fault: str) -> None:
        """Have a fault mended."""
        name = self._like.state.full_fault_name(owner, fault)
        device, bare = self._fault_owner(name)
        self._operator_at(device).clear(bare)
        is_input = name in self._like.state.assembly.inputs.table
        self._journal.note(device, f"{bare}=0", **({bare: 0} if is_input else {}))

    def switch_power(self, owner: str, *, on: bool) -> None:
        """Have the supply of a device switched, of all if it is empty."""
        for device in [owner] if owner else self._plan.devices:
            self._operator_at(device).switch_power(on=on)
            if device in self._waiting:  # the test says itself what it is to have
                self._waiting.remove(device)
            self._journal.note(device, f"switched {'on' if on else 'off'}")
            if on:
                self._journal.record.was_reset(device)

    def sees(self, owner: str, text: str) -> bool | None:
        """Ask the human at a device, or at the first that has one; None if there is none."""
        for device in [owner] if owner else self._plan.devices:
            answer = self._operator_at(device).sees(text)
            if answer is not None:
                self._journal.note(device, f"{'seen' if answer else 'not seen'}: {text}")
                return answer
        return None

    def have_done(self, owner: str, text: str) -> bool:
        """Tell the human at a device, or the first that there is; False if there is none."""
        for device in [owner] if owner else self._plan.devices:
            if self._operator_at(device).have_done(text):
                self._journal.note(device, f"done: {text}")
                return True
        return False

    def _start(self, device: str, operator: _DeviceOperator) -> None:
        """Have the inputs as the rig file has them at the start; nobody's hand plays a signal."""
        start = self._plan.devices[device].start
        values = {key: each for key, each in start.items() if not isinstance(each, SignalSpec)}
        if values:
            operator.set_all(values)
            said = ", ".join(f"{name}={value}" for name, value in values.items())
            self._journal.note(device, said, **values)

    def _operator_of(self, device: str) -> _DeviceOperator:
        if path := self._where.control.get(device):
            return EmulatorOperator(path, self._plan.devices[device])
        power = self._where.power.get(device)
        switch = PowerSwitch(device, power) if power else None
        return HumanOperator(
            device, self._like.state.assembly.parts[device], self._terminal, switch
        )

    def _owner(self, name: str) -> tuple[str, str]:
        """Return the device of a signal, and its name there; ValueError if there is none."""
        assembly = self._like.state.assembly
        groups = assembly.inputs.groups
        if not (name in assembly.inputs.table or name in assembly.outputs or name in groups):
            names = [*assembly.inputs.table, *assembly.outputs]
            raise ValueError(f"no input or output {name!r}; {near(name, names)}")
        alone = len(assembly.parts) == 1
        device = next(iter(self._plan.devices)) if alone else name.partition("/")[0]
        return device, name.removeprefix(f"{device}/")

    def _fault_owner(self, name: str) -> tuple[str, str]:
        """Return who can make a fault, and its name there."""
        if name not in self._like.state.faults.fault_types:
            return self._owner(name)
        wire, _, bare = name.rpartition("/")
        if wire in self._plan.devices and wire not in self._plan.wires:
            return wire, name
        on_wire = self._plan.devices_on(wire or next(iter(self._plan.wires)))
        quick = [device.name for device in on_wire if self._operators[device.name].quick]
        return (quick or [on_wire[0].name])[0], bare

    def _operator_at(self, device: str) -> _DeviceOperator:
        if device not in self._operators:
            raise NotOnThisBench(f"nobody here is at {device}")
        return self._operators[device]
