"""Lists and tables that begin empty in a twin."""

from __future__ import annotations

from typing import SupportsIndex, TypeVar

T = TypeVar("T")
K = TypeVar("K")


class Listeners(list[T]):
    """Callbacks of somebody outside. A twin begins with none: nobody listens to it yet."""

    __slots__ = ()

    def __reduce_ex__(self, protocol: SupportsIndex, /) -> tuple[type[Listeners[T]], tuple[()]]:
        """Copy none of them."""
        return Listeners, ()


class Cache(dict[K, T]):
    """What can be worked out again. A twin begins with nothing."""

    __slots__ = ()

    def __reduce_ex__(self, protocol: SupportsIndex, /) -> tuple[type[Cache[K, T]], tuple[()]]:
        """Copy nothing of it."""
        return Cache, ()
