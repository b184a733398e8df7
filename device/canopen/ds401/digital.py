"""Digital inputs and outputs: bits of many lines, shown by objects of several widths (CiA 401)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final, NamedTuple

from tickrig.device.canopen.dictionary import Dictionary, Entry
from tickrig.device.canopen.ds401.families import (
    ERROR_MODE_OUTPUT,
    ERROR_VALUE_OUTPUT,
    FILTER_INPUT,
    FILTER_MASK_OUTPUT,
    INTERRUPT_ANY_CHANGE,
    INTERRUPT_HIGH_TO_LOW,
    INTERRUPT_LOW_TO_HIGH,
    POLARITY_INPUT,
    POLARITY_OUTPUT,
    READ_INPUT,
    SINGLE_BANK_LINES,
    SINGLE_BANKS,
    WRITE_OUTPUT,
    DigitalObjects,
    elements,
)
from tickrig.device.twin import Part
from tickrig.wire.instant import NEVER


class _View(NamedTuple):
    """An element of an object and the lines that it shows.

    Attributes:
        entry: the element.
        lines: lines of the element, as a mask among all lines.
        shift: number of lines before the first line of the element.
    """

    entry: Entry
    lines: int
    shift: int

    def into(self, bits: int) -> int:
        """Return the bits of all lines, with the bits of the element replaced."""
        return bits & ~self.lines | self.entry.number << self.shift & self.lines

    def out_of(self, bits: int) -> bytes:
        """Return the value of the element for the bits of all lines."""
        return ((bits & self.lines) >> self.shift).to_bytes(self.entry.size, "little")


class _Bits(Part):
    """The value of one family of objects for all lines; line 1 is the lowest bit.

    If objects of several widths contain a line, a change of one object changes the others. Where
    their power-on values differ, the object with the highest index takes precedence.

    Args:
        dictionary: the objects of the device.
        family: the indices of the objects in the family.
        default: value 0 or -1 for lines without an object.

    Attributes:
        value: bits of all lines.
        changed: function that is called with an element that the bus has changed.
    """

    def __init__(self, dictionary: Dictionary, family: DigitalObjects, default: int = 0) -> None:
        self.views = sorted(_views(dictionary, family), key=lambda view: view.entry.key)
        self.value = default
        self.changed: Callable[[_View], None] | None = None
        for view in self.views:
            self.value = view.into(self.value)
        self.assign(self.value)
        for view in self.views:
            view.entry.watch(self._follow)

    @property
    def lines(self) -> int:
        """Number of lines, up to the last one with an object."""
        return max((view.lines.bit_length() for view in self.views), default=0)

    def assign(self, value: int) -> None:
        """Change the bits from inside the device, and update all objects."""
        self.value = value
        for view in self.views:
            view.entry.assign(view.out_of(value))

    def entries(self, lines: int) -> list[Entry]:
        """Return the elements that contain one of the given lines."""
        return [view.entry for view in self.views if view.lines & lines]

    def _follow(self, entry: Entry) -> None:
        view = next(view for view in self.views if view.entry is entry)
        value = view.into(self.value)
        if value != self.value:
            self.assign(value)
            if self.changed is not None:
                self.changed(view)


def _views(dictionary: Dictionary, family: DigitalObjects) -> Iterator[_View]:
    for width, index in ((8, family.by_8), (16, family.by_16), (32, family.by_32)):
        for sub, entry in elements(dictionary, index):
            yield _view(entry, width, (sub - 1) * width)
    for bank in range(SINGLE_BANKS):
        for sub, entry in elements(dictionary, family.single + bank):
            yield _view(entry, 1, bank * SINGLE_BANK_LINES + sub - 1)


def _view(entry: Entry, width: int, shift: int) -> _View:
    bits = min(width, 8 * entry.size)
    return _View(entry, (1 << bits) - 1 << shift, shift)


FILTER_US: Final = 10_000
"""Time for which a filtered line must be stable.

