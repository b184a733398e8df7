"""Operators of real devices, human or emulator, and their requests."""

from __future__ import annotations

import subprocess
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import IO, Any, Final

from tickrig.device.physical import InputSignal, SignalType
from tickrig.emulators.bench.operator import AssemblyFaults, FaultOrder, FaultSpec, Operator
from tickrig.emulators.rig.emulated import HasSignals
from tickrig.emulators.rig.event_queue import EventQueue
from tickrig.emulators.testing.bench import errors
from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.emulators.testing.bench.modes.door_journal import DoorJournal
from tickrig.emulators.testing.bench.modes.mode import POWER
from tickrig.emulators.testing.rig_file.plan import DevicePlan, HardwarePlan, PowerPlan, RigPlan
from tickrig.emulators.testing.signals.sources import SignalSpec
from tickrig.host.control.client import TIMEOUT_S, ControlClient, ControlRefused
from tickrig.host.control.requests import Object
from tickrig.host.links.ready import ready
from tickrig.host.text.names import known, near
from tickrig.host.text.page_text import harmless
from tickrig.host.text.values import Setting, format_time, parse_setting
from tickrig.wire.instant import NEVER

# A device that is switched by commands.

_SWITCH_S: Final = 30.0
"""Time-out of a command that switches a device."""


class _PowerSwitch:
    """Switches a device by the commands of a rig file.

    Args:
        device: name of the device.
        plan: commands of the rig file.
    """

    def __init__(self, device: str, plan: PowerPlan) -> None:
        self._device, self._plan = device, plan

    def switch(self, *, on: bool) -> None:
        """Switch the supply of a device on or off, by the command in the rig file.

        Raises:
            BenchBlocked: the command cannot be run, has failed, or did not end.
        """
        command = self._plan.on if on else self._plan.off
        try:
            done = subprocess.run(
                command,
                stdin=subprocess.DEVNULL,
                capture_output=True,
                timeout=_SWITCH_S,
                check=False,
            )
        except OSError as error:
            raise self._blocked(on, error.strerror or str(error)) from None
        except subprocess.TimeoutExpired:
            raise self._blocked(on, f"has not ended after {_SWITCH_S:g} s") from None
        if done.returncode:
            said = done.stderr.decode("utf-8", "replace").strip().split("\n")[-1]
            raise self._blocked(on, f"exit status {done.returncode}{said and f': {said}'}")

    def _blocked(self, on: bool, why: str) -> errors.BenchBlocked:
        state, command = ("on", self._plan.on) if on else ("off", self._plan.off)
        return errors.BenchBlocked(
            f"{self._device} was not switched {state}: {' '.join(command)}: {why}"
        )


# Requests and questions to a human at the terminal.

_TERMINAL: Final = "/dev/tty"
_POLL_US: Final = 10_000
_DONE: Final = "then press Enter (n: not done, c: cannot be done)"


