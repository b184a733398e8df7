"""The operator of a device: inputs, buttons and faults by name."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar, Final, NamedTuple, Protocol

from tickrig.device.physical import InputSignal, OutputSignal, SignalType
from tickrig.device.twin import Copyable
from tickrig.emulators.rig.emulated import HasSignals, Inputs
from tickrig.emulators.rig.event_queue import EventQueue
from tickrig.emulators.rig.faults import FaultForm, bind_arguments, near_fault, spelled
from tickrig.host.text.names import near
from tickrig.host.text.values import Setting, parse_time_us
from tickrig.wire.instant import NEVER

# A fault in one word: `NAME[=ARGUMENT[,ARGUMENT]][@FROM[-TO]]`, as written in commands, rig files
# and tests.

_SPEC: Final = re.compile(r"([\w/]+)(?:=([^@]*))?(?:@([^-]*)(?:-(.*))?)?", re.ASCII)


@dataclass(frozen=True, slots=True)
class FaultSpec:
    """Specification of a fault that an operator starts: its name, its arguments and its times.

    Attributes:
        name: name of a fault of the wire, or of a physical fault of the device.
        arguments: arguments as written, which `bind_arguments` of rig/faults.py reads.
        from_us: start of the fault, in the rig's time.
        to_us: end of the fault, or `NEVER` if the fault stays until it is cleared.
    """

    name: str
    arguments: tuple[str, ...] = ()
    from_us: int = 0
    to_us: int = NEVER

    def __post_init__(self) -> None:
        """Raise ValueError if the time span is empty."""
        if self.to_us <= self.from_us:
            raise ValueError(f"fault {self.name} ends before it begins")

    @property
    def text(self) -> str:
        """Name and arguments in the notation of users.

        >>> FaultSpec("sdo_slow", ("1s", "rate=0.1")).text
        'sdo_slow=1s,rate=0.1'
        """
        return f"{self.name}={','.join(self.arguments)}" if self.arguments else self.name


def _any_name(name: str) -> None:
    """Accept any name."""


def parse_fault_spec(
    text: str, check_name: Callable[[str], object] = _any_name, now_us: int = 0
) -> FaultSpec:
    """Parse the text with which a user specifies a fault, such as `flip=0.001@5s-7s`.

    Args:
        text: name, arguments and times of the fault. Times with a plus sign, as in
            `cut@+100ms-+2s`, count from `now_us`.
        check_name: function that is called with the name before the times are read. It raises
            ValueError for an unknown fault.
        now_us: present time.

    Raises:
        ValueError: the text has a wrong form, or the name is unknown.

    >>> parse_fault_spec("flip=0.001@5s-7s")
    FaultSpec(name='flip', arguments=('0.001',), from_us=5000000, to_us=7000000)
    >>> parse_fault_spec("cut@+100ms", now_us=5_000_000).from_us
    5100000
    """
    match = _SPEC.fullmatch(text)
    if match is None:
        form = "NAME[=ARGUMENT[,ARGUMENT]][@FROM[-TO]]"
        raise ValueError(f"{text!r} is not a fault: write {form}, as cut@5s-7s")
    name, argument, start, stop = match.groups()
    try:
        check_name(name)
    except ValueError:
        names = (argument, f"{name}/{argument}")
        if argument is not None and any(_is_named(each, check_name) for each in names):
            text = f"{argument!r} is not a rate; the fault {argument} of {name} is {names[1]}"
            raise ValueError(text) from None
        raise
    return FaultSpec(
        name,
        () if argument is None else tuple(argument.split(",")),
        _time_us(start, now_us) if start is not None else 0,
        _time_us(stop, now_us) if stop is not None else NEVER,
    )


def _time_us(text: str, now_us: int) -> int:
    """Read a time since the start, or from now on: `+100ms`."""
    return now_us + parse_time_us(text[1:]) if text[:1] == "+" else parse_time_us(text)


def _is_named(name: str, check_name: Callable[[str], object]) -> bool:
    try:
        check_name(name)
    except ValueError:
        return False
    return True


# A scheduled fault, and its start.


@dataclass(slots=True)
class FaultOrder:
    """A fault that has been scheduled for a time, or for the moment when a condition becomes true.

    Attributes:
        spec: the fault with its full name.
        ordered_us: time at which the fault was scheduled.
        for_us: duration of the fault, or None to use the duration in `spec`.
        when: description of the condition, or empty if the fault waits for a time.
        due_us: start of the fault, or None while the fault waits for its condition.
        to_us: end of the fault, or `NEVER` if the fault stays until it is cleared.
    """

    spec: FaultSpec
    ordered_us: int
    for_us: int | None = None
    when: str = ""
    due_us: int | None = None
    to_us: int = NEVER

    def begin(self, now_us: int) -> FaultSpec:
        """Start the fault, because its time has come or its condition is true.

        Args:
            now_us: present time.

        Returns:
            The specification of the fault. Its attribute `to_us` contains the time at which the
            fault ends.
        """
        self.due_us = max(now_us, self.spec.from_us)
        self.to_us = self.spec.to_us if self.for_us is None else self.due_us + self.for_us
        return replace(self.spec, to_us=self.to_us)


PRESS_US: Final = 100_000
"""Default duration of a button press."""


_PHYSICAL: Final = FaultForm("", rated=False)
"""Arguments of a device fault, which is on or off and has no arguments."""


class WireFaults(Protocol):
    """Interface of an object at which faults are switched on by name ("armed").

    The object is a whole bus, or the `FaultyPort` of a line.
    """

    @property
    def fault_types(self) -> Mapping[str, FaultForm]:
        """The faults that can be armed."""
        ...

    @property
    def armed(self) -> Collection[str]:
        """Names of the armed faults."""
        ...

    def check(self, name: str, *arguments: str) -> None:
        """Raise ValueError unless the fault can be armed with these arguments."""

    def arm(self, name: str, *arguments: str) -> None:
        """Arm a fault; it replaces an armed fault of the same name."""

    def acted(self, name: str) -> int:
        """Return how often a fault has acted since it was last armed."""
        ...

    def clear(self, name: str) -> None:
        """Clear a fault; do nothing if the fault is not armed."""


# The faults of several wires and of their nodes in one table.


class AssemblyFaults(Copyable):
    """The faults of a rig with several wires, and with CANopen nodes on them, under unique names.

    A fault of a wire has the name `WIRE/fault`. With only one wire, the name is `fault` without the
    prefix. A fault of a node has the name `NODE/fault`. With only one device, the name is `fault`
    without the prefix, unless the wire has a fault of that name.

    Args:
        wires: wires by name.
        nodes: nodes by name.
        alone: name of the only device, or empty if there are several devices.
    """

    def __init__(
        self,
        wires: Mapping[str, WireFaults],
        nodes: Mapping[str, WireFaults] | None = None,
        alone: str = "",
    ) -> None:
        self._wires, self._nodes = dict(wires), dict(nodes or {})
        self._bare = next(iter(self._wires.values())) if len(self._wires) == 1 else None
        self._alone = self._nodes.get(alone)
        self.fault_types: Mapping[str, FaultForm] = _FaultTable(self)

    @property
    def wires(self) -> tuple[str, ...]:
        """Names of the faults."""
        return tuple(self._wires)

    def of_wire(self, wire: str) -> dict[str, str]:
        """Return the names that the faults of a wire have in this rig.

        Args:
            wire: name of the wire.

        Returns:
            A mapping. The keys are the names of the faults without a prefix, and the values are the
            names of the same faults in this rig, such as `WIRE/fault`.
        """
        bare = self._bare is not None
        return {
            fault: fault if bare else f"{wire}/{fault}" for fault in self._wires[wire].fault_types
        }

    def of_node(self, node: str) -> dict[str, str]:
        """Return the names that the faults of a node have in this rig.

        Args:
            node: name of the node.

        Returns:
            A mapping. The keys are the names of the faults without a prefix, and the values are the
            names of the same faults in this rig, such as `NODE/fault`. The mapping is empty for an
            unknown node.
        """
        held = self._nodes.get(node)
        if held is None:
            return {}
        on_wire = self._bare.fault_types if self._bare else {}
        bare = held is self._alone
        return {
            fault: fault if bare and fault not in on_wire else f"{node}/{fault}"
            for fault in held.fault_types
        }

    def names(self) -> Iterator[str]:
        """Yield all full names."""
        for wire in self._wires:
            yield from self.of_wire(wire).values()
        for node in self._nodes:
            yield from self.of_node(node).values()

    @property
    def armed(self) -> tuple[str, ...]:
        """Names of the armed faults."""
        of_wires = [self.of_wire(name)[x] for name, one in self._wires.items() for x in one.armed]
        of_nodes = [self.of_node(name)[x] for name, one in self._nodes.items() for x in one.armed]
        return (*of_wires, *of_nodes)

    def check(self, name: str, *arguments: str) -> None:
        """Raise ValueError unless the fault can be armed with these arguments."""
        holder, fault = self.find(name)
        holder.check(fault, *arguments)

    def arm(self, name: str, *arguments: str) -> None:
        """Arm a fault; it replaces an armed fault of the same name."""
        holder, fault = self.find(name)
        holder.arm(fault, *arguments)

    def acted(self, name: str) -> int:
        """Return how often a fault has acted since it was last armed."""
        holder, fault = self.find(name)
        return holder.acted(fault)

    def clear(self, name: str) -> None:
        """Clear a fault; do nothing if the fault is not armed."""
        holder, fault = self.find(name)
        holder.clear(fault)

    def find(self, name: str) -> tuple[WireFaults, str]:
        """Find the wire or the node that a fault belongs to.

        Args:
            name: name of the fault in this rig.

        Returns:
            Two values. The first is the object that contains the faults of this wire or node. The
            second is the name of the fault in this object.

        Raises:
            KeyError: no fault has this name.
        """
        owner, slash, fault = name.rpartition("/")
        holders = [self._bare, self._alone]
        if slash:
            of_wire = None if self._bare else self._wires.get(owner)
            holders = [of_wire, self._nodes.get(owner)]
        for holder in holders:
            if holder is not None and fault in holder.fault_types:
                return holder, fault
        raise KeyError(name)


class _FaultTable(Mapping[str, FaultForm]):
    """The faults by full name, created on request because there may be many nodes."""

    def __init__(self, faults: AssemblyFaults) -> None:
        self._faults = faults

    def __getitem__(self, name: str) -> FaultForm:
        holder, fault = self._faults.find(name)
        return holder.fault_types[fault]

    def __iter__(self) -> Iterator[str]:
        return self._faults.names()

    def __len__(self) -> int:
        return sum(1 for _ in self._faults.names())


def _ignore(text: str) -> None:
    """Notify no callback."""


def _at(action: Callable[[], None], now_us: int) -> None:
    """Run an action that does not depend on the time."""
    action()


# Several devices in one table: their signals; the faults of their wires are `AssemblyFaults`.


class Assembly(Copyable):
    """The physical inputs and outputs of several devices in one object, under unique names.

    If there is only one device, its signals have their plain names. With several devices a signal
    has the name of its device as prefix: `left_drive/shaft_load_nm`. The argument `plain` exempts
    one of the devices from the prefix.

    Args:
        parts: devices by name, at least one device.
        plain: name of the device whose signals have no prefix although there are several devices,
            or None if the signals of all devices have a prefix.
    """

    def __init__(self, parts: Mapping[str, HasSignals], plain: str | None = None) -> None:
        self.parts = dict(parts)
        self._plain = next(iter(self.parts)) if len(self.parts) == 1 else plain
        self.inputs = _AssemblyInputs(self)

    @property
    def tick_us(self) -> int:
        """The shortest control period."""
        return min(part.tick_us for part in self.parts.values())

    @property
    def outputs(self) -> Mapping[str, OutputSignal]:
        """Physical outputs of all devices."""
        if len(self.parts) == 1:  # asked in each `get`: a sixth of a run that looks often
            return next(iter(self.parts.values())).outputs
        return {
            full: replace(item, name=full)
            for name, part in self.parts.items()
            for item in part.outputs.values()
            for full in [self.full_name(name, item.name)]
        }

    def read(self, name: str, /) -> Setting:
        """Return the present value of an output; raise KeyError if the name is unknown."""
        part, rest = self.find(name)
        if part is None:
            raise KeyError(name)
        return part.read(rest)

    def full_name(self, part: str, name: str) -> str:
        """Return the full name of a signal of a device."""
        return name if part == self._plain else f"{part}/{name}"

    def find(self, name: str) -> tuple[HasSignals | None, str]:
        """Find the device that a signal belongs to.

        Args:
            name: name of the signal, with or without the prefix of its device.

        Returns:
            Two values. The first is the device, or None if no device has the signal. The second is
            the name without the prefix.
        """
        prefix, slash, rest = name.partition("/")
        if slash and (part := self.parts.get(prefix)):
            return part, rest
        return self.parts.get(self._plain or ""), name

    def tick_us_of(self, name: str) -> int:
        """Return the control period of the device that a signal belongs to."""
        part, _ = self.find(name)
        return part.tick_us if part else self.tick_us


class _AssemblyInputs(Copyable):
    """The `Inputs` of several devices.

    Args:
        assembly: the devices.

    Attributes:
        changed: attribute that is not used, because each device checks `changed` of its own inputs.
    """

    def __init__(self, assembly: Assembly) -> None:
        self._assembly, self.changed = assembly, False

    @property
    def table(self) -> Mapping[str, InputSignal]:
        """All inputs by full name."""
        return _Table(self._assembly)

    @property
    def groups(self) -> Mapping[str, tuple[str, ...]]:
        """Names of the inputs that are set together, by name of their group."""
        full = self._assembly.full_name
        return {
            full(name, group): tuple(full(name, member) for member in members)
            for name, part in self._assembly.parts.items()
            for group, members in part.inputs.groups.items()
        }

    def __getitem__(self, name: str) -> Setting:
        """Return the present value of an input."""
        part, rest = self._find(name)
        return part.inputs[rest]

    def set(self, name: str, value: Setting) -> None:
        """Set a physical input of one of the devices.

        Raises:
            ValueError: the input is unknown, or does not accept the value.
        """
        part, rest = self._find(name)
        part.inputs.set(rest, value)

    def check(self, name: str, value: Setting) -> Setting:
        """Return the value that `set` would store, or raise as `set` would."""
        part, rest = self._find(name)
        return part.inputs.check(rest, value)

    def names(self, signal_type: SignalType) -> tuple[str, ...]:
        """Return the names of all inputs of a type."""
        return tuple(
            self._assembly.full_name(name, item)
            for name, part in self._assembly.parts.items()
            for item in part.inputs.names(signal_type)
        )

    def find(self, name: str, signal_type: SignalType | None = None) -> InputSignal:
        """Return the description of a physical input of one of the devices.

        Raises:
            ValueError: no input has the name and the type.
        """
        part, rest = self._assembly.find(name)
        if part is not None:
            return part.inputs.find(rest, signal_type)
        names = self.names(signal_type) if signal_type else self.table
        wanted = signal_type.value if signal_type else "input"
        raise ValueError(f"no {wanted} {name!r}; {near(name, names)}")

    def _find(self, name: str) -> tuple[HasSignals, str]:
        part, rest = self._assembly.find(name)
        if part is None or rest not in part.inputs.table:
            raise ValueError(f"no input {name!r}; {near(name, self.table)}")
        return part, rest


class _Table(Mapping[str, InputSignal]):
    """The descriptions, created on request because nodes have many objects."""

    def __init__(self, assembly: Assembly) -> None:
        self._assembly = assembly

    def __getitem__(self, name: str) -> InputSignal:
        part, rest = self._assembly.find(name)
        if part is None:
            raise KeyError(name)
        item = part.inputs.table[rest]
        return replace(item, name=name.removesuffix(rest) + item.name)

    def __contains__(self, name: object) -> bool:
        part, rest = self._assembly.find(name) if isinstance(name, str) else (None, "")
        return part is not None and rest in part.inputs.table

    def __iter__(self) -> Iterator[str]:
        full = self._assembly.full_name
        parts = self._assembly.parts.items()
        return (full(name, item) for name, part in parts for item in part.inputs.table)

    def __len__(self) -> int:
        return sum(len(part.inputs.table) for part in self._assembly.parts.values())


class _FaultRow(NamedTuple):
    """The status of a fault of a running emulator.

    Attributes:
        name: name of the fault.
        text: description of the fault.
        arguments: arguments of the latest arming by name, or the defaults of the fault.
        on: whether the fault is active.
        since_us: start of the fault, or None if it is off or was not ordered.
        acted: number of actions of the fault since it was last armed, or None for a fault of the
            device, which acts continuously.
    """

    name: str
    text: str
    arguments: Mapping[str, str]
    on: bool
    since_us: int | None
    acted: int | None


class Operator(Copyable):
    """Acts on an emulated device as a person would: sets inputs, presses buttons, starts faults.

    An action takes effect in the next tick, but not before the time `now_us` of the action. Each
    press of a button lasts for at least one tick.

    Args:
        inputs: the physical inputs of the device.
        tick_us: the device's control period.
        event_queue: queue for releases of buttons and for scheduled faults.
        wire: the port at which faults of the wire are switched on.
        note: function that is called with a text for each change, such as `power_button=1`.
    """

    _new_in_twins: ClassVar[Mapping[str, object]] = {"note": _ignore}

    def __init__(
        self,
        inputs: Inputs,
        tick_us: int,
        event_queue: EventQueue,
        wire: WireFaults,
        note: Callable[[str], None] = _ignore,
    ) -> None:
        self._inputs, self._tick_us, self._event_queue, self._wire = (
            inputs,
            tick_us,
            event_queue,
            wire,
        )
        self.note = note
        self._begun: dict[str, tuple[int, tuple[str, ...]]] = {}
        """Start and arguments of each active fault."""

        self._spans: dict[str, dict[int, int]] = {}
        """Start and end of the scheduled faults, by name of the fault."""

    def set(self, name: str, *values: Setting) -> None:
        """Set a physical input of the device, or all inputs of a group.

        Raises:
            ValueError: the input or group is unknown, the number of values is wrong, or a value is
                out of range.
        """
        for member, value in self.check_set(name, *values):
            self._event_queue.drop(("release", member))
            self._drop_fault(member)
            self._put(member, value)

    def check_set(self, name: str, *values: Setting) -> list[tuple[str, Setting]]:
        """Return the values that `set` would set, by input, or raise as `set` does."""
        groups = self._inputs.groups
        if name not in groups and name not in self._inputs.table:
            raise ValueError(f"no input {name!r}; {near(name, [*groups, *self._inputs.table])}")
        members = groups.get(name, (name,))
        if len(values) != len(members):
            what = "one value" if len(members) == 1 else f"{len(members)} values"
            raise ValueError(f"{name} takes {what} ({', '.join(members)}), got {len(values)}")
        pairs = list(zip(members, values, strict=True))
        for member, value in pairs:
            self._inputs.check(member, value)
        return pairs

    def press(self, now_us: int, name: str, duration_us: int = PRESS_US) -> None:
        """Press a button of the device, and release it after a time.

        Args:
            now_us: present time.
            name: name of the button.
            duration_us: time after which the button is released.

        Raises:
            ValueError: the name is not that of a button.
        """
        self.check_press(name, duration_us)
        self._put(name, 1)
        tick_us = self._tick_us_of(name)
        seen_us = -(-now_us // tick_us) * tick_us
        self._event_queue.put(
            ("release", name), seen_us + duration_us, partial(_at, partial(self._put, name, 0))
        )

    def _tick_us_of(self, name: str) -> int:
        """Return the control period of the device that an input belongs to."""
        return self._tick_us

    def check_press(self, name: str, duration_us: int = PRESS_US) -> None:
        """Raise ValueError unless `press` is possible."""
        buttons = self._inputs.names(SignalType.BUTTON)
        if name not in buttons:
            raise ValueError(f"no button {name!r}; {near(name, buttons)}")
        if duration_us < 1:
            raise ValueError(f"a press lasts at least 1 us, not {duration_us} us")

    def release(self, name: str) -> None:
        """Release a button; raise ValueError if it is not a button."""
        self.check_press(name)
        self.set(name, 0)

    def fault(self, now_us: int, spec: FaultSpec) -> None:
        """Start a fault, now or at its time.

        The fault replaces faults of the same name at overlapping times.

        Args:
            now_us: present time.
            spec: name, arguments and times of the fault.

        Raises:
            ValueError: the fault is unknown, does not accept the arguments, or would have ended
                already.
        """
        spec = replace(spec, name=self.full_name_of(spec.name))
        self.check_fault(spec)
        if spec.to_us <= now_us:
            raise ValueError(f"fault {spec.name} would have ended before now")
        self._drop_fault(spec.name, max(now_us, spec.from_us), spec.to_us)
        key = spec.name, spec.from_us
        self._spans.setdefault(spec.name, {})[spec.from_us] = spec.to_us
        if spec.from_us > now_us:
            begin = partial(self._begin, spec)
            self._event_queue.put(("begin", *key), spec.from_us, begin)
        else:
            self._begin(spec, now_us)
        if spec.to_us != NEVER:
            end = partial(_at, partial(self._end_span, spec))
            self._event_queue.put(("end", *key), spec.to_us, end)

    def check_fault(self, spec: FaultSpec) -> None:
        """Raise ValueError unless the fault exists and accepts these arguments."""
        self.check_clear(spec.name)
        if self.full_name_of(spec.name) in self._wire.fault_types:
            self._wire.check(spec.name, *spec.arguments)
        else:
            bind_arguments(spec.name, _PHYSICAL, spec.arguments)

    def clear(self, name: str) -> None:
        """End a fault, or cancel it if it is scheduled.

        Raises:
            ValueError: no fault has this name.
        """
        self.check_clear(name)
        name = self.full_name_of(name)
        self._drop_fault(name)
        self._end(name)

    def check_clear(self, name: str) -> None:
        """Raise ValueError unless a fault of this name exists."""
        if self.full_name_of(name) not in self.faults:
            raise ValueError(
                f"no fault {name!r}; {near_fault(name, self.faults, self._inputs.table)}"
            )

    def full_name_of(self, name: str) -> str:
        """Return the name of a fault as the attribute `faults` contains it.

        If there is only one node, the name `NODE/fault` becomes `fault`. Other names are returned
        unchanged.
        """
        bare = name.rpartition("/")[2]
        more = bare != name and name in self._wire.fault_types and name not in self.faults
        return bare if more else name

    @property
    def faults(self) -> tuple[str, ...]:
        """Names of all faults of the wire and of the device."""
        return (*self._wire.fault_types, *self._inputs.names(SignalType.FAULT))

    @property
    def active_faults(self) -> tuple[str, ...]:
        """Names of the active faults."""
        armed = self._wire.armed
        return tuple(f for f in self.faults if f in armed or self._inputs_fault(f))

    def fault_rows(self) -> list[_FaultRow]:
        """Return the status of each fault."""
        present = frozenset(self.active_faults)
        return [self._row(name, on=name in present) for name in self.faults]

    def _row(self, name: str, *, on: bool) -> _FaultRow:
        since_us, words = self._begun.get(name, (None, ())) if on else (None, ())
        form = self._wire.fault_types.get(name)
        if form is None:
            return _FaultRow(name, self._inputs.table[name].text, {}, on, since_us, None)
        given = spelled(name, form, words)
        arguments = {each.name: given.get(each.name, each.default) for each in form.all_arguments}
        return _FaultRow(name, form.text, arguments, on, since_us, self._wire.acted(name))

    def _inputs_fault(self, name: str) -> bool:
        return name in self._inputs.table and bool(self._inputs[name])

    def _drop_fault(self, name: str, from_us: int = 0, to_us: int = NEVER) -> None:
        """Cancel the scheduled occurrences of a fault that overlap a time span (by default all)."""
        spans = self._spans.get(name, {})
        for begin_us, end_us in tuple(spans.items()):
            if begin_us < to_us and from_us < end_us:
                self._event_queue.drop(("begin", name, begin_us))
                self._event_queue.drop(("end", name, begin_us))
                del spans[begin_us]

    def _begin(self, spec: FaultSpec, now_us: int) -> None:
        self._begun[spec.name] = now_us, spec.arguments
        if spec.name in self._wire.fault_types:
            self._wire.arm(spec.name, *spec.arguments)
            self.note(spec.text)
        else:
            self._put(spec.name, 1)

    def _end_span(self, spec: FaultSpec) -> None:
        """Clear a fault, unless it starts again at once."""
        spans = self._spans[spec.name]
        del spans[spec.from_us]
        if spec.to_us not in spans:
            self._end(spec.name)

    def _end(self, name: str) -> None:
        self._begun.pop(name, None)
        if name in self._wire.fault_types:
            if name in self._wire.armed:
                self._wire.clear(name)
                self.note(f"{name}=0")
        else:
            self._put(name, 0)

    def _put(self, name: str, value: Setting) -> None:
        self._inputs.set(name, value)
        self.note(f"{name}={value}")
