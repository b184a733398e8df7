"""Configuration parameters: text in a set, a typed value in the component, a constraint."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Mapping
from math import isfinite
from typing import Any, Final, Generic, TypeVar

from tickrig.host.rtc.states import RtcRefused

V = TypeVar("V", bound=bool | int | float | str | tuple[int | float | str, ...])

_BOOLS: Final[Mapping[str, bool]] = {
    **dict.fromkeys(("1", "true", "yes", "on"), True),
    **dict.fromkeys(("0", "false", "no", "off"), False),
}
Check = Callable[[object], bool]

_NUMBER: Final = r"([-+]?(?:\d++\.?\d*+|\.\d++)(?:e[-+]?\d++)?)"
_SIGN: Final = r"(<=|>=|<|>|==?)"
_RANGE: Final = re.compile(rf"(?:{_NUMBER}{_SIGN})?x(?:{_SIGN}{_NUMBER})?", re.IGNORECASE)
_WORDS: Final = re.compile(r"\(([^()]*)\)")
_COMPARE: Final[dict[str, Callable[[float, float], bool]]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "=": operator.eq,
    "==": operator.eq,
}


class Constraint:
    """What values a parameter may have, in OpenRTM's notation.

    | notation | allows |
    |---|---|
    | (empty), `none` | everything |
    | `x>=0`, `x<10`, `0<x`, `0<=x<=10` | numbers in the range |
    | `(slow, fast)` | one of the words |
    | `x>0, x<5` | one constraint for each element |

    A single constraint holds for every element of a sequence. `{key: x>0}`, for
    values with names of their own, is not supported.

    >>> Constraint("0<=x<=10").allows(11)
    False
    >>> Constraint("(slow, fast)").allows("slow")
    True

    Args:
        text: the notation.

    Raises:
        ValueError: a text in another notation.
    """

    def __init__(self, text: str = "") -> None:
        self.text = text.strip()
        self._checks = _parse(self.text)

    def allows(self, value: object) -> bool:
        """Return whether a value, or each element of a tuple, is allowed."""
        values = value if isinstance(value, tuple) else (value,)
        checks = self._checks
        if len(checks) == 1:
            return all(map(checks[0], values))
        return len(checks) == len(values) and all(
            check(element) for check, element in zip(checks, values, strict=True)
        )

    def __str__(self) -> str:
        """Return the notation."""
        return self.text


class Parameter(Generic[V]):
    """A parameter; its type is that of its default.

    Args:
        name: in the configuration sets.
        default: bool, int, float, str or a tuple of one of these with at least one element.
        constraint: what values it may have.
        unit: of the value, for people.
        widget: how an editor shows it, such as `text` or `slider.10`.

    Attributes:
        value: the present value; it changes between the callbacks of its component only.

    Raises:
        ValueError: a default that the constraint does not allow, or a constraint in no notation.
    """

    def __init__(
        self, name: str, default: V, constraint: str = "", *, unit: str = "", widget: str = ""
    ) -> None:
        self.name, self.default, self.value = name, default, default
        self.unit, self.widget = unit, widget
        self.constraint = Constraint(constraint)
        self._read = _reader(default)
        if not self.constraint.allows(default):
            raise ValueError(f"{name} = {default!r} is not in its constraint {constraint}")

    def parse(self, text: str) -> V:
        """Return the value that a text stands for.

        Raises:
            RtcRefused: the text is no such value, or its constraint does not allow it.
        """
        try:
            value: V = self._read(text)
        except ValueError:
            kind = type(self.default).__name__
            raise RtcRefused(f"{self.name} takes a value like {self.text} ({kind})") from None
        if not self.constraint.allows(value):
            raise RtcRefused(
                f"{self.name} = {text} is not in {self.constraint} {self.unit}".strip()
            )
        return value

    @property
    def text(self) -> str:
        """The default as a configuration set holds it."""
        return as_text(self.default)


def as_text(value: object) -> str:
    """Write a value as a configuration set holds it; elements of a tuple with commas between."""
    if isinstance(value, tuple):
        return ",".join(as_text(element) for element in value)
    return str(value).lower() if isinstance(value, bool) else str(value)


def _reader(default: object) -> Callable[[str], Any]:
    if not isinstance(default, tuple):
        return _scalar(default)
    read = _scalar(default[0])
    return lambda text: tuple(read(part.strip()) for part in text.split(","))


def _scalar(default: object) -> Callable[[str], Any]:
    if isinstance(default, bool):
        return _read_bool
    if isinstance(default, int):
        return lambda text: int(text, 0)
    return _read_float if isinstance(default, float) else str


def _read_bool(text: str) -> bool:
    if (value := _BOOLS.get(text.lower())) is None:
        raise ValueError
    return value


def _read_float(text: str) -> float:
    value = float(text)
    if not isfinite(value):
        raise ValueError
    return value


def _parse(text: str) -> tuple[Check, ...]:
    if text in ("", "none"):
        return (lambda value: True,)
    if words := _WORDS.fullmatch(text):
        allowed = {word.strip() for word in words[1].split(",")}
        return (lambda value: str(value) in allowed,)
    return tuple(_range(part) for part in text.split(","))


def _range(text: str) -> Check:
    match = _RANGE.fullmatch("".join(text.split()))
    if match is None or not any(match.groups()):
        raise ValueError(f"constraint {text!r} is not like x>=0, 0<=x<10, (slow, fast) or none")
    low, low_sign, high_sign, high = match.groups()

    def check(value: object) -> bool:
        if not isinstance(value, int | float):
            return False
        above = low is None or _COMPARE[low_sign](float(low), value)
        return above and (high is None or _COMPARE[high_sign](value, float(high)))

    return check
