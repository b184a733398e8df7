"""The hands at one real device, and the eyes on it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from tickrig.emulators.bench.fault_spec import FaultSpec
from tickrig.emulators.rig.emulated import HasSignals
from tickrig.host.text.values import Setting


class DeviceOperator(Protocol):
    """An operator: a human at the terminal, or an emulator that stands in for one.

    Names are those of the device alone, without the name of the device.

    Attributes:
        said_no: a human saw what should not be; that counts however late the machine was.
        quick: does something the moment that it is to be done.
    """

    said_no: bool
    quick: bool

    @property
    def late_us(self) -> int:
        """How late the device was, as far as anybody knows."""
        ...

    def prepare(self, like: HasSignals) -> None:
        """Bring the device to where such a one begins, without its power, if that can be done."""

    def begin(self) -> None:
        """Give it its power, if `prepare` took it."""

    def set(self, name: str, values: tuple[Setting, ...]) -> None:
        """Set an input, or all inputs of a group."""

    def set_all(self, values: Mapping[str, Setting]) -> None:
        """Set several inputs, before the device has its power."""

    def get(self, name: str) -> Setting:
        """Return the present value of an input or output."""
        ...

    def press(self, name: str, duration_us: int) -> None:
        """Press a button and let it go."""

    def fault(self, spec: FaultSpec, now_us: int, for_us: int | None) -> None:
        """Let a fault come; its times are those of the bench, where it is `now_us`."""

    def clear(self, fault: str) -> None:
        """Let a fault go."""

    def sees(self, text: str) -> bool | None:
        """Say whether something is seen; None if the device itself is to be asked."""
        ...

    def have_done(self, text: str) -> bool:
        """Have something done, told in words; False if nobody is here who understands them."""
        ...

    def switch_power(self, *, on: bool) -> None:
        """Give or take the supply."""

    def close(self) -> None:
        """Go home."""
