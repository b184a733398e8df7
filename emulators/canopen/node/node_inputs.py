"""What the world does to a CANopen node: its supply, its plug, its device's own inputs."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final

from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.physical import Input, QuantityBank, SignalType
from tickrig.emulators.canopen.node.signals import Later
from tickrig.host.text.values import Setting

ERROR_BITS: Final = {0x2: 0x02, 0x3: 0x04, 0x4: 0x08}
"""Bit of the error register by the first digit of an emergency error code (CiA 301)."""

COMMUNICATION_ERRORS: Final = range(0x8100, 0x8200)


class Switch:
    """A physical fault of every node; see `Signal`.

    Args:
        name: what it is called.
        text: what it is, for people.
        switch: told the new value.
    """

    def __init__(self, name: str, text: str, switch: Callable[[int], None]) -> None:
        self.item = Input(name, text, SignalType.FAULT)
        self._switch, self._value = switch, 0

    def read(self) -> int:
        """Return 1 while the fault is there."""
        return self._value

    def check(self, value: Setting) -> int:
        """Return the value, or raise ValueError."""
        if not isinstance(value, int) or value not in (0, 1):
            raise ValueError(f"{self.item.name} {value!r} is not in 0..1")
        return int(value)

    def write(self, value: Setting) -> None:
        """Let the fault come or go."""
        self._value = self.check(value)
        self._switch(self._value)


class Emergency:
    """An error that the application sees: its emergency error code, 0 when it is gone.

    Args:
        slave: the slave.
        later: where it is left.
    """

    def __init__(self, slave: CanopenSlave, later: Later) -> None:
        text = "error seen by the application: emergency error code, 0 when it is gone"
        self.item = Input("emergency", text, high=0xFFFF)
        self._slave, self._later, self._code = slave, later, 0

    def read(self) -> int:
        """Return the code that was set last."""
        return self._code

    def check(self, value: Setting) -> int:
        """Return the value, or raise ValueError."""
        if not isinstance(value, int) or not 0 <= value <= 0xFFFF:
            raise ValueError(f"emergency {value!r} is not in 0..65535")
        return value

    def write(self, value: Setting) -> None:
        """Clear the error before, raise this one."""
        old, self._code = self._code, self.check(value)
        if old and old != self._code:
            self._later(partial(self._slave.emergency_clear, old))
        if code := self._code:
            self._later(partial(self._slave.emergency, code, _register_bit(code)))


class Quantity:
    """A physical input of the device itself: a voltage, a load, a blocked shaft.

    Args:
        bank: the inputs of the node's application.
        item: which of them.
        on_change: called after each change.
    """

    def __init__(self, bank: QuantityBank, item: Input, on_change: Callable[[], None]) -> None:
        self._bank, self.item, self._on_change = bank, item, on_change

    def read(self) -> float:
        """Return the present value."""
        return self._bank[self.item.name]

    def check(self, value: Setting) -> float:
        """Return the value, or raise ValueError."""
        return self._bank.check(self.item.name, value)

    def write(self, value: Setting) -> None:
        """Set it; the device's next tick sees it."""
        self._bank.set(self.item.name, value)
        self._on_change()


def _register_bit(code: int) -> int:
    if code in COMMUNICATION_ERRORS:
        return 0x10
    return ERROR_BITS.get(code >> 12, 0x01)
