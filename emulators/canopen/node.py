"""One emulated CANopen node: a slave with power, a plug and a hand inside."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from tickrig.device.canopen.slave import CanopenSlave
from tickrig.device.core import NEVER
from tickrig.device.physical import Input, Kind, Output
from tickrig.emulators.can_wire import CanWire
from tickrig.emulators.canopen.touch import (
    Later,
    ObjectTouch,
    Touch,
    find_object,
    object_name,
)
from tickrig.emulators.setting import Setting
from tickrig.wire.can import Frames
from tickrig.wire.can_error import ErrorState
from tickrig.wire.canopen.nmt import NmtState

STATE_NAMES: Final = {
    NmtState.INITIALISING: "Initialising",
    NmtState.STOPPED: "Stopped",
    NmtState.OPERATIONAL: "Operational",
    NmtState.PRE_OPERATIONAL: "Pre-operational",
}
ERROR_STATE_NAMES: Final = {
    ErrorState.ACTIVE: "error-active",
    ErrorState.PASSIVE: "error-passive",
    ErrorState.BUS_OFF: "bus-off",
}
OFF: Final = "Off"

NODE_OUTPUTS: Final = (
    Output("state", "NMT state, or Off"),
    Output("node_id", "active node-ID, 255 while it has none"),
    Output("can_state", "fault confinement of its CAN controller"),
)

ERROR_BITS: Final = {0x2: 0x02, 0x3: 0x04, 0x4: 0x08}
"""Bit of the error register by the first digit of an emergency error code (CiA 301)."""

COMMUNICATION_ERRORS: Final = range(0x8100, 0x8200)


class Node:
    """A `Device[Frames]` around a slave.

    Without power it neither sends nor hears, and begins anew when power is back.
    What is done to it from the inside, and what its CAN controller reports,
    takes effect at the beginning of its next tick. A controller that is bus-off is
    told to recover at once, as most drivers do.

    Not emulated: LSS switches the bit rate of the node alone; the bus keeps its own.

    Args:
        name: prefix of the names of its things among those of other nodes.
        slave: the slave.
        wire: its bus.

    Attributes:
        port: its end of the bus.
    """

    def __init__(self, name: str, slave: CanopenSlave, wire: CanWire) -> None:
        self.name, self.slave = name, slave
        self.port = wire.end()
        self.port.on_error_state = self._error_state_changed
        self._wire, self._on, self._ticked = wire, True, False
        self._pending: list[Callable[[], None]] = []
        self.physical: Mapping[str, Touch] = {
            "power_off": _Switch("power_off", "its supply is cut", self._switch),
            "unplugged": _Switch("unplugged", "its CAN plug is pulled", self._plug),
            "emergency": _Emergency(slave, self._pending.append),
        }

    @property
    def tick_us(self) -> int:
        """The control period."""
        return self.slave.tick_us

    @property
    def due_us(self) -> int:
        """When the slave is due."""
        if self._pending:
            return 0
        return self.slave.due_us if self._on else NEVER

    @property
    def accepts(self) -> frozenset[int]:
        """CAN-IDs that it listens to."""
        return self.slave.accepts

    def reset(self) -> None:
        """Power-on reset."""
        self.slave.reset()

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        """Tick the slave, if it has power."""
        if not self._on:
            self._pending.clear()
            return ()
        if self._ticked:
            self._catch_up(now_us)
        self._ticked = True
        return self.slave.tick(now_us, rx)

    def touch(self, name: str) -> Touch | None:
        """Return the thing of this name, None if there is none."""
        if (physical := self.physical.get(name)) is not None:
            return physical
        entry = find_object(self.slave.dictionary, name)
        if entry is None:
            return None
        return ObjectTouch(object_name(self.slave.dictionary, entry), entry, self._pending.append)

    def touchable(self) -> list[str]:
        """Return all names."""
        dictionary = self.slave.dictionary
        return [*self.physical, *(object_name(dictionary, entry) for entry in dictionary)]

    def read(self, name: str) -> Setting:
        """Return an output; KeyError if there is none."""
        match name:
            case "state":
                return STATE_NAMES[self.slave.state] if self._on and self._ticked else OFF
            case "node_id":
                return self.slave.node_id
            case "can_state":
                return ERROR_STATE_NAMES[self.port.controller.state]
        raise KeyError(name)

    def _catch_up(self, now_us: int) -> None:
        """Let what was done since the last tick take effect."""
        self.slave.now_us = now_us
        while self._pending:
            self._pending.pop(0)()

    def _switch(self, off: int) -> None:
        if off:
            self._wire.cut_power(self.port)
        elif not self._on:
            self.slave.reset()
        self._on, self._ticked = not off, self._ticked and not off
        self._plug(self.physical["unplugged"].read())

    def _plug(self, pulled: Setting) -> None:
        if pulled:
            self._wire.disconnect(self.port)
        elif self._on:
            self._wire.reconnect(self.port)

    def _error_state_changed(self, now_us: int, state: ErrorState) -> None:
        self._pending.append(lambda: self.slave.bus_state(state))
        if state is ErrorState.BUS_OFF:
            self.port.recover(now_us)


class _Switch:
    """A physical fault."""

    def __init__(self, name: str, text: str, switch: Callable[[int], None]) -> None:
        self.item = Input(name, text, Kind.FAULT)
        self._switch, self._value = switch, 0

    def read(self) -> int:
        return self._value

    def check(self, value: Setting) -> int:
        if not isinstance(value, int) or value not in (0, 1):
            raise ValueError(f"{self.item.name} {value!r} is not in 0..1")
        return int(value)

    def write(self, value: Setting) -> None:
        self._value = self.check(value)
        self._switch(self._value)


class _Emergency:
    """An error that the application sees: its emergency error code, 0 when it is gone."""

    def __init__(self, slave: CanopenSlave, later: Later) -> None:
        text = "error seen by the application: emergency error code, 0 when it is gone"
        self.item = Input("emergency", text, high=0xFFFF)
        self._slave, self._later, self._code = slave, later, 0

    def read(self) -> int:
        return self._code

    def check(self, value: Setting) -> int:
        if not isinstance(value, int) or not 0 <= value <= 0xFFFF:
            raise ValueError(f"emergency {value!r} is not in 0..65535")
        return value

    def write(self, value: Setting) -> None:
        old, self._code = self._code, self.check(value)
        if old and old != self._code:
            self._later(lambda: self._slave.emergency_clear(old))
        if code := self._code:
            self._later(lambda: self._slave.emergency(code, _register_bit(code)))


def _register_bit(code: int) -> int:
    if code in COMMUNICATION_ERRORS:
        return 0x10
    return ERROR_BITS.get(code >> 12, 0x01)
