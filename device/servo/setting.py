"""An attribute whose change has consequences."""

from __future__ import annotations

from typing import Generic, Protocol, TypeVar, overload

V = TypeVar("V", float, bool)


class Changeable(Protocol):
    """An object with settings."""

    def changed(self) -> None:
        """Take the settings into account: one of them is new."""
        ...


class Setting(Generic[V]):
    """A settable value; setting another one calls `changed` of its owner."""

    __slots__ = ("_initial", "_slot")

    def __init__(self, initial: V) -> None:
        self._initial: V = initial

    def __set_name__(self, owner: type, name: str) -> None:
        self._slot = f"_{name}"

    @overload
    def __get__(self, owner: None, kind: type) -> Setting[V]: ...
    @overload
    def __get__(self, owner: Changeable, kind: type) -> V: ...
    def __get__(self, owner: Changeable | None, kind: type) -> Setting[V] | V:
        if owner is None:
            return self
        value: V = getattr(owner, self._slot, self._initial)
        return value

    def __set__(self, owner: Changeable, value: V) -> None:
        if value != self.__get__(owner, type(owner)):
            setattr(owner, self._slot, value)
            owner.changed()
