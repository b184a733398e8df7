"""The physical side of a device: named inputs and outputs with units.

Scenario files, the control socket, panels and tests all use these names. They have no other access
to a device.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from math import isfinite

from tickrig._compiled import mypyc_attr
from tickrig.device.twin import Immutable


class SignalType(Enum):
    """Type of a physical input of a device: quantity, button, text or fault.

    Attributes:
        LEVEL: a quantity, such as the position of a stick, a voltage or a load.
        BUTTON: button, whose value is 1 while the button is pressed.
        TEXT: text, or bytes in hex.
        FAULT: physical fault, whose value is 1 while the fault is present.
    """

    LEVEL = "level"  # a quantity: a stick, a voltage, a load
    BUTTON = "button"  # 1 while pressed
    TEXT = "text"  # words, or bytes in hex
    FAULT = "fault"  # 1 while the physical fault is present


@dataclass(frozen=True, slots=True)
class InputSignal(Immutable):
    """Description of a physical input: what a user or the surroundings can change at the device.

    Attributes:
        name: name in scenario files and panels.
        text: description as readable text.
        type: type of the input: level, button, text or fault.
        low: smallest value.
        high: largest value.
        unit: unit of the value, or empty for a plain number.
        initial: value at the start of the rig.
        real: whether the input accepts fractions. A device keeps such an input in a `QuantityBank`.
        counts: three numbers for an input with an analogue converter. They are in counts, the unit
            of the device's object that shows the input: the count at `low`, the count at `high`,
            and the counts of one step of the converter. The tuple is empty if the input has no
            converter.
    """

    name: str
    text: str
    type: SignalType = SignalType.LEVEL
    low: int | float = 0
    high: int | float = 1
    unit: str = ""
    initial: int | float = 0
    real: bool = False
    counts: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class OutputSignal(Immutable):
    """Description of a physical output: a property of the device that an observer can see.

    Attributes:
        name: name in scenario files and panels.
        text: description as readable text.
        unit: unit of the value, or empty for a plain number.
    """

    name: str
    text: str
    unit: str = ""


@mypyc_attr(allow_interpreted_subclasses=True)
class QuantityBank:
    """The present values of all physical inputs of a device.

    A value is a whole number, or may have a fraction if the input has `real` set.
    `bank["supply_v"]` is the present value. A change takes effect at the device's next tick.

    Args:
        table: descriptions of the inputs.
        groups: names of inputs that are set together, by name of the group, such as `stick`.
        on_change: function that is called after each change.

    Attributes:
        table: the inputs by name, in order of declaration.
        groups: names of inputs that are set together, by name of the group.
        changed: whether an input was set since the device last checked.

    >>> bank = QuantityBank([InputSignal("supply_v", "supply", high=15, initial=12.5, real=True)])
    >>> bank.set("supply_v", 11.75)
    >>> bank["supply_v"]
    11.75
    """

    __slots__ = ("_on_change", "_values", "changed", "groups", "table")

    def __init__(
        self,
        table: Iterable[InputSignal] = (),
        groups: Mapping[str, tuple[str, ...]] | None = None,
        on_change: Callable[[], None] | None = None,
    ) -> None:
        self.table: Mapping[str, InputSignal] = {item.name: item for item in table}
        self.groups: Mapping[str, tuple[str, ...]] = dict(groups or {})
        self._values = {name: item.initial for name, item in self.table.items()}
        self._on_change, self.changed = on_change, True

    def __setitem__(self, name: str, value: object) -> None:
        """Raise TypeError, because an input is set by `set`, which checks the value."""
        raise TypeError(f"an input is set by a call: bank.set({name!r}, {value!r})")

    def __getitem__(self, name: str) -> int | float:
        """Return the present value of an input."""
        return self._values[name]

    def set(self, name: str, value: int | float | str) -> None:
        """Set the value of a physical input.

        Args:
            name: name of the input.
            value: the new value, in the unit and range of the input.

        Raises:
            ValueError: the input is unknown, or the value is a wrong kind of number or out of
                range.
        """
        self._values[name] = self.check(name, value)
        self.changed = True
        if self._on_change is not None:
            self._on_change()

    def check(self, name: str, value: int | float | str) -> int | float:
        """Check whether `set` would accept a value, without setting it.

        Args:
            name: name of the input.
            value: the value to check.

        Returns:
            The value that `set` would store.

        Raises:
            ValueError: the input is unknown, or `set` would refuse the value.
        """
        item = self.find(name)
        whole = isinstance(value, int) and not isinstance(value, bool)
        fraction = item.real and isinstance(value, float) and isfinite(value)
        if isinstance(value, str) or not (whole or fraction):
            kind = "number" if item.real else "whole number"
            raise ValueError(f"{name} takes a {kind}, not {value!r}")
        if not item.low <= value <= item.high:
            unit = f" {item.unit}" if item.unit else ""
            raise ValueError(f"{name} {value} is not in {item.low}..{item.high}{unit}")
        return value

    def names(self, signal_type: SignalType) -> tuple[str, ...]:
        """Return the names of the inputs of one type, such as all buttons.

        Args:
            signal_type: type of the inputs.

        Returns:
            The names of the inputs, in order of declaration.
        """
        return tuple(item.name for item in self.table.values() if item.type is signal_type)

    def find(self, name: str, signal_type: SignalType | None = None) -> InputSignal:
        """Return the description of an input.

        Args:
            name: name of the input.
            signal_type: required type of the input, or None for any type.

        Returns:
            The description of the input.

        Raises:
            ValueError: the input is unknown, or has another type.
        """
        item = self.table.get(name)
        if item is None or signal_type not in (None, item.type):
            wanted = signal_type.value if signal_type else "input"
            known = self.names(signal_type) if signal_type else tuple(self.table)
            raise ValueError(f"no {wanted} {name!r}; known: {', '.join(known) or 'none'}")
        return item


@mypyc_attr(allow_interpreted_subclasses=True)
class InputBank(QuantityBank):
    """The present values of the physical inputs of a device, if all of them are whole numbers.

    `bank["button"]` is the present value. A change takes effect at the device's next tick.

    Args:
        table: descriptions of the inputs.
        groups: names of inputs that are set together, by name of the group, such as `stick`.
        on_change: function that is called after each change.

    Attributes:
        table: the inputs by name, in order of declaration.
        groups: names of inputs that are set together, by name of the group.
        changed: whether an input was set since the device last checked.

    Raises:
        ValueError: an input of the table accepts fractions, which needs a `QuantityBank`.
    """

    __slots__ = ()

    def __init__(
        self,
        table: Iterable[InputSignal] = (),
        groups: Mapping[str, tuple[str, ...]] | None = None,
        on_change: Callable[[], None] | None = None,
    ) -> None:
        super().__init__(table, groups, on_change)
        for name, item in self.table.items():
            if item.real:
                told = f"InputBank takes whole numbers, and {name} is real: use QuantityBank"
                raise ValueError(told)

    def __getitem__(self, name: str) -> int:
        """Return the present value of an input."""
        return int(self._values[name])
