"""What an emulator needs of a device: that it can be ticked, touched and looked at."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from tickrig.device.core import Device, W
from tickrig.device.physical import Input, Kind, Output
from tickrig.host.text.values import Setting


class Inputs(Protocol):
    """What the world does to a device, by name; `InputBank` is one.

    Attributes:
        changed: whether anything was set since the device last looked.
    """

    changed: bool

    @property
    def table(self) -> Mapping[str, Input]:
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

    def names(self, kind: Kind) -> tuple[str, ...]:
        """Return the names of all inputs of a kind."""
        ...

    def find(self, name: str, kind: Kind | None = None) -> Input:
        """Return the description of an input; ValueError if there is none of the kind."""
        ...


class Touchable(Protocol):
    """A device that can be touched and looked at between ticks."""

    @property
    def tick_us(self) -> int:
        """The control period in microseconds."""
        ...

    @property
    def inputs(self) -> Inputs:
        """What the world does to the device."""
        ...

    @property
    def outputs(self) -> Mapping[str, Output]:
        """What the world sees of the device."""
        ...

    def read(self, name: str, /) -> Setting:
        """Return the present value of one output; KeyError if there is none."""
        ...


class Emulated(Device[W], Touchable, Protocol[W]):
    """A device on a wire that can be touched."""


def look_at(device: Touchable, name: str) -> Setting:
    """Return the present value of an input or output; KeyError if there is none."""
    return device.inputs[name] if name in device.inputs.table else device.read(name)
