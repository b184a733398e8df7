"""Interface of devices for emulators: ticks and signals."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from tickrig.device.core import Device, W
from tickrig.device.physical import InputSignal, OutputSignal, SignalType
from tickrig.host.text.values import Setting


class Inputs(Protocol):
    """Interface of a collection of the physical inputs of a device, such as an `InputBank`.

    Attributes:
        changed: whether an input was set since the device last checked its inputs.
    """

    changed: bool

    @property
    def table(self) -> Mapping[str, InputSignal]:
        """All inputs, in order of declaration."""
        ...

    @property
    def groups(self) -> Mapping[str, tuple[str, ...]]:
        """Names of the inputs that are set together, by name of their group."""
        ...

    def __getitem__(self, name: str, /) -> Setting:
        """Return the present value of an input."""
        ...

    def set(self, name: str, value: Setting) -> None:
        """Set an input; raise ValueError if it does not exist or does not accept the value."""

    def check(self, name: str, value: Setting) -> Setting:
        """Return the value that `set` would store, or raise as `set` would."""
        ...

    def names(self, signal_type: SignalType) -> tuple[str, ...]:
        """Return the names of all inputs of a type."""
        ...

    def find(self, name: str, signal_type: SignalType | None = None) -> InputSignal:
        """Return the description of an input.

        Args:
            name: name of the input.
            signal_type: required type of the input, or None to accept any type.

        Raises:
            ValueError: no input has this name, or the input has another type.
        """
        ...


class HasSignals(Protocol):
    """A device with named inputs and outputs, to be set and read between ticks."""

    @property
    def tick_us(self) -> int:
        """The control period in microseconds."""
        ...

    @property
    def inputs(self) -> Inputs:
        """Physical inputs of the device."""
        ...

    @property
    def outputs(self) -> Mapping[str, OutputSignal]:
        """Physical outputs of the device."""
        ...

    def read(self, name: str, /) -> Setting:
        """Return the present value of an output; raise KeyError if the name is unknown."""
        ...


class Emulated(Device[W], HasSignals, Protocol[W]):
    """A device on a wire, with signals."""


def read_signal(device: HasSignals, name: str) -> Setting:
    """Return the present value of an input or output of a device.

    Raises KeyError if the device has no input or output with this name.
    """
    return device.inputs[name] if name in device.inputs.table else device.read(name)
