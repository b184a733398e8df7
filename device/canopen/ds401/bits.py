"""Bits of many lines, shown by objects of one or several widths."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.ds401.families import (
    SINGLE_BANK_LINES,
    SINGLE_BANKS,
    DigitalObjects,
    elements,
)


class View(NamedTuple):
    """An element of an object and the lines that it shows.

    Attributes:
        entry: the element.
        lines: its lines, as bits among all lines.
        shift: number of lines before its first one.
    """

    entry: Entry
    lines: int
    shift: int

    def into(self, bits: int) -> int:
        """Return the bits with those of the element in their place."""
        return bits & ~self.lines | self.entry.number << self.shift & self.lines

    def out_of(self, bits: int) -> bytes:
        """Return what the element holds if these are the bits."""
        return ((bits & self.lines) >> self.shift).to_bytes(self.entry.size, "little")


class Bits:
    """What one family of objects says of all lines; line 1 is the lowest bit.

    If objects of several widths name a line, a change of one changes the others.
    Where their power-on values differ, the object of the highest index counts.

    Args:
        dictionary: the objects of the device.
        family: which of them.
        default: 0 or -1, for lines that no object names.

    Attributes:
        value: the bits.
        changed: called with the element that the bus has changed.
    """

    def __init__(self, dictionary: Dictionary, family: DigitalObjects, default: int = 0) -> None:
        self.views = sorted(_views(dictionary, family), key=lambda view: view.entry.key)
        self.value = default
        self.changed: Callable[[View], None] | None = None
        for view in self.views:
            self.value = view.into(self.value)
        self.assign(self.value)
        for view in self.views:
            view.entry.watch(self._follow)

    @property
    def lines(self) -> int:
        """How many lines there are, up to the last one that an object names."""
        return max((view.lines.bit_length() for view in self.views), default=0)

    def assign(self, value: int) -> None:
        """Change the bits from the inside; all objects follow."""
        self.value = value
        for view in self.views:
            view.entry.assign(view.out_of(value))

    def entries(self, lines: int) -> list[Entry]:
        """Return the elements that show one of these lines."""
        return [view.entry for view in self.views if view.lines & lines]

    def _follow(self, entry: Entry) -> None:
        view = next(view for view in self.views if view.entry is entry)
        value = view.into(self.value)
        if value != self.value:
            self.assign(value)
            if self.changed is not None:
                self.changed(view)


def _views(dictionary: Dictionary, family: DigitalObjects) -> Iterator[View]:
    for width, index in ((8, family.by_8), (16, family.by_16), (32, family.by_32)):
        for sub, entry in elements(dictionary, index):
            yield _view(entry, width, (sub - 1) * width)
    for bank in range(SINGLE_BANKS):
        for sub, entry in elements(dictionary, family.single + bank):
            yield _view(entry, 1, bank * SINGLE_BANK_LINES + sub - 1)


def _view(entry: Entry, width: int, shift: int) -> View:
    bits = min(width, 8 * entry.size)
    return View(entry, (1 << bits) - 1 << shift, shift)
