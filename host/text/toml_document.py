"""A TOML text as it was read: its values, the line of each, and all that is wrong with it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Final, NamedTuple


class Broken(Enum):
    """In place of a value that is no TOML; its mistake is told already."""

    BROKEN = "broken"


BROKEN: Final = Broken.BROKEN


class Mistake(NamedTuple):
    """One thing that is wrong.

    Attributes:
        line: from 1.
        reason: for people.
    """

    line: int
    reason: str


TomlPath = tuple[str | int, ...]


@dataclass(frozen=True, slots=True)
class TomlDocument:
    """A text that was read.

    Attributes:
        values: what it says, `BROKEN` in place of a value that is none.
        lines: by path, where a value begins; of a table, its header.
        mistakes: in the order of their lines.
        whole: whether all headers were read; if not, tables may be missing.
    """

    values: dict[str, Any]
    lines: dict[TomlPath, int]
    mistakes: tuple[Mistake, ...] = ()
    whole: bool = True

    def line_of(self, path: Sequence[str | int]) -> int:
        """Return the line of a value, or of the nearest thing around it.

        Args:
            path: keys and indices from the top.
        """
        for end in range(len(path), 0, -1):
            if line := self.lines.get(tuple(path[:end])):
                return line
        return 1


@dataclass(slots=True, eq=False)
class Leaf:
    """A scalar."""

    line: int
    value: Any


@dataclass(slots=True, eq=False)
class Array:
    """An array; `frozen` unless of tables with headers `[[...]]`."""

    line: int
    items: list[Node] = field(default_factory=list)
    frozen: bool = True


@dataclass(slots=True, eq=False)
class Table:
    """A table; `closed` to a second header and to dotted keys, `frozen` to all."""

    line: int
    entries: dict[str, Node] = field(default_factory=dict)
    closed: bool = False
    frozen: bool = False

    def below(self, line: int, key: str) -> Table:
        """Return the table on the way to that of a header, the last one of an array.

        Raises:
            TakenError: there is something else.
        """
        node = self.entries.setdefault(key, Table(line))
        if isinstance(node, Array) and not node.frozen:
            node = node.items[-1]
        if not isinstance(node, Table) or node.frozen:
            raise TakenError(key, node.line)
        return node

    def open(self, line: int, key: str) -> Table:
        """Return the table of a header `[key]`; TakenError if it cannot have one."""
        node = self.entries.setdefault(key, Table(line))
        if not isinstance(node, Table) or node.closed or node.frozen:
            raise TakenError(key, node.line)
        node.line, node.closed = line, True
        return node

    def add(self, line: int, key: str) -> Table:
        """Return a new table of a header `[[key]]`; TakenError if it cannot have one."""
        node = self.entries.setdefault(key, Array(line, frozen=False))
        if not isinstance(node, Array) or node.frozen:
            raise TakenError(key, node.line)
        node.items.append(table := Table(line, closed=True))
        return table

    def dotted(self, line: int, key: str) -> Table:
        """Return the table of the first part of a dotted key; TakenError if there is none."""
        node = self.entries.setdefault(key, Table(line))
        if not isinstance(node, Table) or node.closed or node.frozen:
            raise TakenError(key, node.line)
        return node


Node = Table | Array | Leaf


class TakenError(Exception):
    """A key that is there already, in another way."""

    def __init__(self, key: str, line: int) -> None:
        super().__init__(f"{key!r} stands in line {line} already")


def document_of(top: Table, mistakes: Iterable[Mistake], *, whole: bool) -> TomlDocument:
    """Return the document of its top table."""
    lines: dict[TomlPath, int] = {}
    values = {key: _plain(each, (key,), lines) for key, each in top.entries.items()}
    return TomlDocument(values, lines, tuple(sorted(dict.fromkeys(mistakes))), whole)


def _plain(node: Node, path: TomlPath, lines: dict[TomlPath, int]) -> Any:
    """Return the value of a node, and enter where it and all in it stand."""
    lines[path] = node.line
    match node:
        case Table():
            return {key: _plain(each, (*path, key), lines) for key, each in node.entries.items()}
        case Array():
            return [_plain(each, (*path, at), lines) for at, each in enumerate(node.items)]
    return node.value
