"""Values that depend only on time, as pure functions, and the fields of their tables.

>>> RampSource(12.0, 9.5, over_us=10_000_000).value(4_000_000)
11.0
>>> Wave("square", 0, 1, period_us=1_000_000).next_us(0)
500000
>>> time("1.5s"), number(2), spread([0, 1])
(1500000, 2, (0, 1))
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass, field
from math import expm1, inf, isfinite, pi, sin
from typing import Final, NamedTuple, Protocol

from tickrig.device.chance import Chance
from tickrig.device.twin import Immutable
from tickrig.emulators.testing.signals.formula import Formula, parse_formula
from tickrig.host.text.values import Setting, parse_time_us
from tickrig.wire.instant import NEVER


class SignalSource(Protocol):
    """A value as a function of time in microseconds."""

    @property
    def ends(self) -> tuple[float, ...]:
        """Limits of the values; empty if they are unknown."""
        ...

    def value(self, t_us: int, /) -> Setting:
        """Return the value at a time of 0 or later."""
        ...

    def next_us(self, t_us: int, /) -> int:
        """Return the next time after `t_us` at which the value changes, or `NEVER` if it stays."""
        ...


@dataclass(frozen=True, slots=True)
class Constant(Immutable):
    """A signal with a constant value: a number or a text.

    Attributes:
        setting: the value.
    """

    setting: Setting

    @property
    def ends(self) -> tuple[float, ...]:
        """The number."""
        return () if isinstance(self.setting, str) else (self.setting,)

    def value(self, t_us: int, /) -> Setting:
        """Return the value."""
        return self.setting

    def next_us(self, t_us: int, /) -> int:
        """Return `NEVER`."""
        return NEVER


@dataclass(frozen=True, slots=True)
class RampSource(Immutable):
    """A signal that changes on a straight line from one value to another.

    Attributes:
        first: value at time 0.
        last: value at the end.
        over_us: duration of the change in microseconds.
        repeat: whether the ramp starts again at the first value, as a saw-tooth. If not, the signal
            stays at the last value.
    """

    first: float
    last: float
    over_us: int
    repeat: bool = False

    @property
    def ends(self) -> tuple[float, ...]:
        """The first and the last value."""
        return self.first, self.last

    def value(self, t_us: int, /) -> float:
        """Return the value at a time."""
        at_us = t_us % self.over_us if self.repeat else t_us
        if at_us >= self.over_us:
            return self.last
        return self.first + (self.last - self.first) * (at_us / self.over_us)

    def next_us(self, t_us: int, /) -> int:
        """Return the next time at which the value is different."""
        ended = not self.repeat and t_us >= self.over_us
        return NEVER if ended or self.first == self.last else t_us + 1


SHAPES: Final[dict[str, Callable[[float], float]]] = {
    "sine": lambda part: 0.5 + 0.5 * sin(2 * pi * part),
    "triangle": lambda part: 1 - abs(1 - 2 * part),
    "square": lambda part: float(part >= 0),
}
"""Functions that return the part of the way from the first value to the second, by the phase."""


@dataclass(frozen=True, slots=True)
class Wave(Immutable):
    """A periodic signal between two limits.

    Attributes:
        shape: `sine`, `triangle` or `square`. A `sine` begins in the middle and moves to the second
            limit. A `triangle` or a `square` begins at the first limit.
        first: the first limit.
        second: the second limit.
        period_us: duration of a period in microseconds.
        phase_us: time in microseconds by which the wave is shifted towards earlier times.
        duty: part of a period in which a square has the second value, above 0 and below 1.
    """

    shape: str
    first: float
    second: float
    period_us: int
    phase_us: int = 0
    duty: float = 0.5

    @property
    def ends(self) -> tuple[float, ...]:
        """The two limits."""
        return self.first, self.second

    def value(self, t_us: int, /) -> float:
        """Return the value at a time."""
        at_us = (t_us + self.phase_us) % self.period_us
        if self.shape == "square":
            at_us -= self._edge_us
        way = SHAPES[self.shape](at_us / self.period_us)
        return self.first * (1 - way) + self.second * way

    def next_us(self, t_us: int, /) -> int:
        """Return the next time at which the value is different."""
        if self.shape != "square":
            return t_us + 1
        at_us = (t_us + self.phase_us) % self.period_us
        return t_us - at_us + (self._edge_us if at_us < self._edge_us else self.period_us)

    @property
    def _edge_us(self) -> int:
        return self.period_us - round(self.duty * self.period_us)


@dataclass(frozen=True, slots=True)
class Noise(Immutable):
    """A random signal with a new value every `every_us`. The value at a time is reproducible.

    Attributes:
        first: mean of gaussian noise, or smallest value of uniform noise.
        second: standard deviation of gaussian noise, or largest value of uniform noise.
        uniform: whether the noise is uniform between two values. Otherwise it is gaussian.
        every_us: time for which a value stays, in microseconds.
        seed: seed of the values, or None to use the seed of the bench.
        stream: text that distinguishes several noises. Different texts with the same seed give
            independent values.
    """

    first: float
    second: float
    uniform: bool
    every_us: int
    seed: int | None = None
    stream: str = ""

    @property
    def ends(self) -> tuple[float, ...]:
        """The limits of uniform noise; gaussian noise has no limits."""
        return (self.first, self.second) if self.uniform else ()

    def value(self, t_us: int, /) -> float:
        """Return the value at a time."""
        chance = Chance(self.seed or 0, self.stream)
        chance.skip(t_us // self.every_us)
        part = ((chance.draw() >> 12) + 0.5) / 2**52  # above 0, below 1
        if self.uniform:
            return self.first * (1 - part) + self.second * part
        from statistics import NormalDist  # noqa: PLC0415 - slow to import

        return self.first + self.second * NormalDist().inv_cdf(part)

    def next_us(self, t_us: int, /) -> int:
        """Return the time of the next value."""
        return t_us - t_us % self.every_us + self.every_us


@dataclass(frozen=True, slots=True)
class ValueTable(Immutable):
    """A signal that follows a table of times and values.

    Before the first time the signal has the first value, and after the last time the last value.

    Attributes:
        times_us: times in microseconds, in ascending order. Two equal times are a jump of the
            value.
        values: the value at each time.
        linear: whether to interpolate linearly. If not, each value holds until the next time.
        repeat: whether the table starts again from time 0 when its last time is reached.
    """

    times_us: tuple[int, ...]
    values: tuple[float, ...] = field(repr=False)
    linear: bool = True
    repeat: bool = False

    @property
    def ends(self) -> tuple[float, ...]:
        """The least and the greatest value."""
        return min(self.values), max(self.values)

    def value(self, t_us: int, /) -> float:
        """Return the value at a time."""
        at_us = self._at_us(t_us)
        right = bisect_right(self.times_us, at_us)
        if right in (0, len(self.values)) or not self.linear:
            return self.values[max(0, right - 1)]
        left, then = self.values[right - 1 : right + 1]
        if left == then:
            return left  # exactly, because it is documented not to change
        left_us, right_us = self.times_us[right - 1 : right + 1]
        way = (at_us - left_us) / (right_us - left_us)
        return left * (1 - way) + then * way

    def next_us(self, t_us: int, /) -> int:
        """Return the next time at which the value may be different."""
        at_us = self._at_us(t_us)
        right = bisect_right(self.times_us, at_us)
        if right == len(self.values):
            return NEVER
        flat = not right or self.values[right - 1] == self.values[right]
        return t_us + (1 if self.linear and not flat else self.times_us[right] - at_us)

    def _at_us(self, t_us: int) -> int:
        last_us = self.times_us[-1]
        return t_us % last_us if self.repeat and last_us else t_us


# A signal as it was asked for: where its values come from, and what is made of them.

_SETTLED: Final = 1e-9
"""Relative distance from its source at which a lag has arrived."""


@dataclass(frozen=True, slots=True)
class Lag(Immutable):
    """A signal that follows a formula with a first-order lag.

    If the value of the formula jumps, the signal covers 63 % of the jump within `tau_us`.

    Attributes:
        formula: formula whose value the signal follows.
        tau_us: time constant of the lag, in microseconds.
        start: initial value, or None to use the first value of the formula.
    """

    formula: Formula
    tau_us: int
    start: float | None = None

    def gain(self, every_us: int) -> float:
        """Return the part of the distance that the lag covers in a time."""
        return -expm1(-every_us / self.tau_us)

    def moved(self, value: float, source: float, gain: float) -> float:
        """Return the value of the lag after the time for which `gain` was computed."""
        if abs(source - value) <= _SETTLED * max(abs(source), abs(value)):
            return source
        return value + (source - value) * gain


@dataclass(frozen=True, slots=True)
class Integral(Immutable):
    """A signal that is the integral of a formula over time, in the formula's unit times seconds.

    Attributes:
        formula: formula whose value is integrated.
        start: initial value of the integral.
    """

    formula: Formula
    start: float | None = 0.0

    def gain(self, every_us: int) -> float:
        """Return a time in seconds."""
        return every_us / 1e6

    def moved(self, value: float, source: float, gain: float) -> float:
        """Return the integral after that time."""
        return value + source * gain


@dataclass(frozen=True, slots=True)
class SignalSpec(Immutable):
    """The description of a signal, which is a value that may change with time.

    Attributes:
        source: source of the values.
        from_us: start time of a source that depends on time, in microseconds. Before this time the
            source stands still.
        every_us: time for which a value is held, in microseconds. With 0 there is a new value at
            each tick of the rig.
        low: least value; smaller values of the source are limited to it.
        high: greatest value; larger values of the source are limited to it.
        step: quantisation: values are rounded to multiples of this number. 0 means no rounding.
    """

    source: SignalSource | Formula | Lag | Integral
    from_us: int = 0
    every_us: int = 0
    low: float = -inf
    high: float = inf
    step: float = 0.0

    def shaped(self, value: Setting) -> Setting:
        """Return a value after quantisation and limiting."""
        if isinstance(value, str) or not (self.step or self.low > -inf or self.high < inf):
            return value
        if self.step and isfinite(value / self.step):
            value = _rounded(value, self.step)
        return min(max(value, self.low), self.high)


def _rounded(value: float, step: float) -> float:
    """Return the nearest multiple as a short decimal: 0.3, not 0.30000000000000004."""
    whole = round(1 / step)
    if whole and 1 / whole == step:
        return round(value * whole) / whole
    return round(value / step) * step


# Fields of a signal's table: each takes what TOML gives, or says what it takes instead.

Keys = tuple[str | int, ...]
"""Keys and indices from the top of a file, such as `("device", "left", "start", "supply_v")`."""


class SignalMistake(NamedTuple):
    """A mistake in the description of a signal, for an error message.

    Attributes:
        keys: keys that lead to the mistake in the rig file.
        reason: text with the value that was found, and the values that are allowed.

    >>> print(SignalMistake(("signal", "load", "over"), "it is missing"))
    signal.load.over: it is missing
    """

    keys: Keys
    reason: str

    def __str__(self) -> str:
        """Return the mistake as one line."""
        return f"{'.'.join(map(str, self.keys))}: {self.reason}"


_LEAST_US: Final = 100
"""Shortest period, ramp or time constant."""

_FINEST: Final = 1e-12
"""Finest quantisation."""


def number(value: object) -> float:
    """Return a number, with 1 for true and 0 for false."""
    if isinstance(value, int | float):
        try:
            if isfinite(value):
                return int(value) if isinstance(value, bool) else value
        except OverflowError:
            pass
    raise ValueError(f"it takes a number, as 12.5, not {value!r:.60}")


def step(value: object) -> float:
    """Return a number of at least `_FINEST`."""
    if (found := number(value)) < _FINEST:
        raise ValueError(f"it takes a number from {_FINEST:g} on, as 0.01, not {value!r:.60}")
    return found


def part(value: object) -> float:
    """Return a number above 0 and below 1."""
    if not 0 < (found := number(value)) < 1:
        raise ValueError(f"it takes a number between 0 and 1, as 0.25, not {value!r:.60}")
    return found


def seed(value: object) -> int:
    """Return a whole number of at least 0."""
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < 1 << 64:
        raise ValueError(f"it takes a whole number from 0 on, not {value!r:.60}")
    return value


def pair(value: object) -> tuple[float, float]:
    """Return two numbers."""
    if isinstance(value, list) and len(value) == 2:
        first, second = value
        return number(first), number(second)
    raise ValueError(f"it takes two numbers, as [0, 5], not {value!r:.60}")


def spread(value: object) -> float | tuple[float, float]:
    """Return a standard deviation, or the limits of a range."""
    if isinstance(value, list):
        return pair(value)
    if (found := number(value)) < 0:
        raise ValueError(f"it takes a standard deviation from 0 on, not {value!r:.60}")
    return found


def time(value: object) -> int:
    """Convert a time of at least 0 to microseconds."""
    if not isinstance(value, str):
        raise ValueError(f'it takes a time with its unit, as "1.5s" or "20ms", not {value!r:.60}')
    return parse_time_us(value)


def some_time(value: object) -> int:
    """Convert a time to microseconds; raise ValueError if the time is too short."""
    if (found := time(value)) < _LEAST_US:
        raise ValueError(f'it takes a time from "{_LEAST_US}us" on, not {value!r:.60}')
    return found


def formula(value: object) -> Formula:
    """Return a formula of a text or a number."""
    if isinstance(value, int | float):
        value = repr(float(number(value)))
    if not isinstance(value, str):
        raise ValueError(f'it takes a formula, as "2 * load + 1", not {value!r:.60}')
    return parse_formula(value)
