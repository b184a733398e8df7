"""The configuration sets of a component (OMG SDO, Configuration; OpenRTM-aist 1.x, ConfigAdmin)."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Mapping
from math import isfinite
from types import MappingProxyType
from typing import Any, Final, Generic, TypeVar

from tickrig.host.rtc.states import RtcRefused

# Configuration parameters: text in a set, a typed value in the component, a constraint.

V = TypeVar("V", bound=bool | int | float | str | tuple[int | float | str, ...])

_BOOLS: Final[Mapping[str, bool]] = {
    **dict.fromkeys(("1", "true", "yes", "on"), True),
    **dict.fromkeys(("0", "false", "no", "off"), False),
}
_Check = Callable[[object], bool]

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
    """Constraint on the values of a configuration parameter, in OpenRTM's notation.

    | notation | allows |
    |---|---|
    | (empty), `none` | everything |
    | `x>=0`, `x<10`, `0<x`, `0<=x<=10` | numbers in the range |
    | `(slow, fast)` | one of the words |
    | `x>0, x<5` | one constraint for each element |

    A single constraint applies to every element of a sequence. OpenRTM's notation `{key: x>0}`, for
    named values, is not supported.

    >>> Constraint("0<=x<=10").allows(11)
    False
    >>> Constraint("(slow, fast)").allows("slow")
    True

    Args:
        text: constraint in OpenRTM's notation.

    Raises:
        ValueError: the text has another notation.
    """

    def __init__(self, text: str = "") -> None:
        self.text = text.strip()
        self._checks = _parse(self.text)

    def allows(self, value: object) -> bool:
        """Return whether a value is allowed. For a tuple, each element must be allowed."""
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
    """Configuration parameter of a component: its name, default, constraint and present value.

    Args:
        name: name of the parameter in the configuration sets.
        default: default value, which is a bool, int, float, str or a tuple of one of these with at
            least one element. Its type is the type of all values of the parameter.
        constraint: constraint on the values in OpenRTM's notation, such as `0<=x<=10`.
        unit: unit of the value, for display.
        widget: widget with which an editor shows the parameter, such as `text` or `radio`.

    Attributes:
        value: present value, which changes only between callbacks of the component.

    Raises:
        ValueError: the constraint does not allow the default, or its notation is unknown.
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
        """Convert the text of a configuration set to a value of this parameter.

        Raises:
            RtcRefused: the text has another type than the parameter, or the constraint does not
                allow the value.
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
        """The default value as text for a configuration set."""
        return as_text(self.default)


def as_text(value: object) -> str:
    """Convert the value of a parameter to the text that a configuration set stores.

    Commas separate the elements of a tuple.
    """
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


def _parse(text: str) -> tuple[_Check, ...]:
    if text in ("", "none"):
        return (lambda value: True,)
    if words := _WORDS.fullmatch(text):
        allowed = {word.strip() for word in words[1].split(",")}
        return (lambda value: str(value) in allowed,)
    return tuple(_range(part) for part in text.split(","))


def _range(text: str) -> _Check:
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


DEFAULT: Final = "default"


class Configuration:
    """The configuration sets of a component, each with values for its parameters.

    One set is active, and the component uses its values. A change is checked at once, but it takes
    effect later: at `initialize`, when `update` is called, or at the beginning of the next period
    of the component.

    Attributes:
        active_id: ID of the set whose values the component uses, or will use after the next update.
        changed: whether there are changes that the next update will apply.
        on_update: functions that are called after each update with the ID of the active set.
    """

    def __init__(self) -> None:
        self.active_id, self.changed = DEFAULT, False
        self.on_update: list[Callable[[str], None]] = []
        self._parameters: dict[str, Parameter[Any]] = {}
        self._sets: dict[str, dict[str, str]] = {DEFAULT: {}}

    @property
    def parameters(self) -> Mapping[str, Parameter[Any]]:
        """The parameters by name."""
        return MappingProxyType(self._parameters)

    @property
    def sets(self) -> Mapping[str, Mapping[str, str]]:
        """The values of each set as text, by the ID of the set."""
        return MappingProxyType(self._sets)

    def bind(
        self, name: str, default: V, constraint: str = "", *, unit: str = "", widget: str = ""
    ) -> Parameter[V]:
        """Add a parameter to the component, and store its default value in the set `default`.

        Args:
            name: name of the parameter in the configuration sets.
            default: default value, which is a bool, int, float, str or a tuple of one of these. Its
                type is the type of all values of the parameter.
            constraint: constraint on the values, such as `0<=x<=10` (`Constraint`).
            unit: unit of the value, for display.
            widget: widget with which an editor shows the parameter, such as `text` or `radio`.

        Returns:
            The parameter. Its attribute `value` is the present value.

        Raises:
            ValueError: the constraint does not allow the default, or its notation is unknown.
        """
        parameter = Parameter(name, default, constraint, unit=unit, widget=widget)
        self._parameters[name] = parameter
        self._sets[DEFAULT][name] = parameter.text
        return parameter

    def set(self, name: str, text: str, set_id: str = "") -> None:
        """Change the value of a parameter in a configuration set.

        Args:
            name: name of the parameter.
            text: new value as text.
            set_id: ID of the set. By default, it is the active set.

        Raises:
            RtcRefused: the set or parameter is unknown, or the value is not allowed.
        """
        values = self._set(set_id or self.active_id)
        self._check(name, text)
        values[name] = text
        self.changed = True

    def add_set(self, set_id: str, values: Mapping[str, str]) -> None:
        """Add a configuration set, or replace the set with this ID.

        Args:
            set_id: ID of the set.
            values: values as text, by the name of their parameter. Missing parameters have their
                default.

        Raises:
            RtcRefused: a parameter is unknown, or a value is not allowed.
        """
        for name, text in values.items():
            self._check(name, text)
        self._sets[set_id] = dict(values)
        self.changed = True

    def remove_set(self, set_id: str) -> None:
        """Remove a configuration set.

        Raises:
            RtcRefused: the set is unknown, or it is the set `default` or the active set.
        """
        self._set(set_id)
        if set_id in (DEFAULT, self.active_id):
            raise RtcRefused(f"configuration set {set_id!r} is in use")
        del self._sets[set_id]

    def activate(self, set_id: str) -> None:
        """Make a configuration set active. Its values apply from the next update on.

        Raises:
            RtcRefused: the set is unknown.
        """
        self._set(set_id)
        self.active_id, self.changed = set_id, True

    def update(self) -> None:
        """Apply the values of the active set to the parameters."""
        self.changed = False
        values = self._sets[self.active_id]
        for name, parameter in self._parameters.items():
            text = values.get(name)
            parameter.value = parameter.default if text is None else parameter.parse(text)
        for listener in tuple(self.on_update):
            listener(self.active_id)

    def _set(self, set_id: str) -> dict[str, str]:
        if (values := self._sets.get(set_id)) is None:
            known = ", ".join(self._sets)
            raise RtcRefused(f"no configuration set {set_id!r}; known: {known}")
        return values

    def _check(self, name: str, text: str) -> None:
        if (parameter := self._parameters.get(name)) is None:
            known = ", ".join(self._parameters) or "none"
            raise RtcRefused(f"no parameter {name!r}; known: {known}")
        parameter.parse(text)
