"""A user's text as a tree of values, each with its line number.

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
    """Position in a text file: file name and line, for error messages.

    Line 0 stands for the whole file. The name may be empty.
    """

    file: str
    line: int

    def __str__(self) -> str:
        """Return the place in the form of compilers."""
        return f"{self.file or 'line '}{':' * bool(self.file)}{max(self.line, 1)}"


class FileMistake(NamedTuple):
    """One error in a file of the user, with its position.

    Attributes:
        place: file and line of the error.
        text: invalid value, and the allowed values.
        rule: name of the violated rule, empty if there is none.
    """

    place: FilePlace
    text: str
    rule: str = ""

    def __str__(self) -> str:
        """Return the error in the form of compilers."""
        return f"{self.place}: {self.text}"


@dataclass(frozen=True, slots=True)
class Item:
    """A value of a file that the user wrote, with its position for error messages.

    Attributes:
        value: value of a scalar, tuple of the items of a list, or items of a mapping by key.
        place: file and line of the item.
        text: text of a scalar as in the file, shortened to one line.
        keys: file and line of each key of a mapping.
    """

    value: Scalar | tuple[Item, ...] | dict[Key, Item]
    place: FilePlace
    text: str = ""
    keys: Mapping[Key, FilePlace] = field(default_factory=dict)

    @property
    def fields(self) -> Mapping[Key, Item]:
        """The items of a mapping, empty for other values."""
        return self.value if isinstance(self.value, dict) else {}

    @property
    def items(self) -> tuple[Item, ...]:
        """The items of a list, empty for other values."""
        return self.value if isinstance(self.value, tuple) else ()

    @property
    def plain(self) -> Any:
        """Plain values of the item, in lists and dictionaries."""
        return _plain(self, {})

    @property
    def is_list(self) -> bool:
        """Whether the item is a list."""
        return isinstance(self.value, tuple)

    @property
    def is_mapping(self) -> bool:
        """Whether the item is a mapping."""
        return isinstance(self.value, dict)

    def __str__(self) -> str:
        """Return the text of the item for a message."""
        if self.is_list:
            return "a list"
        return "a mapping" if self.is_mapping else repr(self.text) if self.text else "nothing"


def _plain(item: Item, done: dict[int, Any]) -> Any:
    """Return the values of an item.

    An anchored value is made only once, so that nested anchors in a file cannot exhaust the memory.
    """
    if isinstance(item.value, str | int | float | None):
        return item.value
    if (found := done.get(id(item))) is None:
        if isinstance(item.value, tuple):
            found = [_plain(each, done) for each in item.value]
        else:
            found = {key: _plain(each, done) for key, each in item.value.items()}
        done[id(item)] = found
    return found
