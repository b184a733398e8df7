"""What the curves say at a moment."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from tickrig.host.monitor.graph.series import Series


class Reading(NamedTuple):
    """A curve at a moment.

    Attributes:
        label: of the curve.
        value: of the latest sample at or before the moment; None before the first.
        age_us: how old that sample is.
        unit: of the value.
    """

    label: str
    value: float | None
    age_us: int
    unit: str

    def __str__(self) -> str:
        """Write it for people."""
        value = "-" if self.value is None else f"{self.value:.6g}"
        return f"{self.label} {value} {self.unit}".rstrip()


def read_out(series: Iterable[Series], at_us: int) -> tuple[Reading, ...]:
    """Return what each series last said at a moment: a signal holds until its next frame."""
    return tuple(_reading(one, at_us) for one in series)


def _reading(series: Series, at_us: int) -> Reading:
    index = series.before(at_us)
    if index is None:
        return Reading(series.label, None, 0, series.unit)
    age_us = at_us - series.at_us[index]
    return Reading(series.label, series.values[index], age_us, series.unit)
