"""Options of a device, declared once for command lines, rig files and traces.

A `DeviceType` has a `DeviceField` for each of its options. The command line is made from these
fields (`commands/run_options.py`), and a rig file is read with them. A trace of a device type
without `configure` may have no other keys. Command lines and rig files refuse a value with the
same message.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping
from contextlib import contextmanager
from math import isnan
from typing import TYPE_CHECKING, Any, NamedTuple

from tickrig._lazy import LazyModule

if TYPE_CHECKING:
    from tickrig.host.text import names
else:  # completion does without
    names = LazyModule("tickrig.host.text.names")


class DeviceField(NamedTuple):  # a dataclass takes 2 ms more to import
    """An option of a device; pass its attributes by name.

    Attributes:
        name: key of the option in the configuration for `DeviceType.build`.
        kind: type of the value: `str`, `int`, `float`, or `bool` for a flag.
        option: name on command lines (without the dashes) and in rig files. The default is `name`
            with dashes.
        low: smallest value of a number, or None for no limit.
        high: largest value of a number, or None for no limit.
        choices: allowed texts, or empty if any text is allowed.
        proposals: texts that the shell completes. Other texts are allowed, too.
        unit: unit of a number, or form of a text, which the help shows: `M`, `X,Y,RADIUS`.
        default: value if the option is not given.
        many: whether the option can be given several times. The value is then a tuple.
        help: help text of one sentence.
        needs: names of other fields. The field has an effect only if one of these fields is set.
    """

    name: str
    kind: type[str | int | float] = str
    option: str = ""
    low: float | None = None
    high: float | None = None
    choices: tuple[str, ...] = ()
    proposals: tuple[str, ...] = ()
    unit: str = ""
    default: Any = None
    many: bool = False
    help: str = ""
    needs: tuple[str, ...] = ()

    @property
    def word(self) -> str:
        """Name of the option on command lines, without the dashes."""
        return self.option or self.name.replace("_", "-")

    @property
    def unset(self) -> Any:
        """Value of the field if the option is not given."""
        if self.many:
            return tuple(self.default or ())
        return self.default if self.kind is not bool else bool(self.default)

    def read(self, value: str | float) -> Any:
        """Return the value of this field, converted from the value in a rig file.

        The field is also an option of the command line. The rules and error messages are the same.

        Raises:
            ValueError: the value is out of range, or has a wrong type.

        >>> DeviceField(name="baud", kind=int, low=300).read("9600")
        9600
        """
        text, number = str(value), 0.0
        if self.kind is str:
            if self.choices and text not in self.choices:
                several = "one of " if len(self.choices) > 1 else ""
                raise ValueError(f"{text!r} is not {several}{', '.join(map(repr, self.choices))}.")
            return text
        ranged = self.low is not None or self.high is not None
        try:
            number = int(text) if self.kind is int else float(text)
        except ValueError:
            named = {int: "integer", float: "float"}[self.kind] + " range" * ranged
            raise ValueError(f"{text!r} is not a valid {named}.") from None
        if ranged and isnan(number):
            raise ValueError(f"{number} is no number.")
        if not (self.low is None or self.low <= number) or not (
            self.high is None or number <= self.high
        ):
            raise ValueError(f"{number} is not in the range {self._range}.")
        return number

    @property
    def _range(self) -> str:
        if self.low is None:
            return f"x<={self.high}"
        return f"x>={self.low}" if self.high is None else f"{self.low}<=x<={self.high}"


def read_config(
    owner: str, fields: Iterable[DeviceField], config: Mapping[str, object]
) -> dict[str, Any]:
    """Return the values of all configuration fields of a device type, including the defaults.

    Args:
        owner: name of the device type, for error messages.
        fields: configuration fields of the device type.
        config: given values by option name. The names are those of the command line without leading
            dashes: `run-s` or `run_s`. A field with several values gets a list. Missing options get
            their default.

    Raises:
        ValueError: an option is unknown, or a value is invalid. The message begins with the option.
    """
    known = {field.word: field for field in fields}
    given: dict[str, Any] = {}
    for key, value in config.items():
        field = known.get(key.replace("_", "-"))
        if field is None:
            raise ValueError(f"{key}: {owner} has no such option; {names.near(key, known)}")
        given[key] = _plain(key, field, value)
    values = {field.name: field.unset for field in known.values()}
    for key, plain in given.items():
        field = known[key.replace("_", "-")]
        if field.kind is bool:
            values[field.name] = plain[0]
            continue
        with named(f"--{field.word}"):
            read = tuple(map(field.read, plain))
        if read or field.many:
            values[field.name] = read if field.many else read[-1]
    check_needed(known.values(), values, {known[key.replace("_", "-")].name for key in given})
    return values


def check_needed(
    fields: Iterable[DeviceField], values: Mapping[str, object], given: Container[str]
) -> None:
    """Raise ValueError if the user has set a field that has no effect without another field.

    Args:
        fields: configuration fields of a device type.
        values: values of all fields by field name.
        given: names of the fields for which the user has given a value. If the user has given the
            default value of a field, this field raises no error.
    """
    known = {field.name: field for field in fields}
    for name, field in known.items():
        idle = field.needs and not any(values[other] for other in field.needs)
        if idle and name in given and values[name] != field.unset:
            words = [f"--{known[other].word}" for other in field.needs]
            others = " or ".join(filter(None, [", ".join(words[:-1]), words[-1]]))
            raise ValueError(f"--{field.word} does nothing without {others}")


def _plain(key: str, field: DeviceField, value: object) -> list[Any]:
    """Return the values of a field in a file as a list; raise ValueError for a wrong type."""
    if field.kind is bool:
        if not isinstance(value, bool):
            raise ValueError(f"{key}: {value!r} is not true or false")
        return [value]
    if isinstance(value, list) and not field.many:
        raise ValueError(f"{key}: it is given once, not as a list")
    values = value if isinstance(value, list) else [value]
    for each in values:
        if not isinstance(each, int | float | str) or isinstance(each, bool):
            raise ValueError(f"{key}: {each!r} is not a number or a text")
    return values


@contextmanager
def named(option: str) -> Iterator[None]:
    """Prefix the message of a ValueError with the name of an option."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"{option}: {error}") from None