class Terminal:
    """Asks a human at the terminal, even if standard input and output are redirected.

    Therefore a question reaches the human although pytest captures input and output. Hosts keep
    running while the human is asked.

    Args:
        path: path of the terminal device.

    Attributes:
        hosts: functions that run the hosts while the human has not answered. They are called in
            turn. The argument is the time for which the host runs, in microseconds.
    """

    def __init__(self, path: str = _TERMINAL) -> None:
        self._path = path
        self.hosts: list[Callable[[int], object]] = []

    def prompt(self, text: str) -> str:
        """Show a text at the terminal, and return the line that the human types.

        Raises:
            OperatorRefused: there is no terminal.
        """
        try:
            with open(self._path, "r+b", buffering=0) as terminal:
                terminal.write(f"\n{harmless(text)} ".encode())
                while not self._is_typed(terminal):
                    for host in self.hosts:
                        host(_POLL_US)
                line = terminal.readline()
        except OSError as error:
            raise errors.OperatorRefused(f"there is no terminal ({error.strerror})") from None
        if not line:
            raise errors.OperatorRefused("the terminal was closed (end of input)")
        return line.decode("utf-8", "replace").strip()

    def have_done(self, text: str) -> None:
        """Ask the human to do an action at the device, and wait for the confirmation.

        Args:
            text: the action, as a sentence without its full stop.

        Raises:
            OperatorRefused: the human did not do the action.
            NotOnThisBench: the human answered that the action is impossible.
        """
        while answer := self.prompt(f"{text}, {_DONE}:").lower():
            if answer == "n":
                raise errors.OperatorRefused(f"the operator did not do this: {text}")
            if answer == "c":
                raise errors.NotOnThisBench(f"the operator cannot do this: {text}")

    def sees(self, question: str) -> bool:
        """Ask a yes/no question."""
        while (answer := self.prompt(f"{question} [y/n]").lower()) not in ("y", "n"):
            continue
        return answer == "y"

    def _is_typed(self, terminal: IO[bytes]) -> bool:
        wait_s = 0 if self.hosts else _POLL_US / 1e6
        return bool(ready([terminal], wait_s=wait_s)[0])


_HOLD_US: Final = 1_000_000
"""Shortest press whose duration is shown to the human."""


class _HumanOperator:
    """The operator of a device: a human at the terminal, with the texts of the device type.

    The operator is not asked twice for the same set value. Names have no prefix of the device.

    Args:
        device: name of the device.
        physical: equivalent emulated device, for its tables and set values.
        terminal: terminal of the human.
        power: switch of the device, or None if the human switches the device.

    Attributes:
        late_us: largest known delay of the device.
        quick: whether the operator acts without delay.
        said_no: whether the human answered no. This answer is valid even if the machine was too
            slow.
    """

    late_us, quick = 0, False

    def __init__(
        self,
        device: str,
        physical: HasSignals,
        terminal: Terminal,
        power: _PowerSwitch | None = None,
    ) -> None:
        self._device, self._physical, self._terminal = device, physical, terminal
        self._power, self.said_no = power, False
        no_faults = AssemblyFaults({})
        self._record = Operator(physical.inputs, physical.tick_us, EventQueue(), no_faults)

    def prepare(self, like: HasSignals) -> None:
        """Switch the device off, if a command can; a human is not asked."""
        if self._power is not None:
            self._power.switch(on=False)

    def begin(self) -> None:
        """Switch the device on, if a command can."""
        if self._power is not None:
            self._power.switch(on=True)

    def set(self, name: str, values: tuple[Setting, ...]) -> None:
        """Ask to set and hold an input, or all inputs of a group."""
        pairs = self._record.check_set(name, *values)
        wanted = [self._wish(self._physical.inputs.table[member], value) for member, value in pairs]
        self.have_done(f"{' and '.join(wanted)}, and leave it so")
        self._record.set(name, *values)

    def set_all(self, values: Mapping[str, Setting]) -> None:
        """Ask to set and hold several inputs together."""
        table = self._physical.inputs.table
        wanted = [self._wish(table[name], value) for name, value in values.items()]
        self.have_done(f"{' and '.join(wanted)}, and leave it so")
        for name, value in values.items():
            self._record.set(name, value)

    def get(self, name: str) -> Setting:
        """Return the value of an input or output of a real device.

        The value of an input is the value that was last set. For the value of an output, the human
        is asked.
        """
        if name in self._physical.inputs.table:
            return self._physical.inputs[name]
        output = self._physical.outputs.get(name)
        if output is None:
            names = [*self._physical.outputs, *self._physical.inputs.table]
            raise ValueError(f"no input or output {name!r}; {near(name, names)}")
        unit = f" in {output.unit}" if output.unit else ""
        while True:
            text = self._terminal.prompt(
                f"{self._device}: what is {name} now{unit}? ({output.text})"
            )
            value = parse_setting(text)
            if text and not (output.unit and isinstance(value, str)):
                return value

    def press(self, name: str, duration_us: int) -> None:
        """Ask to press and release a button."""
        text = self._physical.inputs.find(name, SignalType.BUTTON).text
        held = f", hold it for {duration_us / 1e6:g} s" if duration_us >= _HOLD_US else ""
        self.have_done(f"press the {text}{held} and let it go")

    def fault(self, spec: FaultSpec, now_us: int, for_us: int | None) -> None:
        """Ask the human to make a physical fault at the device.

        Raises NotOnThisBench for a fault of the wire, or for a fault at a given time.
        """
        item = self._find_fault(spec.name)
        if (spec.arguments, spec.from_us, spec.to_us, for_us) != ((), 0, NEVER, None):
            raise errors.NotOnThisBench(f"no hand makes {spec.name} at a certain time")
        self.have_done(f"make this fault: {item.text} ({item.name})")
        self._record.set(spec.name, 1)

    def clear(self, fault: str) -> None:
        """Ask to clear a physical fault."""
        item = self._find_fault(fault)
        self.have_done(f"clear this fault: {item.text} ({item.name})")
        self._record.set(fault, 0)

    def sees(self, text: str) -> bool | None:
        """Ask for an observation."""
        seen = self._terminal.sees(f"{self._device}: is it so? {text}")
        self.said_no |= not seen
        return seen

    def have_done(self, text: str) -> bool:
        """Ask for an action described in words."""
        self._terminal.have_done(f"{self._device}: {text}")
        return True

    def switch_power(self, *, on: bool) -> None:
        """Switch the supply by a command, or ask the human to switch it."""
        if self._power is not None:
            self._power.switch(on=on)
        else:
            self.have_done(f"switch it {'on' if on else 'off'}")

    def close(self) -> None:
        """Do nothing: there are no resources."""

    def _find_fault(self, name: str) -> InputSignal:
        if name not in self._physical.inputs.table:
            raise errors.NotOnThisBench(
                f"no hand can make {name}: it changes what passes on the wire, which an emulator"
                " alone can (key control of [hardware])"
            )
        return self._physical.inputs.find(name, SignalType.FAULT)

    def _wish(self, item: InputSignal, value: Setting) -> str:
        """Return the request for the new value of an input."""
        if item.type is SignalType.FAULT:
            return f"{'make' if value else 'clear'} this fault: {item.text}"
        if item.type is SignalType.BUTTON:
            return f"{'press' if value else 'release'} the {item.text}"
        unit = f" {item.unit}" if item.unit else ""
        return f"set {item.name} ({item.text}) to {value}{unit}"


