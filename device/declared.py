"""What a class declares by attributes, such as the ports of a component."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeVar

T = TypeVar("T")


def declared(owner: type, kind: type[T]) -> Iterator[tuple[str, T]]:
    """Give the attributes of a class and its bases that are of a kind, the bases first.

    >>> class Lamp:
    ...     bright, name = 5, "lamp"
    >>> list(declared(Lamp, int))
    [('bright', 5)]
    """
    for base in reversed(owner.__mro__):
        for name, value in vars(base).items():
            if isinstance(value, kind):
                yield name, value
