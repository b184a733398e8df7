"""Fields of a signal's table: each takes what TOML gives, or says what it takes instead.

>>> time("1.5s"), number(2), spread([0, 1])
(1500000, 2, (0, 1))
"""

from __future__ import annotations

from math import isfinite
from typing import Final, NamedTuple

from tickrig.emulators.testing.signals.formula import Formula, parse_formula
from tickrig.host.text.values import parse_time_us

# What is wrong with a value of a file, and where it stands.

Keys = tuple[str | int, ...]
"""Keys and indices from the top of a file, as `("device", "left", "start", "supply_v")`."""


class SignalMistake(NamedTuple):
    """One mistake.

    Attributes:
        keys: where it is.
        reason: what came, and what was allowed.

    >>> print(SignalMistake(("signal", "load", "over"), "it is missing"))
    signal.load.over: it is missing
    """

    keys: Keys
    reason: str

    def __str__(self) -> str:
        """Write it in one line."""
        return f"{'.'.join(map(str, self.keys))}: {self.reason}"


_LEAST_US: Final = 100
"""No period, ramp or time constant is shorter."""

_FINEST: Final = 1e-12
"""No quantisation is finer."""


def number(value: object) -> float:
    """Take a number, or true and false as 1 and 0."""
    if isinstance(value, int | float):
        try:
            if isfinite(value):
                return int(value) if isinstance(value, bool) else value
        except OverflowError:
            pass
    raise ValueError(f"it takes a number, as 12.5, not {value!r:.60}")


def step(value: object) -> float:
    """Take a number from `_FINEST` on."""
    if (found := number(value)) < _FINEST:
        raise ValueError(f"it takes a number from {_FINEST:g} on, as 0.01, not {value!r:.60}")
    return found


def part(value: object) -> float:
    """Take a number above 0 and below 1."""
    if not 0 < (found := number(value)) < 1:
        raise ValueError(f"it takes a number between 0 and 1, as 0.25, not {value!r:.60}")
    return found


def seed(value: object) -> int:
    """Take a whole number from 0 on."""
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < 1 << 64:
        raise ValueError(f"it takes a whole number from 0 on, not {value!r:.60}")
    return value


def pair(value: object) -> tuple[float, float]:
    """Take two numbers."""
    if isinstance(value, list) and len(value) == 2:
        first, second = value
        return number(first), number(second)
    raise ValueError(f"it takes two numbers, as [0, 5], not {value!r:.60}")


def spread(value: object) -> float | tuple[float, float]:
    """Take a standard deviation, or the ends of a range."""
    if isinstance(value, list):
        return pair(value)
    if (found := number(value)) < 0:
        raise ValueError(f"it takes a standard deviation from 0 on, not {value!r:.60}")
    return found


def time(value: object) -> int:
    """Take a time from 0 on; return microseconds."""
    if not isinstance(value, str):
        raise ValueError(f'it takes a time with its unit, as "1.5s" or "20ms", not {value!r:.60}')
    return parse_time_us(value)


def some_time(value: object) -> int:
    """Take a time that is not too short; return microseconds."""
    if (found := time(value)) < _LEAST_US:
        raise ValueError(f'it takes a time from "{_LEAST_US}us" on, not {value!r:.60}')
    return found


def formula(value: object) -> Formula:
    """Take a formula, or a number."""
    if isinstance(value, int | float):
        value = repr(float(number(value)))
    if not isinstance(value, str):
        raise ValueError(f'it takes a formula, as "2 * load + 1", not {value!r:.60}')
    return parse_formula(value)
