"""Values that twins of a device share."""

from __future__ import annotations

from typing import Any, TypeVar

T = TypeVar("T")


class Immutable:
    """A description that never changes once it is made, as that of a dictionary.

    Copies within the process share it; a pickle has it by value.
    """

    __slots__ = ()

    def __copy__(self: T) -> T:
        """Return it itself."""
        return self

    def __deepcopy__(self: T, memo: dict[int, Any]) -> T:
        """Return it itself."""
        return self
