"""Digital outputs: error value, polarity, then the filter mask (CiA 401)."""

from __future__ import annotations

from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.ds401.bits import Bits, View
from tickrig.device.canopen.ds401.families import (
    ERROR_MODE_OUTPUT,
    ERROR_VALUE_OUTPUT,
    FILTER_MASK_OUTPUT,
    POLARITY_OUTPUT,
    WRITE_OUTPUT,
)


class DigitalOutputs:
    """All digital outputs of a module; line 1 is the lowest bit.

    The filter mask holds lines as they are.

    Attributes:
        value: what the bus writes.
        lines: how many there are.
        level: the physical lines.
    """

    def __init__(self, dictionary: Dictionary) -> None:
        self.value = Bits(dictionary, WRITE_OUTPUT)
        self._polarity = Bits(dictionary, POLARITY_OUTPUT)
        self._error_mode = Bits(dictionary, ERROR_MODE_OUTPUT, -1)
        self._error_value = Bits(dictionary, ERROR_VALUE_OUTPUT)
        self._mask = Bits(dictionary, FILTER_MASK_OUTPUT, -1)
        self.lines = self.value.lines
        self._all = (1 << self.lines) - 1
        self.level = self._failed = 0
        self.value.changed = self._written

    def objects(self) -> list[Entry]:
        """Return the objects that change what is put out."""
        families = (self.value, self._polarity, self._error_mode, self._error_value, self._mask)
        return [view.entry for bits in families for view in bits.views]

    def power_on(self) -> None:
        """Begin with all lines low."""
        self.level = 0

    def fail(self, *, failed: bool) -> None:
        """Put error values out, or what was written."""
        self._failed = self._all if failed else 0

    def update(self) -> None:
        """Put out."""
        wrong = self._failed & self._error_mode.value
        value = self.value.value & ~wrong | self._error_value.value & wrong
        value ^= self._polarity.value
        mask = self._mask.value
        self.level = (self.level & ~mask | value & mask) & self._all

    def _written(self, view: View) -> None:
        self._failed &= ~view.lines