The profile leaves this time to the device.
"""


class DigitalInputs(Part):
    """All digital inputs of an I/O module, with their polarity, filter and interrupt masks.

    Line 1 is the lowest bit.

    Attributes:
        value: bits that the bus reads.
        lines: number of lines.
    """

    def __init__(self, dictionary: Dictionary) -> None:
        self.value = _Bits(dictionary, READ_INPUT)
        self._polarity = _Bits(dictionary, POLARITY_INPUT)
        self._filter = _Bits(dictionary, FILTER_INPUT)
        self._any = _Bits(dictionary, INTERRUPT_ANY_CHANGE, -1)
        self._rising = _Bits(dictionary, INTERRUPT_LOW_TO_HIGH)
        self._falling = _Bits(dictionary, INTERRUPT_HIGH_TO_LOW)
        self.lines = self.value.lines
        self._all = (1 << self.lines) - 1
        self._level = self._passed = 0
        self._waits: dict[int, int] = {}

    @property
    def due_us(self) -> int:
        """The time at which the filter next accepts the level of a line."""
        return min(self._waits.values(), default=NEVER)

    def settings(self) -> list[Entry]:
        """Return the objects that influence the value read."""
        return [view.entry for bits in (self._polarity, self._filter) for view in bits.views]

    def power_on(self, level: int) -> None:
        """Accept the lines as they are."""
        self._level = self._passed = level
        self._waits.clear()

    def update(self, level: int, now_us: int) -> list[Entry]:
        """Read the lines; return the objects whose change causes an interrupt."""
        self._pass(level, now_us)
        before = self.value.value
        value = (self._passed ^ self._polarity.value) & self._all
        self.value.assign(value)
        rising, falling = value & ~before, before & ~value
        events = (rising | falling) & self._any.value
        events |= rising & self._rising.value | falling & self._falling.value
        return self.value.entries(events)

    def _pass(self, level: int, now_us: int) -> None:
        """Accept unfiltered lines at once, and filtered lines when they have been stable."""
        changed, self._level = level ^ self._level, level
        differing = level ^ self._passed
        for line in _ones(changed & differing):
            self._waits[line] = now_us + FILTER_US
        held = differing & self._filter.value
        self._waits = {
            line: due_us for line, due_us in self._waits.items() if line & held and due_us > now_us
        }
        self._passed = level ^ sum(self._waits)


def _ones(bits: int) -> Iterator[int]:
    """Yield the bits that are set, each as a separate number."""
    while bits:
        lowest = bits & -bits
        yield lowest
        bits ^= lowest


class DigitalOutputs(Part):
    """All digital outputs of an I/O module, with their polarity, filter mask and error values.

    Line 1 is the lowest bit. A line whose bit in the filter mask is 0 keeps its level.

    Attributes:
        value: bits that the bus writes.
        lines: number of lines.
        level: levels of the physical lines, one bit for each line.
    """

    def __init__(self, dictionary: Dictionary) -> None:
        self.value = _Bits(dictionary, WRITE_OUTPUT)
        self._polarity = _Bits(dictionary, POLARITY_OUTPUT)
        self._error_mode = _Bits(dictionary, ERROR_MODE_OUTPUT, -1)
        self._error_value = _Bits(dictionary, ERROR_VALUE_OUTPUT)
        self._mask = _Bits(dictionary, FILTER_MASK_OUTPUT, -1)
        self.lines = self.value.lines
        self._all = (1 << self.lines) - 1
        self.level = self._failed = 0
        self.value.changed = self._written

    def objects(self) -> list[Entry]:
        """Return the objects that influence the outputs."""
        families = (self.value, self._polarity, self._error_mode, self._error_value, self._mask)
        return [view.entry for bits in families for view in bits.views]

    def power_on(self) -> None:
        """Start with all lines low."""
        self.level = 0

    def fail(self, *, failed: bool) -> None:
        """Output the error values, or the written values."""
        self._failed = self._all if failed else 0

    def update(self) -> None:
        """Update the outputs."""
        wrong = self._failed & self._error_mode.value
        value = self.value.value & ~wrong | self._error_value.value & wrong
        value ^= self._polarity.value
        mask = self._mask.value
        self.level = (self.level & ~mask | value & mask) & self._all

    def _written(self, view: _View) -> None:
        self._failed &= ~view.lines