# An emulator in place of a real device, operated by its control socket.

_NO_ANSWER_US: Final = round(TIMEOUT_S * 1e6)
"""Delay reported for an emulator that does not answer."""

_OBJECT: Final = "0x"
"""Prefix of dictionary objects, which are reset at power-on."""


class _EmulatorOperator:
    """The operator of a device: the control socket of an emulator.

    Names have no prefix of the device, as for a human operator.

    Args:
        path: path of the control socket.
        plan: plan of the device. An emulator of several devices has the device under its name or
            node-ID.

    Raises:
        PortGone: the emulator is not running.
        MachineTooSlow: the emulator does not answer.
        ValueError: the emulator has several devices, but not the device of the plan.
    """

    said_no, quick = False, True

    def __init__(self, path: Path, plan: DevicePlan) -> None:
        self._path, self._lock = path, threading.RLock()
        try:
            self._client = ControlClient(path)
        except OSError as error:
            raise errors.PortGone(f"{plan.name}: no emulator at {path}: {error.strerror}") from None
        described = self._request("describe")
        inputs, outputs, wire_faults = (
            _names_of(described, key) for key in ("inputs", "outputs", "wire_faults")
        )
        self._prefix, self._wire = _prefix_of(plan, inputs | outputs, path), plan.wire
        self._name = plan.name
        self._inputs, self._tick_us = inputs | wire_faults, int(str(described["tick_us"]))
        self._wire_faults = [name for name in wire_faults if self._is_of_wire(name)]
        self._begun_us = self._now_us

    @property
    def late_us(self) -> int:
        """Largest delay of a step since the start; 0 if the emulator is gone."""
        try:
            late_us = self._request("status", since=self._begun_us)["late_us"]
        except errors.MachineTooSlow:
            return _NO_ANSWER_US
        except errors.PortGone:
            return 0
        assert isinstance(late_us, int)
        return late_us

    def prepare(self, like: HasSignals) -> None:
        """Prepare the device for a test: clear all faults, and reset all inputs.

        The inputs get their initial values, and the device is switched off. The physical state of
        the device stays as it is, for example the position of a drive.

        Args:
            like: emulated device of the same type, from which the initial values are read.
        """
        for name in self._wire_faults:
            self._request("clear", name=name)
        for item in like.inputs.table.values():
            if self._prefix + item.name not in self._inputs or item.name.startswith(_OBJECT):
                continue
            if item.type is SignalType.FAULT:
                self.clear(item.name)
            elif item.name not in POWER and self.get(item.name) != like.inputs[item.name]:
                self.set(item.name, (like.inputs[item.name],))
        if self._power is not None:
            self.switch_power(on=False)
        self._off_us = self._now_us

    def begin(self) -> None:
        """Switch the device on after it has been without power."""
        if self._power is None:
            return
        while self._now_us < self._off_us + 2 * self._tick_us:
            time.sleep(self._tick_us / 1e6)
        self.switch_power(on=True)

    def set(self, name: str, values: tuple[Setting, ...]) -> None:
        """Set an input, or all inputs of a group."""
        self._request("set", name=self._prefix + name, value=list(values))

    def set_all(self, values: Mapping[str, Setting]) -> None:
        """Do nothing, because `prepare` has already set the inputs."""

    def get(self, name: str) -> Setting:
        """Return the present value of an input or output."""
        full = self._prefix + name
        values = self._request("get", names=[full])["values"]
        assert isinstance(values, dict)
        value: Setting = values[full]
        return value

    def press(self, name: str, duration_us: int) -> None:
        """Press and release a button."""
        self._request("press", name=self._prefix + name, duration_us=duration_us)

    def fault(self, spec: FaultSpec, now_us: int, for_us: int | None) -> None:
        """Start a fault, in the time of the emulator."""
        text = replace(spec, name=self._fault_name(spec.name)).text
        timed = (spec.from_us, spec.to_us, for_us) != (0, NEVER, None)
        if timed:
            ahead_us = self._now_us - now_us
            from_us = max(spec.from_us, now_us)
            to_us = spec.to_us if for_us is None else from_us + for_us
            text += f"@{format_time(from_us + ahead_us)}s"
            text += "" if to_us == NEVER else f"-{format_time(to_us + ahead_us)}s"
        self._request("fault", spec=text)

    def clear(self, fault: str) -> None:
        """Clear a fault."""
        self._request("clear", name=self._fault_name(fault))

    def sees(self, text: str) -> bool | None:
        """Return None: the emulator answers."""
        return None

    def have_done(self, text: str) -> bool:
        """Return False: an emulator cannot follow a description in words."""
        return False

    def switch_power(self, *, on: bool) -> None:
        """Switch the supply."""
        if self._power is None:
            raise errors.NotOnThisBench("this device has no input that is its supply")
        self.set(self._power, (POWER[self._power] if on else 1 - POWER[self._power],))

    def close(self) -> None:
        """Close the connection."""
        self._client.close()

    def _fault_name(self, name: str) -> str:
        own = f"{self._name}/"
        if name.startswith(own):  # of the node alone, not of its bus
            bare = name.removeprefix(own)
            names: tuple[str, ...] = (self._prefix + bare, name, bare)
        else:
            names = (f"{self._wire}/{name}", name, self._prefix + name)
        return next((full for full in names if full in self._inputs), name)

    def _is_of_wire(self, fault: str) -> bool:
        return "/" not in fault or fault.startswith((f"{self._wire}/", self._prefix))

    @property
    def _power(self) -> str | None:
        """The input for the supply of the device, or None if the device has no such input."""
        return next((name for name in POWER if self._prefix + name in self._inputs), None)

    @property
    def _now_us(self) -> int:
        now_us = self._request("status")["now_us"]
        assert isinstance(now_us, int)
        return now_us

    def _request(self, do: str, **fields: object) -> Object:
        try:
            with self._lock:
                return self._client.request(do, **fields)
        except ControlRefused:
            raise
        except TimeoutError:
            text = f"the emulator at {self._path} has not answered for {TIMEOUT_S:g} s"
            raise errors.MachineTooSlow(text) from None
        except (OSError, ValueError) as error:
            raise errors.PortGone(f"the emulator at {self._path} is gone: {error}") from None


