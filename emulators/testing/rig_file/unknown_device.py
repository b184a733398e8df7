"""What stands in for a device that cannot be made: it has every name, and takes every value."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final, Generic, TypeVar

from tickrig.device.physical import InputSignal, OutputSignal, SignalType
from tickrig.host.text.values import Setting

T = TypeVar("T")


class _Everything(Mapping[str, T], Generic[T]):
    """A table that has every name, with the same behind it."""

    def __init__(self, item: T) -> None:
        self._item = item

    def __getitem__(self, name: str) -> T:
        return self._item

    def __contains__(self, name: object) -> bool:
        return True

    def __iter__(self) -> Iterator[str]:
        return iter(())

    def __len__(self) -> int:
        return 0


_ANY: Final = InputSignal("any", "", low=float("-inf"), high=float("inf"), real=True)


class UnknownInputs:
    """Inputs that take everything."""

    changed = False
    table: Mapping[str, InputSignal] = _Everything(_ANY)
    groups: Mapping[str, tuple[str, ...]] = {}

    def __getitem__(self, name: str) -> Setting:
        """Return nothing of interest."""
        return 0

    def set(self, name: str, value: Setting) -> None:
        """Take a value."""

    def check(self, name: str, value: Setting) -> Setting:
        """Return the value."""
        return value

    def names(self, signal_type: SignalType) -> tuple[str, ...]:
        """Return nothing: it has all."""
        return ()

    def find(self, name: str, signal_type: SignalType | None = None) -> InputSignal:
        """Return something of this name."""
        return self.table[name]


class UnknownDevice:
    """Stands in for a device that cannot be made: that is told, and nothing more about it."""

    tick_us = 1_000
    inputs = UnknownInputs()
    outputs: Mapping[str, OutputSignal] = _Everything(OutputSignal("any", ""))

    def read(self, name: str, /) -> Setting:
        """Return nothing of interest."""
        return 0


UNKNOWN: Final = UnknownDevice()
