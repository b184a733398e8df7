r"""YAML that says in which line it is wrong.

>>> node = compose("a: 0x10\nb: [1, x]")
>>> read_table(node, "file", {"a": whole(0, 99), "b": many(whole(0, 9))})
Traceback (most recent call last):
    ...
tickrig.host.rtc.canopen.errors.DefinitionError: line 2: b: 'x' is not a whole number in 0..9
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping
from typing import Any, NoReturn

import yaml

from tickrig.host.rtc.canopen.errors import DefinitionError

Reader = Callable[[yaml.Node, str], Any]
"""Reads a node of the tree; the text says what it is of, for people."""


def compose(text: str) -> yaml.Node:
    """Read a text into its tree; DefinitionError if it is no YAML, or empty."""
    try:
        root = yaml.compose(text, yaml.SafeLoader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        raise DefinitionError(f"not YAML: {error.problem}", mark.line + 1 if mark else 0) from error
    except yaml.YAMLError as error:
        raise DefinitionError(f"not YAML: {' '.join(str(error).split())}") from error
    except RecursionError:
        raise DefinitionError("not YAML that can be read: lists or tables nest too deep") from None
    if root is None:
        raise DefinitionError("the file is empty", 1)
    return root


def refuse(node: yaml.Node, message: str) -> NoReturn:
    """Raise a DefinitionError with the line of a node."""
    raise DefinitionError(message, node.start_mark.line + 1)


def read_table(
    node: yaml.Node, place: str, fields: Mapping[str, Reader], needed: Collection[str] = ()
) -> dict[str, Any]:
    """Read a mapping whose keys are known."""
    nodes = children(node, place)
    for key, (key_node, _) in nodes.items():
        if key not in fields:
            refuse(key_node, f"{place}: {key!r} is none of: {', '.join(fields)}")
    for key in needed:
        if key not in nodes:
            refuse(node, f"{place} has no {key!r}")
    return {key: fields[key](value, key) for key, (_, value) in nodes.items()}


def children(node: yaml.Node, place: str) -> dict[str, tuple[yaml.Node, yaml.Node]]:
    """Return keys and values of a mapping by the text of the key."""
    if not isinstance(node, yaml.MappingNode):
        refuse(node, f"{place} is written 'key: value', this is not")
    nodes: dict[str, tuple[yaml.Node, yaml.Node]] = {}
    for key_node, value in node.value:
        key = str(key_node.value)
        if key in nodes:
            refuse(key_node, f"{place}: {key!r} is there twice")
        nodes[key] = (key_node, value)
    return nodes


def table(fields: Mapping[str, Reader], *needed: str) -> Reader:
    """Read a mapping whose keys are known."""
    return lambda node, place: read_table(node, place, fields, needed)


def mapping(key: Callable[[yaml.Node, str], str], value: Reader) -> Reader:
    """Read a mapping with checked keys."""

    def read(node: yaml.Node, place: str) -> dict[str, Any]:
        return {
            key(key_node, place): value(child, f"{place}.{name}")
            for name, (key_node, child) in children(node, place).items()
        }

    return read


def many(item: Reader) -> Reader:
    """Read a list."""

    def read(node: yaml.Node, place: str) -> tuple[Any, ...]:
        if not isinstance(node, yaml.SequenceNode):
            refuse(node, f"{place} is a list, this is not")
        return tuple(item(child, place) for child in node.value)

    return read


def once(item: Reader, twice: Callable[[Any], str]) -> Reader:
    """Read a list whose items differ in the text that `twice` makes of each: `node 5 is there`."""

    def read(node: yaml.Node, place: str) -> tuple[Any, ...]:
        seen: set[str] = set()

        def unlike(child: yaml.Node, place: str) -> Any:
            value = item(child, place)
            if (words := twice(value)) in seen:
                refuse(child, f"{place}: {words} twice")
            seen.add(words)
            return value

        values: tuple[Any, ...] = many(unlike)(node, place)
        return values

    return read


def whole(low: int, high: int) -> Reader:
    """Read a whole number of a range, decimal or 0x.."""

    def read(node: yaml.Node, place: str) -> int:
        value = plain(node)
        if type(value) is not int or not low <= value <= high:
            refuse(node, f"{place}: {value!r} is not a whole number in {low}..{high}")
        return value

    return read


def rate(node: yaml.Node, place: str) -> float:
    """Read a number of Hz, above 0 and up to 1 kHz."""
    value = plain(node)
    if type(value) not in (int, float) or not 0 < value <= 1_000:
        refuse(node, f"{place}: {value!r} is not a number with 0 < {place} <= 1000")
    return float(value)


def flag(node: yaml.Node, place: str) -> bool:
    """Read true or false."""
    value = plain(node)
    if type(value) is not bool:
        refuse(node, f"{place}: {value!r} is not true or false")
    return value


def text(node: yaml.Node, place: str) -> str:
    """Read a text, quoted or not."""
    if not isinstance(node, yaml.ScalarNode) or not node.value:
        refuse(node, f"{place} is a text, this is not")
    return str(node.value)


def matching(pattern: re.Pattern[str], like: str) -> Callable[[yaml.Node, str], str]:
    """Read a text of a pattern; `like` shows one to people."""

    def read(node: yaml.Node, place: str) -> str:
        value = text(node, place)
        if pattern.fullmatch(value) is None:
            refuse(node, f"{place}: {value!r} is not like {like}")
        return value

    return read


def one_of(*words: str) -> Reader:
    """Read one of some words."""

    def read(node: yaml.Node, place: str) -> str:
        if (value := text(node, place)) not in words:
            refuse(node, f"{place}: {value!r} is none of: {', '.join(words)}")
        return value

    return read


def plain(node: yaml.Node) -> Any:
    """Return what YAML makes of a scalar; of anything else, what it is called."""
    if not isinstance(node, yaml.ScalarNode):
        return "a list" if isinstance(node, yaml.SequenceNode) else "a table"
    try:
        return yaml.SafeLoader("").construct_object(node)
    except (yaml.YAMLError, ValueError):  # a date that is none, say
        return node.value
