"""A configuration parameter: text in a configuration set, a typed value in the component."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import isfinite
from typing import Any, Final, Generic, TypeVar

from tickrig.host.rtc.configuration.constraint import Constraint
from tickrig.host.rtc.errors import RtcRefused

V = TypeVar("V", bound=bool | int | float | str | tuple[int | float | str, ...])

_BOOLS: Final[Mapping[str, bool]] = {
    **dict.fromkeys(("1", "true", "yes", "on"), True),
    **dict.fromkeys(("0", "false", "no", "off"), False),
}


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
