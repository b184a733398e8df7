"""One emulated CANopen node: a slave with power, a plug and a hand inside."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import ClassVar, Final

from tickrig.device.canopen.core.application import Application
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.horizon import Horizon
from tickrig.device.physical import OutputSignal, QuantityBank
from tickrig.device.twin import Copyable
from tickrig.emulators.can.bus_device import Accepted
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.node.noted_signal import NotedSignal, OnSet
from tickrig.emulators.canopen.node.signals import (
    Emergency,
    ObjectSignal,
    Quantity,
    Signal,
    Switch,
    find_object,
    object_name,
)
from tickrig.host.text.values import Setting
from tickrig.wire.can import Frames
from tickrig.wire.can_error import ErrorState
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.instant import NEVER

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

NODE_INPUTS: Final = ("power_off", "unplugged", "emergency")
"""Every node has these beside those of its device."""

NODE_OUTPUTS: Final = (
    OutputSignal("state", "NMT state, or Off"),
    OutputSignal("node_id", "active node-ID, 255 while it has none"),
    OutputSignal("can_state", "fault confinement of its CAN controller"),
)


class Node(Copyable):
    """A `Device[Frames]` around a slave, with the physical side of its application.

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
        application: what the device does with its objects.
        port: its end of the bus.
        physical: what the world does to it, by name.
        groups: names of several of these that are set together.
        outputs: what the world sees of it, by name.
        on_set: called with each input or object that was set by name, and its value.
        on_crash: called with what the program of the slave raises, which then begins anew, as
            after a watchdog; without it that is raised here.
    """

    _new_in_twins: ClassVar[Mapping[str, object]] = {"on_set": None, "on_crash": None}

    def __init__(self, name: str, slave: CanopenSlave, wire: CanWire) -> None:
        self.name, self.slave, self.application = name, slave, Application.of(slave)
        self.port = wire.end()
        self.port.auto_recovery = True
        self._wire, self._on, self._ticked = wire, True, False
        self._coasts_us = NEVER
        self._pending: list[Callable[[], None]] = []
        self.on_set: OnSet | None = None
        self.on_crash: Callable[[Exception], object] | None = None
        bank = self.application.inputs
        self.physical: Mapping[str, Signal] = {
            "power_off": Switch("power_off", "its supply is cut", self._switch),
            "unplugged": Switch("unplugged", "its CAN plug is pulled", self._plug),
            "emergency": Emergency(slave, self._defer),
            **{name: Quantity(bank, item, self._coast) for name, item in bank.table.items()},
        }
        self.groups = bank.groups
        self.outputs: Mapping[str, OutputSignal] = {
            **{item.name: item for item in NODE_OUTPUTS},
            **self.application.outputs,
        }

    @property
    def is_on(self) -> bool:
        """Whether it has power."""
        return self._on

    @property
    def tick_us(self) -> int:
        """The control period."""
        return self.slave.tick_us

    @property
    def inputs(self) -> QuantityBank:
        """The physical inputs of its application, whoever sets them."""
        return self.application.inputs

    @property
    def due_us(self) -> int:
        """When the slave is due."""
        if self._pending:
            return 0
        return self.slave.due_us if self._on else self._coasts_us

    @property
    def horizon(self) -> Horizon | None:
        """How far the slave may work ahead."""
        return self.slave.horizon

    @horizon.setter
    def horizon(self, horizon: Horizon | None) -> None:
        self.slave.horizon = horizon

    @property
    def accepts(self) -> Accepted:
        """CAN-IDs that it listens to."""
        return self.slave.accepts

    @property
    def reconfigured_by(self) -> frozenset[int]:
        """CAN-IDs of the frames that may change `accepts` when handled."""
        return self.slave.reconfigured_by

    @property
    def on_accepts(self) -> list[Callable[[], None]]:
        """Whom to call when these two have changed."""
        return self.slave.on_accepts

    def bus_state(self, state: ErrorState, /) -> None:
        """Hear of a change of its CAN controller; the slave hears of it in the next tick."""
        self._defer(partial(self.slave.bus_state, state))

    def reset(self) -> None:
        """Power-on reset."""
        self.slave.reset()

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        """Tick the slave, if it has power."""
        if not self._on:
            self._pending.clear()
            if now_us >= self._coasts_us:
                self._coasts_us = self.application.without_power(now_us)
            return ()
        try:
            if self._ticked:
                self._catch_up(now_us)
            self._ticked = True
            return self.slave.tick(now_us, rx)
        except Exception as error:
            if self.on_crash is None:
                raise
            self.on_crash(error)
            self._begin_anew(self.on_crash)
            return ()

    def signal(self, name: str) -> Signal | None:
        """Return the thing of this name, None if there is none."""
        signal = self.physical.get(name) or self._object(name)
        return NotedSignal(signal, self.on_set) if signal and self.on_set else signal

    def _object(self, name: str) -> Signal | None:
        entry = find_object(self.slave.dictionary, name)
        if entry is None:
            return None
        return ObjectSignal(object_name(self.slave.dictionary, entry), entry, self._defer)

    def signal_names(self) -> list[str]:
        """Return all names."""
        dictionary = self.slave.dictionary
        return [*self.physical, *(object_name(dictionary, entry) for entry in dictionary)]

    def begin_with(self, start: Mapping[str, Setting]) -> None:
        """Set inputs and objects that are not as usual when it begins; ValueError if it cannot."""
        for name, value in start.items():
            if (signal := self.signal(name)) is None:
                raise ValueError(f"{self.name} has no input {name!r}")
            signal.write(value)

    def read(self, name: str) -> Setting:
        """Return an output; KeyError if there is none."""
        match name:
            case "state":
                return STATE_NAMES[self.slave.state] if self._on and self._ticked else OFF
            case "node_id":
                return self.slave.node_id
            case "can_state":
                return ERROR_STATE_NAMES[self.port.controller.state]
        return self.application.read(name)

    def _defer(self, action: Callable[[], None]) -> None:
        """Act at the beginning of the next tick: what is heard in it may then be another."""
        self._pending.append(action)
        self.port.pass_all()

    def _catch_up(self, now_us: int) -> None:
        """Let what was done since the last tick take effect."""
        self.slave.now_us = now_us
        while self._pending:
            self._pending.pop(0)()

    def _begin_anew(self, on_crash: Callable[[Exception], object]) -> None:
        """Reset the slave; one that cannot begin anew is dead until its power is switched."""
        self._pending.clear()
        try:
            self.slave.reset()
        except Exception as error:
            self._on = False
            on_crash(error)

    def _switch(self, off: int) -> None:
        if off:
            self._wire.cut_power(self.port)
        elif not self._on:
            self.slave.reset()
        self._on, self._ticked = not off, self._ticked and not off
        self._coast()
        self._plug(self.physical["unplugged"].read())

    def _coast(self) -> None:
        """Let the application go on, if it is without power."""
        self._coasts_us = 0

    def _plug(self, pulled: Setting) -> None:
        if pulled:
            self._wire.disconnect(self.port)
        elif self._on:
            self._wire.reconnect(self.port)
