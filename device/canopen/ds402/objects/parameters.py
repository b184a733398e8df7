"""The objects of a drive as numbers, whether the device has them or not."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.entry import OnEntry
from tickrig.device.canopen.ds402.objects.indices import DEFAULTS
from tickrig.device.twin import Part


class Parameters(Part):
    """Reads objects, and writes those that are there.

    Args:
        dictionary: of the slave.
        defaults: values of objects that the device has not, by (index, sub-index).
    """

    def __init__(
        self, dictionary: Dictionary, defaults: Mapping[tuple[int, int], int] = DEFAULTS
    ) -> None:
        self._dictionary, self._defaults = dictionary, defaults

    def number(self, index: int, sub: int = 0) -> int:
        """Return a value; that of the defaults if the device has no such object, or 0."""
        entry = self._dictionary.find(index, sub)
        return self._defaults.get((index, sub), 0) if entry is None else entry.number

    def write(self, index: int, value: int, sub: int = 0) -> None:
        """Set a value, if the device has such an object; too large a one is cut to its range."""
        entry = self._dictionary.find(index, sub)
        if entry is not None:
            entry.value = clamped(value, 8 * entry.size, signed=entry.description.signed)

    def watch(self, indices: Iterable[int], changed: OnEntry) -> None:
        """Call `changed` whenever one of these objects changes."""
        wanted = frozenset(indices)
        for entry in self._dictionary:
            if entry.index in wanted:
                entry.watch(changed)


def clamped(value: int, bits: int, *, signed: bool) -> int:
    """Return the nearest number that an integer of so many bits holds.

    >>> clamped(40_000, 16, signed=True), clamped(-1, 16, signed=False)
    (32767, 0)
    """
    low = -(1 << bits - 1) if signed else 0
    return max(low, min(low + (1 << bits) - 1, value))
