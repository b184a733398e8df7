"""What an analogue input and an analogue output have in common."""

from __future__ import annotations

from math import copysign, inf
from typing import Final

from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.ds401.converter import Converter
from tickrig.device.canopen.ds401.families import AnalogueObjects, find_number
from tickrig.device.twin import Part

REAL32_MAX: Final = (2 - 2.0**-23) * 2.0**127


def quantity(entry: Entry | None, default: float = 0) -> float:
    """Return the number in an object, the default if there is no object or no number in it."""
    value = default if entry is None else entry.value
    return value if isinstance(value, int | float) else default


def factor(entry: Entry | None) -> float:
    """Return a scaling; many an EDS leaves it at 0, which is taken as 1."""
    return quantity(entry, 1) or 1


def show(entry: Entry, value: float) -> None:
    """Put a number into an object, limited to what its data type holds."""
    if entry.data_type.is_integer:
        low, high = entry.data_type.limits
        entry.value = int(max(low, min(high, value)))
    else:
        entry.value = copysign(inf, value) if abs(value) > REAL32_MAX else value


class AnalogueChannel(Part):
    """One channel: its objects, its converter, its scaling.

    The widest integer object has the counts; narrower ones have their upper bits.
    A REAL32 object has the physical quantity if there is a converter, or else the
    counts, or else what the world sets. Scaled value = value x scaling + offset.

    Args:
        prefix: `ai` or `ao`.
        number: 1..254.
        converter: None for plain counts.

    Attributes:
        name: of the physical input or output.
        integers: integer objects, the narrowest first.
        real: the REAL32 object, None if there is none.
        converter: see above.
    """

    def __init__(
        self,
        dictionary: Dictionary,
        objects: AnalogueObjects,
        prefix: str,
        number: int,
        converter: Converter | None,
    ) -> None:
        def find(index: int) -> Entry | None:
            return find_number(dictionary, index, number)

        self.name = f"{prefix}{number}" + (f"_{converter.suffix}" if converter else "")
        self.converter = converter
        self.integers = [entry for index in objects.integers if (entry := find(index)) is not None]
        self.real = find(objects.real)
        self._real_offset, self._real_scaling = (
            find(objects.real_offset),
            find(objects.real_scaling),
        )
        self._offset, self._scaling = find(objects.integer_offset), find(objects.integer_scaling)

    @property
    def unit(self) -> str:
        """Unit of the physical side."""
        return self.converter.unit if self.converter else ""

    @property
    def whole(self) -> bool:
        """Whether the physical side is counted in whole numbers."""
        return self.converter is None and bool(self.integers)

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest quantity of the physical side."""
        if self.converter is not None:
            return self.converter.low, self.converter.high
        return self.integers[-1].data_type.limits if self.integers else (-REAL32_MAX, REAL32_MAX)

    def scalings(self) -> list[Entry]:
        """Return offsets and scalings."""
        found = (self._offset, self._scaling, self._real_offset, self._real_scaling)
        return [entry for entry in found if entry is not None]

    def scaled(self, counts: float) -> float:
        """Scale an integer value."""
        return counts * factor(self._scaling) + quantity(self._offset)

    def real_scaled(self, value: float) -> float:
        """Scale a REAL32 value."""
        return value * factor(self._real_scaling) + quantity(self._real_offset)
