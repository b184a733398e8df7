"""Lists and tables that are empty in a twin."""

from __future__ import annotations

from typing import SupportsIndex, TypeVar

T = TypeVar("T")
K = TypeVar("K")


class Listeners(list[T]):
    """Callbacks of outside code. A twin (a copy of a device) starts without callbacks."""

    __slots__ = ()

    def __reduce_ex__(self, protocol: SupportsIndex, /) -> tuple[type[Listeners[T]], tuple[()]]:
        """Return an empty list as the copy."""
        return Listeners, ()


class Cache(dict[K, T]):
    """A cache of computed values. A twin starts with an empty cache."""

    __slots__ = ()

    def __reduce_ex__(self, protocol: SupportsIndex, /) -> tuple[type[Cache[K, T]], tuple[()]]:
        """Return an empty cache as the copy."""
        return Cache, ()
