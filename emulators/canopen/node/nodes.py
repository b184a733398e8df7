"""The physical side of several nodes, and of what they are part of: all under one roof."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Protocol

from tickrig.device.canopen.core.slave import TICK_US
from tickrig.device.physical import InputSignal, OutputSignal, SignalType
from tickrig.emulators.canopen.node.node import Node
from tickrig.emulators.canopen.node.signals import Signal
from tickrig.host.text.names import near
from tickrig.host.text.values import Setting


class Part(Protocol):
    """A node, or a body on nodes: something with a name and a physical side.

    Attributes:
        name: of the part.
        physical: what the world does to it, by name.
        groups: names of several of these that are set together.
        outputs: what the world sees of it, by name.
    """

    name: str
    physical: Mapping[str, Signal]
    groups: Mapping[str, tuple[str, ...]]
    outputs: Mapping[str, OutputSignal]

    def signal(self, name: str) -> Signal | None:
        """Return the thing of this name, None if there is none."""

    def signal_names(self) -> list[str]:
        """Return all names."""
        ...

    def read(self, name: str) -> Setting:
        """Return an output; KeyError if there is none."""
        ...


class Nodes:
    """All nodes of a bus, with the signals of each.

    The things of one node are called as they are, `0x6000:1`, `state`; those of
    several have the node before them, `5/0x6000:1`, `5/state`, those of a body too,
    `body/x_m`, unless it is all there is.

    Args:
        nodes: some, or none.
        bodies: what is joined to them, or is seen by itself.
    """

    def __init__(self, nodes: Sequence[Node], bodies: Sequence[Part] = ()) -> None:
        self.nodes, self.parts = tuple(nodes), (*nodes, *bodies)
        self._alone = self.parts[0] if len(nodes) == 1 or len(self.parts) == 1 else None
        self._by_name: Mapping[str, Part] = {part.name: part for part in self.parts}
        self.inputs = NodeInputs(self)
        self.outputs: Mapping[str, OutputSignal] = {
            self.full_name(part, item.name): replace(item, name=self.full_name(part, item.name))
            for part in self.parts
            for item in part.outputs.values()
        }

    @property
    def tick_us(self) -> int:
        """The control period of all of them."""
        return TICK_US

    def read(self, name: str, /) -> Setting:
        """Return the present value of an output; KeyError if there is none."""
        part, rest = self.find(name)
        if part is None:
            raise KeyError(name)
        return part.read(rest)

    def full_name(self, part: Part, name: str) -> str:
        """Return what a thing of a part is called."""
        return name if part is self._alone else f"{part.name}/{name}"

    def find(self, name: str) -> tuple[Part | None, str]:
        """Return the part that a name belongs to, and the rest of the name."""
        prefix, slash, rest = name.partition("/")
        if slash:
            return self._by_name.get(prefix), rest
        return self._alone, name

    @property
    def lost(self) -> int:
        """Frames that found a buffer full."""
        return sum(node.port.lost for node in self.nodes)


class NodeInputs:
    """The `Inputs` of nodes: their physical side and every object of their dictionaries.

    Attributes:
        table: the inputs by name; a variable may be named with its sub-index too.
        groups: names of several inputs that are set together.
    """

    def __init__(self, nodes: Nodes) -> None:
        self.changed = False
        self.table: Mapping[str, InputSignal] = _Table(nodes)
        self.groups: Mapping[str, tuple[str, ...]] = {
            nodes.full_name(part, name): tuple(nodes.full_name(part, item) for item in members)
            for part in nodes.parts
            for name, members in part.groups.items()
        }
        self._nodes = nodes

    def __getitem__(self, name: str) -> Setting:
        """Return the present value of an input."""
        return self._signal(name).read()

    def set(self, name: str, value: Setting) -> None:
        """Set an input; ValueError if there is none, or it does not take the value."""
        self._signal(name).write(value)

    def check(self, name: str, value: Setting) -> Setting:
        """Return the value, or raise ValueError as `set` would, as far as can be known before."""
        return self._signal(name).check(value)

    def find(self, name: str, signal_type: SignalType | None = None) -> InputSignal:
        """Return the description of an input; ValueError if there is none of this type."""
        item = self.table.get(name)
        if item is None or signal_type not in (None, item.type):
            wanted = signal_type.value if signal_type else "input"
            names = self.names(signal_type) if signal_type else self.table
            raise ValueError(f"no {wanted} {name!r}; {near(name, names)}")
        return item

    def names(self, signal_type: SignalType) -> tuple[str, ...]:
        """Return the names of all inputs of a type; objects are levels and texts."""
        if signal_type in (SignalType.BUTTON, SignalType.FAULT):
            return tuple(
                self._nodes.full_name(part, name)
                for part in self._nodes.parts
                for name, signal in part.physical.items()
                if signal.item.type is signal_type
            )
        return tuple(name for name in self.table if self.table[name].type is signal_type)

    def _signal(self, name: str) -> Signal:
        part, rest = self._nodes.find(name)
        signal = part.signal(rest) if part else None
        if signal is None:
            raise ValueError(f"no input {name!r}; {near(name, self.table)}")
        return signal


class _Table(Mapping[str, InputSignal]):
    """The descriptions, made when they are asked for: nodes have many objects."""

    def __init__(self, nodes: Nodes) -> None:
        self._nodes = nodes

    def __getitem__(self, name: str) -> InputSignal:
        part, rest = self._nodes.find(name)
        signal = part.signal(rest) if part else None
        if part is None or signal is None:
            raise KeyError(name)
        return replace(signal.item, name=self._nodes.full_name(part, signal.item.name))

    def __contains__(self, name: object) -> bool:
        part, rest = self._nodes.find(name) if isinstance(name, str) else (None, "")
        return part is not None and part.signal(rest) is not None

    def __iter__(self) -> Iterator[str]:
        nodes = self._nodes
        return (nodes.full_name(part, name) for part in nodes.parts for name in part.signal_names())

    def __len__(self) -> int:
        return sum(len(part.signal_names()) for part in self._nodes.parts)
