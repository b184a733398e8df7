"""Digital inputs: filter, polarity, then the three interrupt masks (CiA 401)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.ds401.bits import Bits
from tickrig.device.canopen.ds401.families import (
    FILTER_INPUT,
    INTERRUPT_ANY_CHANGE,
    INTERRUPT_HIGH_TO_LOW,
    INTERRUPT_LOW_TO_HIGH,
    POLARITY_INPUT,
    READ_INPUT,
)
from tickrig.wire.instant import NEVER

FILTER_US: Final = 10_000
"""How long a filtered line must be stable; the profile leaves it to the device."""


class DigitalInputs:
    """All digital inputs of a module; line 1 is the lowest bit.

    Attributes:
        value: what the bus reads.
        lines: how many there are.
    """

    def __init__(self, dictionary: Dictionary) -> None:
        self.value = Bits(dictionary, READ_INPUT)
        self._polarity = Bits(dictionary, POLARITY_INPUT)
        self._filter = Bits(dictionary, FILTER_INPUT)
        self._any = Bits(dictionary, INTERRUPT_ANY_CHANGE, -1)
        self._rising = Bits(dictionary, INTERRUPT_LOW_TO_HIGH)
        self._falling = Bits(dictionary, INTERRUPT_HIGH_TO_LOW)
        self.lines = self.value.lines
        self._all = (1 << self.lines) - 1
        self._level = self._passed = 0
        self._waits: dict[int, int] = {}

    @property
    def due_us(self) -> int:
        """When the filter lets the next line through."""
        return min(self._waits.values(), default=NEVER)

    def settings(self) -> list[Entry]:
        """Return the objects that change what is read."""
        return [view.entry for bits in (self._polarity, self._filter) for view in bits.views]

    def power_on(self, level: int) -> None:
        """Take the lines as they are."""
        self._level = self._passed = level
        self._waits.clear()

    def update(self, level: int, now_us: int) -> list[Entry]:
        """Read the lines; return the objects whose change is an interrupt."""
        self._pass(level, now_us)
        before = self.value.value
        value = (self._passed ^ self._polarity.value) & self._all
        self.value.assign(value)
        rising, falling = value & ~before, before & ~value
        events = (rising | falling) & self._any.value
        events |= rising & self._rising.value | falling & self._falling.value
        return self.value.entries(events)

    def _pass(self, level: int, now_us: int) -> None:
        """Let unfiltered lines through at once, filtered ones when they have been stable."""
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
    """Give the bits that are set, each as a number of its own."""
    while bits:
        lowest = bits & -bits
        yield lowest
        bits ^= lowest
