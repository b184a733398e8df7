"""A text of a user as a tree of values, each with the line where it stands.

>>> print(FileMistake(FilePlace("bus.yml", 7), "node_id: 200 is not in 1..127"))
bus.yml:7: node_id: 200 is not in 1..127
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

Key = str | int | float | bool | None
Scalar = Key


class FilePlace(NamedTuple):
    """A line of a file; 0 is the file as a whole. The file may have no name."""

    file: str
    line: int

    def __str__(self) -> str:
        """Write it as compilers do."""
        return f"{self.file or 'line '}{':' * bool(self.file)}{max(self.line, 1)}"


class FileMistake(NamedTuple):
    """One thing that is wrong in one of several files.

    Attributes:
        place: its file and line.
        text: what came, and what was allowed.
        rule: the name of the rule that it breaks, empty if there is none.
    """

    place: FilePlace
    text: str
    rule: str = ""

    def __str__(self) -> str:
        """Write it as compilers do."""
        return f"{self.place}: {self.text}"


@dataclass(frozen=True, slots=True)
class Item:
    """A value of the file.

    Attributes:
        value: of a scalar, or the items of a list, or those of a mapping by key.
        place: where it stands.
        text: a scalar as it is written, so short that it fits into a line.
        keys: where the keys of a mapping stand.
    """

    value: Scalar | tuple[Item, ...] | dict[Key, Item]
    place: FilePlace
    text: str = ""
    keys: Mapping[Key, FilePlace] = field(default_factory=dict)

    @property
    def fields(self) -> Mapping[Key, Item]:
        """What a mapping holds; nothing if it is none."""
        return self.value if isinstance(self.value, dict) else {}

    @property
    def items(self) -> tuple[Item, ...]:
        """What a list holds; nothing if it is none."""
        return self.value if isinstance(self.value, tuple) else ()

    @property
    def plain(self) -> Any:
        """Its values alone, in lists and dictionaries."""
        return _plain(self, {})

    @property
    def is_list(self) -> bool:
        """Whether it is a list."""
        return isinstance(self.value, tuple)

    @property
    def is_mapping(self) -> bool:
        """Whether it is a mapping."""
        return isinstance(self.value, dict)

    def __str__(self) -> str:
        """Say it in a message."""
        if self.is_list:
            return "a list"
        return "a mapping" if self.is_mapping else repr(self.text) if self.text else "nothing"


def _plain(item: Item, done: dict[int, Any]) -> Any:
    """Return the values of an item; what an anchor names is made once, so that no file can grow."""
    if isinstance(item.value, str | int | float | None):
        return item.value
    if (found := done.get(id(item))) is None:
        if isinstance(item.value, tuple):
            found = [_plain(each, done) for each in item.value]
        else:
            found = {key: _plain(each, done) for key, each in item.value.items()}
        done[id(item)] = found
    return found
