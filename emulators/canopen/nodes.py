"""The physical side of several nodes: all their things under one roof."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from tickrig.device.canopen.slave import TICK_US
from tickrig.device.physical import Input, Kind, Output
from tickrig.emulators.canopen.node import Node
from tickrig.emulators.canopen.touch import Touch
from tickrig.emulators.names import known
from tickrig.emulators.setting import Setting


class Nodes:
    """All nodes of a bus, to be touched and looked at.

    The things of one node are called as they are, `0x6000:1`, `state`; those of
    several have the node before them, `5/0x6000:1`, `5/state`.

    Args:
        nodes: at least one.
    """

    def __init__(self, nodes: Sequence[Node]) -> None:
        self.nodes = tuple(nodes)
        self._by_name = {node.name: node for node in nodes}
        self.inputs = NodeInputs(self)
        self.outputs: Mapping[str, Output] = {
            self.full_name(node, item.name): Output(
                self.full_name(node, item.name), item.text, item.unit
            )
            for node in nodes
            for item in node.outputs.values()
        }

    @property
    def tick_us(self) -> int:
        """The control period of all of them."""
        return TICK_US

    def read(self, name: str, /) -> Setting:
        """Return the present value of an output; KeyError if there is none."""
        node, rest = self.find(name)
        if node is None:
            raise KeyError(name)
        return node.read(rest)

    def full_name(self, node: Node, name: str) -> str:
        """Return what a thing of a node is called."""
        return name if len(self.nodes) == 1 else f"{node.name}/{name}"

    def find(self, name: str) -> tuple[Node | None, str]:
        """Return the node that a name belongs to, and the rest of the name."""
        prefix, slash, rest = name.partition("/")
        if slash:
            return self._by_name.get(prefix), rest
        return (self.nodes[0] if len(self.nodes) == 1 else None), name

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
        self.table: Mapping[str, Input] = _Table(nodes)
        self.groups: Mapping[str, tuple[str, ...]] = {
            nodes.full_name(node, name): tuple(nodes.full_name(node, item) for item in members)
            for node in nodes.nodes
            for name, members in node.groups.items()
        }
        self._nodes = nodes

    def __getitem__(self, name: str) -> Setting:
        """Return the present value of an input."""
        return self._touch(name).read()

    def set(self, name: str, value: Setting) -> None:
        """Set an input; ValueError if there is none, or it does not take the value."""
        self._touch(name).write(value)

    def check(self, name: str, value: Setting) -> Setting:
        """Return the value, or raise ValueError as `set` would, as far as can be known before."""
        return self._touch(name).check(value)

    def find(self, name: str, kind: Kind | None = None) -> Input:
        """Return the description of an input; ValueError if there is none of the kind."""
        item = self.table.get(name)
        if item is None or kind not in (None, item.kind):
            wanted = kind.value if kind else "input"
            names = self.names(kind) if kind else self.table
            raise ValueError(f"no {wanted} {name!r}; known: {known(names) or 'none'}")
        return item

    def names(self, kind: Kind) -> tuple[str, ...]:
        """Return the names of all inputs of a kind; objects are levels and texts."""
        if kind in (Kind.BUTTON, Kind.FAULT):
            return tuple(
                self._nodes.full_name(node, name)
                for node in self._nodes.nodes
                for name, touch in node.physical.items()
                if touch.item.kind is kind
            )
        return tuple(name for name in self.table if self.table[name].kind is kind)

    def _touch(self, name: str) -> Touch:
        node, rest = self._nodes.find(name)
        touch = node.touch(rest) if node else None
        if touch is None:
            raise ValueError(f"no input {name!r}; known: {known(self.table)}")
        return touch


class _Table(Mapping[str, Input]):
    """The descriptions, made when they are asked for: nodes have many objects."""

    def __init__(self, nodes: Nodes) -> None:
        self._nodes = nodes

    def __getitem__(self, name: str) -> Input:
        node, rest = self._nodes.find(name)
        touch = node.touch(rest) if node else None
        if node is None or touch is None:
            raise KeyError(name)
        return replace(touch.item, name=self._nodes.full_name(node, touch.item.name))

    def __contains__(self, name: object) -> bool:
        node, rest = self._nodes.find(name) if isinstance(name, str) else (None, "")
        return node is not None and node.touch(rest) is not None

    def __iter__(self) -> Iterator[str]:
        nodes = self._nodes
        return (nodes.full_name(node, name) for node in nodes.nodes for name in node.touchable())

    def __len__(self) -> int:
        return sum(len(node.touchable()) for node in self._nodes.nodes)
