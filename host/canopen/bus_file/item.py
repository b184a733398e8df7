"""A value of a bus.yml, and the line where it stands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

Key = str | int | float | bool | None
Scalar = Key


class Place(NamedTuple):
    """A line of a file; 0 is the file as a whole."""

    file: str
    line: int

    def __str__(self) -> str:
        """Write it as compilers do."""
        return f"{self.file}:{max(self.line, 1)}"


@dataclass(frozen=True, slots=True)
class Item:
    """A value of the file.

    Attributes:
        value: of a scalar, or the items of a list, or those of a mapping by key.
        place: where it stands.
        text: a scalar as it is written, so short that it fits into a line.
        keys: where the keys of a mapping stand.
    """

    value: Scalar | tuple[Item, ...] | Mapping[Key, Item]
    place: Place
    text: str = ""
    keys: Mapping[Key, Place] = field(default_factory=dict)

    @property
    def fields(self) -> Mapping[Key, Item]:
        """What a mapping holds; nothing if it is none."""
        return self.value if isinstance(self.value, Mapping) else {}

    @property
    def items(self) -> tuple[Item, ...]:
        """What a list holds; nothing if it is none."""
        return self.value if isinstance(self.value, tuple) else ()

    @property
    def is_list(self) -> bool:
        """Whether it is a list."""
        return isinstance(self.value, tuple)

    @property
    def is_mapping(self) -> bool:
        """Whether it is a mapping."""
        return isinstance(self.value, Mapping)

    def __str__(self) -> str:
        """Say it in a message."""
        if self.is_list:
            return "a list"
        return "a mapping" if self.is_mapping else repr(self.text) if self.text else "nothing"
