"""The samples of one signal."""

from __future__ import annotations

from array import array
from bisect import bisect_left, bisect_right
from dataclasses import dataclass, field
from itertools import islice
from math import isfinite
from operator import le


@dataclass(slots=True)
class Series:
    """A signal's values in the order of their times.

    Args:
        label: what people call it.
        axis: the vertical axis it is drawn on, from 1.
        unit: of the values, empty where unknown.
        most: how many samples are kept; when there are twice as many, the oldest go. 0 keeps all.

    Attributes:
        at_us: the times.
        values: as many values.
        not_numbers: how many values were NaN or infinite; they are left out.
    """

    label: str
    axis: int = 1
    unit: str = ""
    most: int = 0
    at_us: array[int] = field(default_factory=lambda: array("q"))
    values: array[float] = field(default_factory=lambda: array("d"))
    not_numbers: int = 0

    def __len__(self) -> int:
        """Count the samples."""
        return len(self.at_us)

    def append(self, at_us: int, value: float) -> None:
        """Add a sample; one that is earlier than the last takes the time of the last."""
        if not isfinite(value):
            self.not_numbers += 1
            return
        if self.at_us and at_us < self.at_us[-1]:
            at_us = self.at_us[-1]
        self.at_us.append(at_us)
        self.values.append(value)
        if self.most and len(self.at_us) >= 2 * self.most:
            del self.at_us[: -self.most], self.values[: -self.most]

    def extend(self, at_us: bytes, values: bytes) -> None:
        """Add many samples to an empty series: 64-bit numbers and doubles of this machine."""
        times, numbers = array("q", at_us), array("d", values)
        if all(map(isfinite, numbers)) and all(map(le, times, islice(times, 1, None))):
            self.at_us, self.values = times, numbers
            return
        for time_us, value in zip(times, numbers, strict=True):
            self.append(time_us, value)

    def clear(self) -> None:
        """Forget the samples."""
        del self.at_us[:], self.values[:]

    def between(self, from_us: int, to_us: int) -> slice:
        """Return which samples lie in a span of time, both ends included."""
        return slice(bisect_left(self.at_us, from_us), bisect_right(self.at_us, to_us))

    def before(self, at_us: int) -> int | None:
        """Return the index of the latest sample at or before a time, None if there is none."""
        index = bisect_right(self.at_us, at_us) - 1
        return index if index >= 0 else None
