"""Several devices under one roof: their signals, and the faults of their wires."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from tickrig.device.physical import InputSignal, OutputSignal, SignalType
from tickrig.device.twin import Copyable
from tickrig.emulators.bench.operator import WireFault, WireFaults
from tickrig.emulators.rig.emulated import HasSignals
from tickrig.host.text.names import near
from tickrig.host.text.values import Setting


class Assembly(Copyable):
    """The physical side of several devices.

    The signals of one device are called as they are, those of several have the device
    before them: `left_drive/shaft_load_nm`.

    Args:
        parts: by name, at least one.
    """

    def __init__(self, parts: Mapping[str, HasSignals]) -> None:
        self.parts = dict(parts)
        self._alone = next(iter(self.parts)) if len(self.parts) == 1 else None
        self.inputs = AssemblyInputs(self)

    @property
    def tick_us(self) -> int:
        """The shortest control period."""
        return min(part.tick_us for part in self.parts.values())

    @property
    def outputs(self) -> Mapping[str, OutputSignal]:
        """What the world sees of all devices."""
        if self._alone is not None:  # asked in each `get`: a sixth of a run that looks often
            return self.parts[self._alone].outputs
        return {
            full: replace(item, name=full)
            for name, part in self.parts.items()
            for item in part.outputs.values()
            for full in [self.full_name(name, item.name)]
        }

    def read(self, name: str, /) -> Setting:
        """Return the present value of an output; KeyError if there is none."""
        part, rest = self.find(name)
        if part is None:
            raise KeyError(name)
        return part.read(rest)

    def full_name(self, part: str, name: str) -> str:
        """Return what a signal of a device is called."""
        return name if self._alone is not None else f"{part}/{name}"

    def find(self, name: str) -> tuple[HasSignals | None, str]:
        """Return the device that a name belongs to, None if there is none, and the rest."""
        if self._alone is not None:
            return self.parts[self._alone], name.removeprefix(f"{self._alone}/")
        prefix, _, rest = name.partition("/")
        return self.parts.get(prefix), rest

    def tick_us_of(self, name: str) -> int:
        """Return the control period of the device that a signal belongs to."""
        part, _ = self.find(name)
        return part.tick_us if part else self.tick_us


class AssemblyInputs(Copyable):
    """The `Inputs` of several devices.

    Args:
        assembly: the devices.

    Attributes:
        changed: never told: each device has that of its own inputs.
    """

    def __init__(self, assembly: Assembly) -> None:
        self._assembly, self.changed = assembly, False

    @property
    def table(self) -> Mapping[str, InputSignal]:
        """All inputs by their full names."""
        return _Table(self._assembly)

    @property
    def groups(self) -> Mapping[str, tuple[str, ...]]:
        """Names of several inputs that are set together."""
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
        """Set an input; ValueError if there is none, or it does not take the value."""
        part, rest = self._find(name)
        part.inputs.set(rest, value)

    def check(self, name: str, value: Setting) -> Setting:
        """Return the value that it would be set to, or raise as `set` would."""
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
        """Return the description of an input; ValueError if there is none of this type."""
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
    """The descriptions, made when they are asked for: nodes have many objects."""

    def __init__(self, assembly: Assembly) -> None:
        self._assembly = assembly

    def __getitem__(self, name: str) -> InputSignal:
        part, rest = self._assembly.find(name)
        if part is None:
            raise KeyError(name)
        return replace(part.inputs.table[rest], name=name)

    def __contains__(self, name: object) -> bool:
        part, rest = self._assembly.find(name) if isinstance(name, str) else (None, "")
        return part is not None and rest in part.inputs.table

    def __iter__(self) -> Iterator[str]:
        full = self._assembly.full_name
        parts = self._assembly.parts.items()
        return (full(name, item) for name, part in parts for item in part.inputs.table)

    def __len__(self) -> int:
        return sum(len(part.inputs.table) for part in self._assembly.parts.values())


class AssemblyFaults(Copyable):
    """The faults of several wires; those of one are called as they are, else `WIRE/fault`.

    Args:
        wires: by name.
    """

    def __init__(self, wires: Mapping[str, WireFaults]) -> None:
        self._wires = dict(wires)
        self._bare = len(self._wires) == 1

    @property
    def wires(self) -> tuple[str, ...]:
        """Their names."""
        return tuple(self._wires)

    @property
    def fault_types(self) -> Mapping[str, WireFault]:
        """The faults that can be armed."""
        return {
            self._full(name, fault): kind
            for name, wire in self._wires.items()
            for fault, kind in wire.fault_types.items()
        }

    @property
    def armed(self) -> tuple[str, ...]:
        """Names of those that are."""
        return tuple(
            self._full(name, fault) for name, wire in self._wires.items() for fault in wire.armed
        )

    def check(self, name: str, rate: float | None) -> None:
        """Raise ValueError unless the fault can be armed like this."""
        wire, fault = self._find(name)
        wire.check(fault, rate)

    def arm(self, name: str, rate: float | None = None) -> None:
        """Let a fault begin; one of the same name is replaced."""
        wire, fault = self._find(name)
        wire.arm(fault, rate)

    def clear(self, name: str) -> None:
        """Let a fault end; one that is not armed is no error."""
        wire, fault = self._find(name)
        wire.clear(fault)

    def _full(self, wire: str, fault: str) -> str:
        return fault if self._bare else f"{wire}/{fault}"

    def _find(self, name: str) -> tuple[WireFaults, str]:
        if self._bare:
            return next(iter(self._wires.values())), name
        wire, _, fault = name.partition("/")
        return self._wires[wire], fault
