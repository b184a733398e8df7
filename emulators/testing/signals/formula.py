"""Formulas over signals: what they are made of, and what they come to.

>>> Formula("t + load", Call("+", (Name("t"), Name("load"))), ("load",), True).value(
...     {"t": 1.5, "load": 3.0}
... )
4.5
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import copysign, cos, exp, floor, inf, isfinite, nan, sin, sqrt
from typing import Final

from tickrig.device.twin import Immutable

TIME: Final = "t"


@dataclass(frozen=True, slots=True)
class Number(Immutable):
    """A number."""

    number: float


@dataclass(frozen=True, slots=True)
class Name(Immutable):
    """The value of another signal, or the time."""

    name: str


@dataclass(frozen=True, slots=True)
class Call(Immutable):
    """A function or an operator, and what it is of."""

    function: str
    terms: tuple[Term, ...]


Term = Number | Name | Call


@dataclass(frozen=True, slots=True)
class Formula(Immutable):
    """A formula.

    Attributes:
        text: as it was written.
        term: what it says.
        names: the signals in it, in order, without `t`.
        timed: whether `t` is in it.
    """

    text: str
    term: Term
    names: tuple[str, ...]
    timed: bool

    def value(self, values: Mapping[str, float]) -> float:
        """Return its value; as floats of IEEE 754 have it where it has none (`nan`, `inf`).

        Args:
            values: of its names, and of `t` in seconds.
        """
        return _value(self.term, values)


def _value(term: Term, values: Mapping[str, float]) -> float:
    match term:
        case Number(number):
            return number
        case Name(name):
            return values[name]
        case Call(function, terms):
            try:
                return FUNCTIONS[function][0](*(_value(each, values) for each in terms))
            except ValueError:
                return nan
            except OverflowError:
                return inf


def _divided(x: float, y: float) -> float:
    if y:
        return x / y
    return copysign(inf, x) * copysign(1, y) if x and x == x else nan  # noqa: PLR0124 - no nan


def _clipped(x: float, low: float, high: float) -> float:
    return min(max(x, low), high)


MANY: Final = 99

FUNCTIONS: Final[dict[str, tuple[Callable[..., float], int, int]]] = {
    "abs": (abs, 1, 1),
    "sqrt": (sqrt, 1, 1),
    "sin": (sin, 1, 1),
    "cos": (cos, 1, 1),
    "exp": (exp, 1, 1),
    "floor": (lambda x: float(floor(x)) if isfinite(x) else x, 1, 1),
    "min": (min, 2, MANY),
    "max": (max, 2, MANY),
    "clip": (_clipped, 3, 3),
    "+": (lambda x, y: x + y, 2, 2),
    "-": (lambda x, y: x - y, 2, 2),
    "*": (lambda x, y: x * y, 2, 2),
    "/": (_divided, 2, 2),
    "%": (lambda x, y: x % y if y else nan, 2, 2),
    "negative": (lambda x: -x, 1, 1),
    "positive": (lambda x: x, 1, 1),
    "<": (lambda x, y: float(x < y), 2, 2),
    "<=": (lambda x, y: float(x <= y), 2, 2),
    ">": (lambda x, y: float(x > y), 2, 2),
    ">=": (lambda x, y: float(x >= y), 2, 2),
    "==": (lambda x, y: float(x == y), 2, 2),
    "!=": (lambda x, y: float(x != y), 2, 2),
    "and": (lambda *x: float(all(x)), 2, MANY),
    "or": (lambda *x: float(any(x)), 2, MANY),
    "not": (lambda x: float(not x), 1, 1),
    "if": (lambda condition, x, y: x if condition else y, 3, 3),
}
"""What can be computed; how many numbers it takes at least and at most."""
