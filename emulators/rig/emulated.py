"""What an emulator needs of a device: that it can be ticked, and has signals."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from tickrig.device.core import Device, W
from tickrig.device.physical import InputSignal, OutputSignal, SignalType
from tickrig.host.text.values import Setting


class Inputs(Protocol):
    """What the world does to a device, by name; `InputBank` is one.

    Attributes:
        changed: whether anything was set since the device last looked.
    """

    changed: bool

    @property
    def table(self) -> Mapping[str, InputSignal]:
        """All inputs, in order of declaration."""
        ...

    @property
    def groups(self) -> Mapping[str, tuple[str, ...]]:
        """Names of several inputs that are set together."""
        ...

    def __getitem__(self, name: str, /) -> Setting:
        """Return the present value of an input."""
        ...

    def set(self, name: str, value: Setting) -> None:
        """Set an input; ValueError if there is none, or it does not take the value."""

    def check(self, name: str, value: Setting) -> Setting:
        """Return the value that it would be set to, or raise as `set` would."""
        ...

    def names(self, signal_type: SignalType) -> tuple[str, ...]:
        """Return the names of all inputs of a type."""
        ...

    def find(self, name: str, signal_type: SignalType | None = None) -> InputSignal:
        """Return the description of an input; ValueError if there is none of this type."""
        ...


class HasSignals(Protocol):
    """A device with named inputs and outputs, to be set and read between ticks."""

    @property
    def tick_us(self) -> int:
        """The control period in microseconds."""
        ...

    @property
    def inputs(self) -> Inputs:
        """What the world does to the device."""
        ...

    @property
    def outputs(self) -> Mapping[str, OutputSignal]:
        """What the world sees of the device."""
        ...

    def read(self, name: str, /) -> Setting:
        """Return the present value of one output; KeyError if there is none."""
        ...


class Emulated(Device[W], HasSignals, Protocol[W]):
    """A device on a wire, with signals."""


def read_signal(device: HasSignals, name: str) -> Setting:
    """Return the present value of an input or output; KeyError if there is none."""
    return device.inputs[name] if name in device.inputs.table else device.read(name)
