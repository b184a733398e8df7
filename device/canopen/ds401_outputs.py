"""Digital and analogue outputs of a generic I/O module (CiA 401)."""

from __future__ import annotations

from typing import Final, Protocol

from tickrig.device.canopen.application import number_of
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.entry import Entry

WRITE_OUTPUT_8: Final = 0x6200
POLARITY_OUTPUT_8: Final = 0x6202
ERROR_MODE_OUTPUT_8: Final = 0x6206
ERROR_VALUE_OUTPUT_8: Final = 0x6207
FILTER_MASK_OUTPUT_8: Final = 0x6208
WRITE_ANALOGUE_OUTPUT_16: Final = 0x6411
ANALOGUE_OUTPUT_ERROR_MODE: Final = 0x6443
ANALOGUE_OUTPUT_ERROR_VALUE: Final = 0x6444

I16: Final = range(-0x8000, 0x8000)


class OutputChannel(Protocol):
    """Eight digital lines or an analogue channel.

    Attributes:
        entry: what the bus writes.
        level: the physical lines or value.
        failed: its error value counts instead of what was written.
    """

    entry: Entry
    level: int
    failed: bool

    def settings(self) -> list[Entry]:
        """Return the objects that change what is put out."""
        ...

    def update(self) -> None:
        """Put out."""


class DigitalOutput:
    """Eight lines: error value, polarity, then the filter mask, which holds lines as they are."""

    def __init__(self, dictionary: Dictionary, number: int, entry: Entry) -> None:
        find = dictionary.find
        self.entry, self.level, self.failed = entry, 0, False
        self._polarity = find(POLARITY_OUTPUT_8, number)
        self._mode = find(ERROR_MODE_OUTPUT_8, number)
        self._value = find(ERROR_VALUE_OUTPUT_8, number)
        self._mask = find(FILTER_MASK_OUTPUT_8, number)

    def settings(self) -> list[Entry]:
        """Return the objects that change what is put out."""
        found = (self._polarity, self._mode, self._value, self._mask)
        return [entry for entry in found if entry is not None]

    def update(self) -> None:
        """Put out."""
        value = self.entry.number
        if self.failed:
            mode = number_of(self._mode, 0xFF)
            value = value & ~mode | number_of(self._value, 0) & mode
        value ^= number_of(self._polarity, 0)
        mask = number_of(self._mask, 0xFF)
        self.level = self.level & ~mask | value & mask


class AnalogueOutput:
    """One channel of 16 bit; its error value is taken as right-aligned and limited to 16 bit."""

    def __init__(self, dictionary: Dictionary, number: int, entry: Entry) -> None:
        self.entry, self.level, self.failed = entry, 0, False
        self._mode = dictionary.find(ANALOGUE_OUTPUT_ERROR_MODE, number)
        self._value = dictionary.find(ANALOGUE_OUTPUT_ERROR_VALUE, number)

    def settings(self) -> list[Entry]:
        """Return the objects that change what is put out."""
        return [entry for entry in (self._mode, self._value) if entry is not None]

    def update(self) -> None:
        """Put out."""
        value = self.entry.number
        if self.failed and number_of(self._mode, 1):
            value = number_of(self._value, 0)
        self.level = min(max(value, I16[0]), I16[-1])
