"""Emulated CANopen nodes with power supply, CAN plug and named signals."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import ClassVar, Final, Protocol

from tickrig.device.canopen.slave import TICK_US, Application, CanopenSlave
from tickrig.device.horizon import Horizon
from tickrig.device.physical import InputSignal, OutputSignal, QuantityBank, SignalType
from tickrig.device.twin import Copyable
from tickrig.emulators.bench.operator import Assembly
from tickrig.emulators.can.bus_device import Accepted
from tickrig.emulators.can.outside.bridge import CountingPort, PortBefore
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen import signals
from tickrig.host.text.log import log_of
from tickrig.host.text.names import near
from tickrig.host.text.values import Setting
from tickrig.wire.can import CanFrame, ErrorState, Frames
from tickrig.wire.canopen import sdo_frame
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID, NmtState
from tickrig.wire.instant import NEVER

# One emulated CANopen node: a slave with power supply, CAN plug and signals.

_STATE_NAMES: Final = {
    NmtState.INITIALISING: "Initialising",
    NmtState.STOPPED: "Stopped",
    NmtState.OPERATIONAL: "Operational",
    NmtState.PRE_OPERATIONAL: "Pre-operational",
}
_ERROR_STATE_NAMES: Final = {
    ErrorState.ACTIVE: "error-active",
    ErrorState.PASSIVE: "error-passive",
    ErrorState.BUS_OFF: "bus-off",
}
_OFF: Final = "Off"


NODE_OUTPUTS: Final = (
    OutputSignal("state", "NMT state, or Off"),
    OutputSignal("node_id", "active node-ID, 255 while it has none"),
    OutputSignal("can_state", "fault confinement of its CAN controller"),
)


class Node(Copyable):
    """A CANopen slave as a `Device[Frames]`, with the inputs and outputs of its application.

    Without power the node neither sends nor receives, and it restarts when power returns. Changes
    of objects by name and reports of its CAN controller take effect at the start of its next tick.
    A bus-off controller starts its recovery at once, as with most drivers.

    Not emulated: a change of the bit rate of the bus. LSS switches the bit rate of the node only.

    Args:
        name: prefix of the node's signals among the signals of other nodes.
        slave: the slave.
        wire: bus of the node.

    Attributes:
        application: the application of the device.
        port: end of the bus at the node.
        physical: physical inputs by name.
        groups: names of physical inputs that are set together, by name of the group.
        outputs: physical outputs by name.
        on_set: function that is called with the name and the value of each input or object that was
            set by name.
        on_crash: function that is called with an exception of the slave's program. The program then
            restarts, as after a watchdog. Without `on_crash` the exception is raised here.
    """

    _new_in_twins: ClassVar[Mapping[str, object]] = {"on_set": None, "on_crash": None}

    def __init__(self, name: str, slave: CanopenSlave, wire: CanWire) -> None:
        self.name, self.slave, self.application = name, slave, Application.of(slave)
        self.port = wire.end()
        self.port.auto_recovery = True
        self._wire, self._on, self._ticked = wire, True, False
        self._coasts_us = NEVER
        self._pending: list[Callable[[], None]] = []
        self.on_set: signals.OnSet | None = None
        self.on_crash: Callable[[Exception], object] | None = None
        bank = self.application.inputs
        self.physical: Mapping[str, signals.NodeSignal] = {
            "power_off": signals.SwitchSignal("power_off", "its supply is cut", self._switch),
            "unplugged": signals.SwitchSignal("unplugged", "its CAN plug is pulled", self._plug),
            "emergency": signals.Emergency(slave, self._defer),
            **{
                name: signals.Quantity(bank, item, self._coast) for name, item in bank.table.items()
            },
        }
        self.groups = bank.groups
        self.outputs: Mapping[str, OutputSignal] = {
            **{item.name: item for item in NODE_OUTPUTS},
            **self.application.outputs,
        }

    @property
    def is_on(self) -> bool:
        """Whether the node has power."""
        return self._on

    @property
    def tick_us(self) -> int:
        """The control period."""
        return self.slave.tick_us

    @property
    def inputs(self) -> QuantityBank:
        """The physical inputs of its application."""
        return self.application.inputs

    @property
    def due_us(self) -> int:
        """Time at which the slave is due."""
        if self._pending:
            return 0
        return self.slave.due_us if self._on else self._coasts_us

    @property
    def horizon(self) -> Horizon | None:
        """Time limits up to which the slave may compute ahead."""
        return self.slave.horizon

    @horizon.setter
    def horizon(self, horizon: Horizon | None) -> None:
        self.slave.horizon = horizon

    @property
    def accepts(self) -> Accepted:
        """CAN-IDs that the node receives."""
        return self.slave.accepts

    @property
    def reconfigured_by(self) -> frozenset[int]:
        """CAN-IDs of the frames that may change `accepts` when handled."""
        return self.slave.reconfigured_by

    @property
    def on_accepts(self) -> list[Callable[[], None]]:
        """Callback for a change of `accepts` or `reconfigured_by`."""
        return self.slave.on_accepts

    def bus_state(self, state: ErrorState, /) -> None:
        """Tell the slave, in its next tick, the new error state of its CAN controller.

        Args:
            state: new state: error active, error passive or bus-off.
        """
        self._defer(partial(self.slave.bus_state, state))

    def reset(self) -> None:
        """Reset the node as at power-on."""
        self.slave.reset()

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        """Tick the slave, if the node has power."""
        if not self._on:
            self._pending.clear()
            if now_us >= self._coasts_us:
                self._coasts_us = self.application.without_power(now_us)
            return ()
        try:
            if self._ticked and self._pending:
                self._catch_up(now_us)
            self._ticked = True
            return self.slave.tick(now_us, rx)
        except Exception as error:
            if self.on_crash is None:
                raise
            self.on_crash(error)
            self._begin_anew(self.on_crash)
            return ()

    def signal(self, name: str) -> signals.NodeSignal | None:
        """Return the signal with the name, or None if there is none."""
        signal = self.physical.get(name) or self._object(name)
        return signals.NotedSignal(signal, self.on_set) if signal and self.on_set else signal

    def _object(self, name: str) -> signals.NodeSignal | None:
        entry = signals.find_object(self.slave.dictionary, name)
        if entry is None:
            return None
        return signals.ObjectSignal(
            signals.object_name(self.slave.dictionary, entry), entry, self._defer
        )

    def signal_names(self) -> list[str]:
        """Return all names."""
        dictionary = self.slave.dictionary
        return [*self.physical, *(signals.object_name(dictionary, entry) for entry in dictionary)]

    def begin_with(self, start: Mapping[str, Setting]) -> None:
        """Set initial values of physical inputs and of objects before the first tick.

        Args:
            start: values by the names of the signals.

        Raises:
            ValueError: an input or object is unknown, or does not accept its value.
        """
        for name, value in start.items():
            if (signal := self.signal(name)) is None:
                raise ValueError(f"{self.name} has no input {name!r}")
            signal.write(value)

    def read(self, name: str) -> Setting:
        """Return the value of an output; raise KeyError if the name is unknown."""
        match name:
            case "state":
                return _STATE_NAMES[self.slave.state] if self._on and self._ticked else _OFF
            case "node_id":
                return self.slave.node_id
            case "can_state":
                return _ERROR_STATE_NAMES[self.port.controller.state]
        return self.application.read(name)

    def _defer(self, action: Callable[[], None]) -> None:
        """Schedule an action for the next tick; the action may change the accepted CAN-IDs."""
        self._pending.append(action)
        self.port.pass_all()

    def _catch_up(self, now_us: int) -> None:
        """Apply the actions since the last tick."""
        self.slave.now_us = now_us
        while self._pending:
            self._pending.pop(0)()

    def _begin_anew(self, on_crash: Callable[[Exception], object]) -> None:
        """Reset the slave; if the reset fails, the slave is dead until its power is switched."""
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
        """Advance the application while it is without power."""
        self._coasts_us = 0

    def _plug(self, pulled: Setting) -> None:
        if pulled:
            self._wire.disconnect(self.port)
        elif self._on:
            self._wire.reconnect(self.port)


# The physical side of nodes and bodies.


class _NodePart(Protocol):
    """A node, or a body on nodes: an object with a name and a physical side.

    Attributes:
        name: name of the part.
        physical: physical inputs by name.
        groups: names of physical inputs that are set together, by name of the group.
        outputs: physical outputs by name.
    """

    name: str
    physical: Mapping[str, signals.NodeSignal]
    groups: Mapping[str, tuple[str, ...]]
    outputs: Mapping[str, OutputSignal]

    def signal(self, name: str) -> signals.NodeSignal | None:
        """Return the signal with the name, or None if there is none."""

    def signal_names(self) -> list[str]:
        """Return all names."""
        ...

    def read(self, name: str) -> Setting:
        """Return the value of an output; raise KeyError if the name is unknown."""
        ...


class NodeSide:
    """The signals of a CANopen node or of a robot body: all its inputs and outputs by name.

    The objects of a node's dictionary are also signals.

    Args:
        part: the node, or the body.
    """

    tick_us: Final = TICK_US

    def __init__(self, part: _NodePart) -> None:
        self.outputs, self.read = part.outputs, part.read
        self.inputs = _NodeInputs(part)


def side_of(nodes: Sequence[Node], bodies: Sequence[_NodePart] = ()) -> Assembly:
    """Return one object with all inputs and outputs of the nodes of a bus and of robot bodies.

    If there is only one node, its signals have their plain names: `0x6000:1`, `state`. With several
    nodes the name of the node is a prefix: `5/0x6000:1`, `5/state`. The name of a body is a prefix
    as well, as in `body/x_m`. Without nodes, the signals of a single body have no prefix.
    """
    plain = nodes[0].name if len(nodes) == 1 else None
    return Assembly({part.name: NodeSide(part) for part in (*nodes, *bodies)}, plain)


class _NodeInputs:
    """The `Inputs` of a node: its physical side and every object of its dictionary.

    Attributes:
        table: inputs by name. The name of a variable may also include its sub-index.
        groups: names of several inputs that are set together.
    """

    def __init__(self, part: _NodePart) -> None:
        self._part, self.changed = part, False
        self.table: Mapping[str, InputSignal] = _Table(part)
        self.groups = part.groups

    def __getitem__(self, name: str) -> Setting:
        """Return the present value of an input."""
        return self._signal(name).read()

    def set(self, name: str, value: Setting) -> None:
        """Set a physical input or an object of the node.

        Raises:
            ValueError: the input does not exist, or does not accept the value.
        """
        self._signal(name).write(value)

    def check(self, name: str, value: Setting) -> Setting:
        """Check whether `set` would accept a value, and return the value.

        For some objects the check is incomplete: they refuse a value only when it is set.

        Raises:
            ValueError: the input does not exist, or does not accept the value.
        """
        return self._signal(name).check(value)

    def find(self, name: str, signal_type: SignalType | None = None) -> InputSignal:
        """Return the description of a physical input.

        Args:
            name: name of the input.
            signal_type: required type of the input, or None to accept any type.

        Raises:
            ValueError: no input has this name, or the input has another type.
        """
        item = self.table.get(name)
        if item is None or signal_type not in (None, item.type):
            wanted = signal_type.value if signal_type else "input"
            names = self.names(signal_type) if signal_type else self.table
            raise ValueError(f"no {wanted} {name!r}; {near(name, names)}")
        return item

    def names(self, signal_type: SignalType) -> tuple[str, ...]:
        """Return the names of all inputs of a type; objects are levels and texts."""
        if signal_type in (SignalType.BUTTON, SignalType.FAULT):
            physical = self._part.physical.items()
            return tuple(name for name, signal in physical if signal.item.type is signal_type)
        return tuple(name for name in self.table if self.table[name].type is signal_type)

    def _signal(self, name: str) -> signals.NodeSignal:
        if (signal := self._part.signal(name)) is None:
            raise ValueError(f"no input {name!r}; {near(name, self.table)}")
        return signal


class _Table(Mapping[str, InputSignal]):
    """The descriptions, created on request because nodes have many objects."""

    def __init__(self, part: _NodePart) -> None:
        self._part = part

    def __getitem__(self, name: str) -> InputSignal:
        if (signal := self._part.signal(name)) is None:
            raise KeyError(name)
        return signal.item

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and self._part.signal(name) is not None

    def __iter__(self) -> Iterator[str]:
        return iter(self._part.signal_names())

    def __len__(self) -> int:
        return len(self._part.signal_names())


# Detection of duplicate nodes on a bus outside.

_NODE_ID: Final = 0x7F
_BASES: Final = (0x080, sdo_frame.RESPONSE_COB_ID, ERROR_CONTROL_COB_ID)
_OF_NODES: Final = frozenset(base + node for base in _BASES for node in range(1, _NODE_ID + 1))
"""CAN-IDs of EMCYs, SDO answers and error control, each of which only one node sends."""

_logger = log_of(__name__)


class SecondNodeAlarm(PortBefore):
    """A port that warns if another node on the real bus has the node-ID of an emulated node.

    There is one warning for each node. The port checks boot-ups, heartbeats, answers to guarding,
    EMCYs and SDO answers. A second node that sends no such frame is not detected. A second node is
    also not detected while the emulated node has no power.

    Args:
        port: the port on the bus.
        nodes: the emulated nodes.
    """

    def __init__(self, port: CountingPort, nodes: Sequence[Node]) -> None:
        super().__init__(port)
        self._alone = list(nodes)

    def poll(self, now_us: int, /) -> Frames:
        """Read the frames that other nodes have sent."""
        frames = super().poll(now_us)
        for frame in frames:
            if frame.can_id in _OF_NODES and self._alone:
                self._look(frame)
        return frames

    def _look(self, frame: CanFrame) -> None:
        if frame.extended or not frame.data:
            return
        node_id = frame.can_id & _NODE_ID
        for node in self._alone:
            if node.slave.node_id == node_id and node.is_on:
                self._alone.remove(node)
                text = "node-ID %d is on the bus twice: another node sent %s; stop one of the two"
                _logger.warning(text, node_id, frame)
                return
