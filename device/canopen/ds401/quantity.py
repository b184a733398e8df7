"""Numbers in objects, whole or not."""

from __future__ import annotations

from math import copysign, inf
from typing import Final

from tickrig.device.canopen.core.entry import Entry

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
        low, high = limits(entry)
        entry.value = int(max(low, min(high, value)))
    else:
        entry.value = copysign(inf, value) if abs(value) > REAL32_MAX else value


def limits(entry: Entry) -> tuple[int, int]:
    """Return the smallest and the largest number of an integer object."""
    bits, signed = entry.data_type.bits, entry.data_type.signed
    return (-(1 << bits - 1), (1 << bits - 1) - 1) if signed else (0, (1 << bits) - 1)