def _names_of(found: Object, key: str) -> frozenset[str]:
    items = found[key]
    assert isinstance(items, list)
    return frozenset(item["name"] for item in items)


def _prefix_of(plan: DevicePlan, names: frozenset[str], path: Path) -> str:
    """Return the prefix of an emulator for the names of a device."""
    owners = {name.partition("/")[0] for name in names if "/" in name}
    for name in (plan.name, str(plan.node_id)):
        if name in owners:
            return f"{name}/"
    if names and all("/" in name for name in names):
        raise ValueError(f"the emulator at {path} has no {plan.name!r}; known: {known(owners)}")
    return ""


# The operator of one real device.


_DeviceOperator = _HumanOperator | _EmulatorOperator


class Operators:
    """Sets inputs, reads outputs and starts faults of real devices.

    A human at the terminal is asked to do this by hand. If an emulator in another process stands in
    for a real device, the requests are instead sent to the control socket of the emulator.

    Args:
        plan: content of the rig file.
        where: section of the rig file for real devices.
        like: emulated devices with the same names and types, for the names of inputs, outputs and
            faults. These devices do not run.
        terminal: terminal of the human.
        journal: journal that records the actions.

    Raises:
        PortGone: an emulator that stands in for a device is missing.
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
        """Switch on the devices that have been reset."""
        for device in self._waiting:
            self._operators[device].begin()
        self._waiting.clear()

    @property
    def said_no(self) -> bool:
        """Whether a human answered no."""
        return any(operator.said_no for operator in self._operators.values())

    @property
    def late_us(self) -> int:
        """Largest delay of the devices."""
        return max((operator.late_us for operator in self._operators.values()), default=0)

    def close(self) -> None:
        """Release all operators."""
        for operator in self._operators.values():
            operator.close()

    def request(self, do: str, fields: dict[str, Any]) -> Object:
        """Execute a request of a control socket; raise ValueError if the request is refused."""
        match do:
            case "set":
                self._set(fields["name"], fields["value"])
            case "press":
                self._press(fields["name"], fields["duration_us"])
            case "get":
                return {"values": {name: self._get(name) for name in fields["names"]}}
            case _:
                raise errors.NotOnThisBench(f"real devices do not answer {do!r}")
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
        """Return a function that starts a fault.

        The argument of the returned function is the present time of the bench, in microseconds.

        Args:
            owner: name of the device or wire with the fault, or empty if the fault may belong to
                any.
            order: requested fault. The name in `order.spec` is replaced by the full name of the
                fault.

        Raises:
            NotOnThisBench: the fault begins when a condition is true, but a human operates the
                device, and is too slow for this.
        """
        name = self._like.state.full_fault_name(owner, order.spec.name)
        spec = order.spec = replace(order.spec, name=name)
        self._like.operator.check_fault(spec)
        device, fault = self._fault_owner(name)
        operator, wanted = self._operator_at(device), replace(spec, name=fault)
        is_input = name in self._like.state.assembly.inputs.table
        if order.when and not operator.quick:
            raise errors.NotOnThisBench(f"no hand makes {fault} the moment that something is so")

        def begin(now_us: int) -> None:
            order.begin(now_us)
            operator.fault(wanted, now_us, order.for_us)
            said = wanted.text
            lasts = (spec.from_us, spec.to_us, order.for_us) == (0, NEVER, None)
            self._journal.note(device, said, **({fault: 1} if is_input and lasts else {}))

        return begin

    def clear(self, owner: str, fault: str) -> None:
        """Clear a fault."""
        name = self._like.state.full_fault_name(owner, fault)
        device, bare = self._fault_owner(name)
        self._operator_at(device).clear(bare)
        is_input = name in self._like.state.assembly.inputs.table
        self._journal.note(device, f"{bare}=0", **({bare: 0} if is_input else {}))

    def switch_power(self, owner: str, *, on: bool) -> None:
        """Switch the supply of a device, or of all devices if `owner` is empty."""
        for device in [owner] if owner else self._plan.devices:
            self._operator_at(device).switch_power(on=on)
            if device in self._waiting:  # the test says itself what it is to have
                self._waiting.remove(device)
            self._journal.note(device, f"switched {'on' if on else 'off'}")
            if on:
                self._journal.record.was_reset(device)

    def sees(self, owner: str, text: str) -> bool | None:
        """Return a human's answer whether something is observed, or None if there is no human.

        Args:
            owner: name of the device whose operator is asked, or empty for the first device with a
                human.
            text: description of the observation.
        """
        for device in [owner] if owner else self._plan.devices:
            answer = self._operator_at(device).sees(text)
            if answer is not None:
                self._journal.note(device, f"{'seen' if answer else 'not seen'}: {text}")
                return answer
        return None

    def have_done(self, owner: str, text: str) -> bool:
        """Ask a human to do an action; return False if there is no human.

        Args:
            owner: name of the device whose operator is asked, or empty for the first device with a
                human.
            text: description of the action.
        """
        for device in [owner] if owner else self._plan.devices:
            if self._operator_at(device).have_done(text):
                self._journal.note(device, f"done: {text}")
                return True
        return False

    def _start(self, device: str, operator: _DeviceOperator) -> None:
        """Set the initial inputs of the rig file; operators cannot play signals."""
        start = self._plan.devices[device].start
        values = {key: each for key, each in start.items() if not isinstance(each, SignalSpec)}
        if values:
            operator.set_all(values)
            said = ", ".join(f"{name}={value}" for name, value in values.items())
            self._journal.note(device, said, **values)

    def _operator_of(self, device: str) -> _DeviceOperator:
        if path := self._where.control.get(device):
            return _EmulatorOperator(path, self._plan.devices[device])
        power = self._where.power.get(device)
        switch = _PowerSwitch(device, power) if power else None
        return _HumanOperator(
            device, self._like.state.assembly.parts[device], self._terminal, switch
        )

    def _owner(self, name: str) -> tuple[str, str]:
        """Return the device of a signal, and the name without prefix; ValueError if unknown."""
        assembly = self._like.state.assembly
        groups = assembly.inputs.groups
        if not (name in assembly.inputs.table or name in assembly.outputs or name in groups):
            names = [*assembly.outputs, *assembly.inputs.table]
            raise ValueError(f"no input or output {name!r}; {near(name, names)}")
        alone = len(assembly.parts) == 1
        device = next(iter(self._plan.devices)) if alone else name.partition("/")[0]
        return device, name.removeprefix(f"{device}/")

    def _fault_owner(self, name: str) -> tuple[str, str]:
        """Return the operator that can make a fault, and the fault's name without prefix."""
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
            raise errors.NotOnThisBench(f"there is no operator of {device}")
        return self._operators[device]
