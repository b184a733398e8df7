"""Constraints of configuration parameters, in OpenRTM's notation.

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
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable
from typing import Final

Check = Callable[[object], bool]

_NUMBER: Final = r"([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)"
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
    """What values a parameter may have.

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
