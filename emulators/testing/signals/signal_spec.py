"""A signal as it was asked for: where its values come from, and what is made of them."""

from __future__ import annotations

from dataclasses import dataclass
from math import expm1, inf, isfinite
from typing import Final

from tickrig.device.twin import Immutable
from tickrig.emulators.testing.signals.formula import Formula
from tickrig.emulators.testing.signals.sources import Source
from tickrig.host.text.values import Setting

SETTLED: Final = 1e-9
"""A lag that is so near to its source, as a part of it, has arrived."""


@dataclass(frozen=True, slots=True)
class Lag(Immutable):
    """A value that follows another: after `tau` it has gone 63 % of the way (first order).

    Attributes:
        formula: what it follows.
        tau_us: its time constant.
        start: where it begins; None where the other begins.
    """

    formula: Formula
    tau_us: int
    start: float | None = None

    def gain(self, every_us: int) -> float:
        """Return which part of the way it goes in a time."""
        return -expm1(-every_us / self.tau_us)

    def moved(self, value: float, source: float, gain: float) -> float:
        """Return where it is after that time."""
        if abs(source - value) <= SETTLED * max(abs(source), abs(value)):
            return source
        return value + (source - value) * gain


@dataclass(frozen=True, slots=True)
class Integral(Immutable):
    """The sum of another value over time, in its unit times seconds.

    Attributes:
        formula: what is summed up.
        start: where it begins.
    """

    formula: Formula
    start: float | None = 0.0

    def gain(self, every_us: int) -> float:
        """Return a time in seconds."""
        return every_us / 1e6

    def moved(self, value: float, source: float, gain: float) -> float:
        """Return the sum after that time."""
        return value + source * gain


@dataclass(frozen=True, slots=True)
class SignalSpec(Immutable):
    """A signal.

    Attributes:
        source: where its values come from.
        from_us: when a source of time begins; it stands still until then.
        every_us: how long a value is held; 0 takes a new one at each tick of the rig.
        low: the least value,
        high: and the greatest.
        step: values are multiples of this; 0 leaves them as they are.
    """

    source: Source | Formula | Lag | Integral
    from_us: int = 0
    every_us: int = 0
    low: float = -inf
    high: float = inf
    step: float = 0.0

    def shaped(self, value: Setting) -> Setting:
        """Return what quantisation and limits leave of a value."""
        if isinstance(value, str) or not (self.step or self.low > -inf or self.high < inf):
            return value
        if self.step and isfinite(value / self.step):
            value = _rounded(value, self.step)
        return min(max(value, self.low), self.high)


def _rounded(value: float, step: float) -> float:
    """Return the nearest multiple, as it is written: 0.3, not 0.30000000000000004."""
    whole = round(1 / step)
    if whole and 1 / whole == step:
        return round(value * whole) / whole
    return round(value / step) * step
