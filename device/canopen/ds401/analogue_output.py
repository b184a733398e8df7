"""One analogue output (CiA 401, 6410h to 6413h)."""

from __future__ import annotations

from math import isfinite, isnan

from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.ds401.analogue_channel import AnalogueChannel, quantity
from tickrig.device.canopen.ds401.converter import Converter
from tickrig.device.canopen.ds401.families import (
    ANALOGUE_ERROR_MODE,
    ANALOGUE_OUTPUT,
    INTEGER_ERROR_VALUE,
    REAL_ERROR_VALUE,
    find_number,
)
from tickrig.device.physical import OutputSignal
from tickrig.device.twin import Part


class AnalogueOutput(Part):
    """Puts one channel out.

    Integer error values are right-aligned: in the unit of the object, and limited
    to it. If several objects name the channel, the one that changed last counts;
    the others do not follow. A REAL32 that is no number leaves the output as it is.

    Attributes:
        number: 1..254.
        channel: its objects.
        level: the physical value.
        failed: its error value counts instead of what was written.
    """

    def __init__(self, dictionary: Dictionary, number: int, converter: Converter | None) -> None:
        self.number, self.level, self.failed = number, 0.0, False
        self.channel = AnalogueChannel(dictionary, ANALOGUE_OUTPUT, "ao", number, converter)
        real = [self.channel.real] if self.channel.real is not None else []
        self._written = [*real, *self.channel.integers]
        self._latest = self._written[-1]
        self._mode = find_number(dictionary, ANALOGUE_ERROR_MODE, number)
        self._error = find_number(dictionary, INTEGER_ERROR_VALUE, number)
        self._real_error = find_number(dictionary, REAL_ERROR_VALUE, number)
        for entry in self._written:
            entry.watch(self._write)

    @property
    def output(self) -> OutputSignal:
        """The physical output."""
        return OutputSignal(self.channel.name, f"analogue output {self.number}", self.channel.unit)

    def objects(self) -> list[Entry]:
        """Return the objects that change what is put out."""
        found = (self._mode, self._error, self._real_error)
        settings = [entry for entry in found if entry is not None]
        return [*self._written, *self.channel.scalings(), *settings]

    def power_on(self) -> None:
        """Begin at 0, or at what the converter has instead."""
        converter = self.channel.converter
        self.level = converter.quantity(converter.counts(0.0)) if converter is not None else 0.0

    def update(self) -> None:
        """Put out."""
        error = self.failed and quantity(self._mode, 1) != 0
        put = self._real if self._latest is self.channel.real else self._whole
        level = put(error=error)
        if isfinite(level):
            self.level = level

    def _whole(self, *, error: bool) -> float:
        entry, converter = self._latest, self.channel.converter
        low, high = entry.data_type.limits
        value = quantity(self._error) if error else entry.number
        counts = int(max(low, min(high, self.channel.scaled(max(low, min(high, value))))))
        if converter is None:
            return counts
        return converter.quantity(counts * 2**converter.width >> entry.data_type.bits)

    def _real(self, *, error: bool) -> float:
        value = quantity(self._real_error) if error else quantity(self._latest)
        level, (low, high) = self.channel.real_scaled(value), self.channel.bounds
        if self.channel.converter is None or isnan(level):
            return level
        return max(low, min(high, level))

    def _write(self, entry: Entry) -> None:
        self._latest, self.failed = entry, False
