r"""Components and their connections as a graph in the language of Graphviz.

>>> print(write_dot([Box("A0", "Adder", (), ("out",)), Box("B0", "", ("in",), ())],
...                 [Edge("A0.out", "B0.in")]))
digraph system {
  rankdir=LR;
  node [shape=record];
  "A0" [label="A0\nAdder|{<out> out}"];
  "B0" [label="{<in> in}|B0"];
  "A0":"out" -> "B0":"in";
}
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final

_SPECIAL: Final = re.compile(r'([\\{}|<>" ])')


@dataclass(frozen=True, slots=True)
class Box:
    """A component in a Graphviz drawing of a system, where it is a box with its ports.

    Attributes:
        name: name of the component.
        title: text below the name of the component.
        ins: names of the ports at the left of the box.
        outs: names of the other ports, at the right of the box.
        state: life-cycle state of the component, such as `ACTIVE`.
    """

    name: str
    title: str
    ins: tuple[str, ...]
    outs: tuple[str, ...]
    state: str = ""


@dataclass(frozen=True, slots=True)
class Edge:
    """A connection of two ports in a Graphviz drawing of a system, where it is an arrow.

    Attributes:
        source: full name of the port where the arrow begins, such as `ConsoleIn0.out`.
        target: full name of the port where the arrow ends.
        dashed: whether the arrow is drawn dashed. Dashed arrows are PDO links: one CANopen node
            sends the data directly to another node, without the PC.
    """

    source: str
    target: str
    dashed: bool = False


def write_dot(boxes: Iterable[Box], edges: Iterable[Edge]) -> str:
    """Return the graph in the language of Graphviz."""
    lines = ["digraph system {", "  rankdir=LR;", "  node [shape=record];"]
    lines += (f'  "{box.name}" [label="{_label(box)}"];' for box in boxes)
    lines += (
        f"  {_end(edge.source)} -> {_end(edge.target)}{' [style=dashed]' * edge.dashed};"
        for edge in edges
    )
    return "\n".join((*lines, "}"))


def system_graph(components: Iterable[Any]) -> str:
    """Return a drawing of a running system in the language of Graphviz.

    The argument is the list of component descriptions that the system's control socket returns.
    """
    return write_dot(*boxes_and_edges(components))


def boxes_and_edges(components: Iterable[Any]) -> tuple[list[Box], list[Edge]]:
    """Return the components (boxes) and connections (edges) of a running system for a drawing.

    The argument is the list of component descriptions that the system's control socket returns.
    """
    described = tuple(components)
    ends = dict.fromkeys(
        tuple(connector["ports"])
        for component in described
        for port in component["ports"]
        for connector in port["connectors"]
    )
    return [_box(component) for component in described], [Edge(*pair) for pair in ends]


def _box(component: Any) -> Box:
    ins, outs = list[str](), list[str]()
    for port in component["ports"]:
        side = ins if port["kind"] == "DataInPort" else outs
        side.append(port["name"].rpartition(".")[2])
    return Box(component["name"], component["type"], tuple(ins), tuple(outs), component["state"])


def _label(box: Box) -> str:
    title = f"{box.title} {box.state.capitalize()}".strip()
    name = r"\n".join(_escaped(word) for word in (box.name, title) if word)
    fields = (_ports(box.ins), name, _ports(box.outs))
    return "|".join(field for field in fields if field)


def _ports(names: tuple[str, ...]) -> str:
    ports = "|".join(f"<{_escaped(name)}> {_escaped(name)}" for name in names)
    return f"{{{ports}}}" if ports else ""


def _end(port: str) -> str:
    owner, _, name = port.rpartition(".")
    return f'"{owner}":"{name}"'


def _escaped(text: str) -> str:
    return _SPECIAL.sub(r"\\\1", text)
