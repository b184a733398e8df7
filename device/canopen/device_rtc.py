"""An RT component on a CANopen device: life cycle, ports, terminals."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from enum import Enum
from functools import partial
from typing import ClassVar, Final, Generic, TypeVar

from tickrig.device.canopen.dictionary import Dictionary, Entry
from tickrig.device.canopen.pdo.tpdo import PdoProducer
from tickrig.device.canopen.slave import Application, CanopenSlave, Nonvolatile, ServiceMaker
from tickrig.device.canopen.stack import make_slave
from tickrig.device.component import CallbackRunner, DeviceComponent, Result, Timer, declared, shown
from tickrig.device.physical import InputSignal, OutputSignal, QuantityBank, SignalType
from tickrig.wire import rtc_canopen
from tickrig.wire.canopen.nmt import NmtCommand, NmtState

# Data ports of a DeviceRTC: a value in the dictionary, carried by a PDO.

T = TypeVar("T")


class _CanopenPort(Generic[T]):
    """Base of both kinds of ports.

    Args:
        name: name of the port: a letter, then up to 31 letters, digits and underscores.
        port_type: type of the values. `SHORT.sequence(4)` makes a port of four values.
        cob_id: CAN-ID of the PDO, or None to use the CAN-ID of the pre-defined connection set,
            which only the first four ports of each direction have. Without a CAN-ID the PDO is off.
        transport: transport of the values. None selects a PDO if the type fits into one PDO, or
            else SDO.
    """

    direction: ClassVar[rtc_canopen.PortDirection]

    def __init__(
        self,
        name: str,
        port_type: rtc_canopen.CanopenPortType[T],
        *,
        cob_id: int | None = None,
        transport: rtc_canopen.PortTransport | None = None,
    ) -> None:
        self.name, self.port_type = name, port_type
        self.cob_id, self.transport = cob_id, transport
        self.entries: Sequence[Entry] = ()

    def join(self, entries: Sequence[Entry], event: Callable[[Entry], None]) -> None:
        """Use the given entries of the object dictionary to hold the value of the port.

        Args:
            entries: entries of the dictionary, one for each element of the value.
            event: function that sends the TPDOs of an entry. The port calls this function with the
                entry when the entry is to be sent.
        """
        self.entries, self._event = entries, event

    @property
    def profile(self) -> rtc_canopen.CanopenPortProfile:
        """The port as an entry of the component's profile."""
        return rtc_canopen.CanopenPortProfile(
            self.name, self.direction, self.port_type, self.cob_id, self.transport
        )

    @property
    def value(self) -> T:
        """The present value."""
        return self.port_type.decode([entry.data for entry in self.entries])


class CanopenInPort(_CanopenPort[T]):
    """An in-port of a component: the bus writes its value by RPDO or SDO, the component reads it.

    Attributes:
        is_new: whether the bus has written the port since the component last read it. Writing the
            same value again also counts.
    """

    direction: ClassVar[rtc_canopen.PortDirection] = rtc_canopen.PortDirection.IN
    is_new: bool = False

    def join(self, entries: Sequence[Entry], event: Callable[[Entry], None]) -> None:
        """Keep the value of the port in the given objects, and record each write."""
        super().join(entries, event)
        for entry in entries:
            entry.written = self._on_written

    def read(self) -> T:
        """Return the present value, which is then no longer new."""
        self.is_new = False
        return self.value

    def _on_written(self, entry: Entry) -> None:
        self.is_new = True


class CanopenOutPort(_CanopenPort[T]):
    """An out-port of a component: the component writes its value, and a TPDO sends it to the bus.

    The TPDO is sent once in each tick in which the component writes the port.
    """

    direction: ClassVar[rtc_canopen.PortDirection] = rtc_canopen.PortDirection.OUT

    def write(self, value: T) -> None:
        """Set the value of the port.

        While the component is Active, the TPDO of the port is sent even if the value has not
        changed.

        Raises:
            ValueError: the value does not have the type of the port.
        """
        for entry, data in zip(self.entries, self.port_type.encode(value), strict=True):
            entry.assign(data)
            self._event(entry)


# What a developer writes: the ports of a DeviceRTC, and what it does in each state.


class CanopenComponent(DeviceComponent):
    """A component on a CANopen device; a subclass defines its properties and callbacks.

    The objects of the ports begin at 2100h, in the order of declaration. Reset Node makes a new
    component, as power-on does.

    Attributes:
        type_name: type of the component. `RtcProfile` describes this attribute and the next five.
        version: version of the component, such as 1.0.
        vendor: maker of the component.
        category: category of the component.
        rate_hz: rate at which `on_execute`, `error_check` and `on_error` run (DECISION K12).
        product_code: value of 1018h:02. 0 derives the value from the type name.
        strict_cia301: whether NMT commands leave the state Error as in CiA 301 (DECISION K9).

    Raises:
        ValueError: the profile or a port is invalid.

    >>> from tickrig.device.canopen.device_rtc import CanopenInPort, CanopenOutPort
    >>> from tickrig.wire.rtc_canopen import LONG
    >>> class Doubler(CanopenComponent):
    ...     type_name = "Doubler"
    ...     number = CanopenInPort("number", LONG)
    ...     double = CanopenOutPort("double", LONG)
    ...
    ...     def on_execute(self) -> None:
    ...         self.double.write(2 * self.number.read())
    >>> [f"{port.index:04X}h {port.profile.name}" for port in Doubler.profile().placed()]
    ['2100h number', '2101h double']
    """

    version: ClassVar[str] = "1.0"
    vendor: ClassVar[str] = ""
    category: ClassVar[str] = ""
    rate_hz: ClassVar[int] = 100
    product_code: ClassVar[int] = 0
    strict_cia301: ClassVar[bool] = False

    def __init__(self) -> None:
        self.inputs = QuantityBank(self.physical)
        self.ports = {port.name: port for port in self._own_ports(_CanopenPort)}

    @classmethod
    def profile(cls) -> rtc_canopen.RtcProfile:
        """Return the profile of the component; raise ValueError if it is invalid."""
        try:
            return rtc_canopen.RtcProfile(
                type_name=cls.type_name,
                version=cls.version,
                vendor=cls.vendor,
                category=cls.category,
                rate_hz=cls.rate_hz,
                product_code=cls.product_code,
                ports=tuple(port.profile for _, port in declared(cls, _CanopenPort)),
            )
        except ValueError as error:
            raise ValueError(f"{cls.__name__}: {error}") from None

    def error_check(self) -> Result:
        """Check the device for errors. A component may override this callback.

        It is called once a period while the component is Inactive. Returning an error changes the
        state to Error.
        """


class CanopenEcho(CanopenComponent):
    """A component with one in-port and one out-port, both of type Long."""

    type_name = "Echo"
    vendor = "tickrig"
    category = "example"
    inlet = CanopenInPort("in", rtc_canopen.LONG)
    outlet = CanopenOutPort("out", rtc_canopen.LONG)

    def on_execute(self) -> None:
        """Copy new values from the in-port to the out-port."""
        if self.inlet.is_new:
            self.outlet.write(self.inlet.read())


# States of a DeviceRTC and the callbacks of each transition (NEDO report, 3.4.43.3, Table 3, Fig.
# 110).
#
# Where the figure and the table leave a case open, decisions K6 to K13 of the project apply.


class RtcState(Enum):
    """State of a component in its life cycle (OMG RTC 1.1, LifeCycleState).

    `FINALIZED` is an additional state: the component has ended.
    """

    CREATED = "Created"
    INACTIVE = "Inactive"
    ACTIVE = "Active"
    ERROR = "Error"
    FINALIZED = "Finalized"


_STATES: Final = {
    NmtState.INITIALISING: RtcState.CREATED,
    NmtState.PRE_OPERATIONAL: RtcState.INACTIVE,
    NmtState.OPERATIONAL: RtcState.ACTIVE,
    NmtState.STOPPED: RtcState.ERROR,
}
"""States of an initialized component by NMT state (Table 3)."""

_ACTIVITIES: Final = {
    RtcState.INACTIVE: "error_check",
    RtcState.ACTIVE: "on_execute",
    RtcState.ERROR: "on_error",
}
"""The periodic callback of each state."""

_Effects = Mapping[NmtCommand, tuple[str, ...]]

_MOVES: Final[_Effects] = {
    NmtCommand.START: (),
    NmtCommand.STOP: (),
    NmtCommand.ENTER_PRE_OPERATIONAL: (),
}
_RESETS: Final[_Effects] = {
    NmtCommand.RESET_NODE: ("on_reset",),
    NmtCommand.RESET_COMMUNICATION: ("on_reset",),
}
_ADMITTED: Final[Mapping[RtcState, _Effects]] = {
    RtcState.CREATED: {NmtCommand.RESET_NODE: ()},  # K11
    RtcState.INACTIVE: {
        **_MOVES,
        NmtCommand.RESET_NODE: ("on_finalize",),
        NmtCommand.RESET_COMMUNICATION: (),
    },
    RtcState.ACTIVE: {
        **_MOVES,
        NmtCommand.RESET_NODE: ("on_deactivated", "on_finalize"),
        NmtCommand.RESET_COMMUNICATION: ("on_deactivated",),
    },
    RtcState.ERROR: _RESETS,  # K8, K9
    RtcState.FINALIZED: {},
}
"""Permitted commands, and the callback that runs before each (M8, M9, K10)."""

_STRICT_ERROR: Final[_Effects] = {
    **_RESETS,
    NmtCommand.START: ("on_reset",),
    NmtCommand.ENTER_PRE_OPERATIONAL: ("on_reset",),
}
"""Permitted commands and their callbacks in Error with `strict_cia301` (K9)."""

_ENTERED: Final[Mapping[tuple[NmtState, NmtState], tuple[str, ...]]] = {
    (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL): ("on_activated",),  # M2
    (NmtState.STOPPED, NmtState.OPERATIONAL): ("on_activated",),  # K9
    (NmtState.OPERATIONAL, NmtState.PRE_OPERATIONAL): ("on_deactivated",),  # M3
    (NmtState.OPERATIONAL, NmtState.STOPPED): ("on_deactivated", "on_aborting"),  # M6, M7, K6
}
"""The callback after a change of the NMT state; none on M4 and M5 (K7)."""

_ENDING: Final = {
    RtcState.INACTIVE: ("on_finalize",),
    RtcState.ACTIVE: ("on_deactivated", "on_finalize"),
    RtcState.ERROR: ("on_finalize",),
}
"""The callback before the end (M11)."""


# The life cycle of RTC inside the NMT states (NEDO report, 3.4.43.3, Fig. 110).


class CanopenLifeCycle(CallbackRunner[CanopenComponent]):
    """Life cycle of a component: runs its callbacks when the NMT state of the CANopen node changes.

    Once the component is initialized, the NMT state of the node determines the state of the
    component. When the NMT state changes, the services of the node are notified first. Then the
    callbacks for the new state run. It does not matter what changes the NMT state: the NMT master,
    the error behaviour or the component itself.

    Args:
        node: CANopen slave on which the component runs.
        make: function that makes a component. The values of its ports are in the object dictionary
            of the slave.

    Attributes:
        component: present component. A reset of the node makes a new component.
    """

    def __init__(self, node: CanopenSlave, make: Callable[[], CanopenComponent]) -> None:
        self._node, self._make = node, make
        self.create()

    def create(self) -> None:
        """Make a new component (M1)."""
        super().__init__(self._make())
        self._initialized = self._finalized = False

    @property
    def state(self) -> RtcState:
        """State of the component."""
        if self._finalized:
            return RtcState.FINALIZED
        return _STATES[self._node.state] if self._initialized else RtcState.CREATED

    @property
    def activity(self) -> str:
        """Name of the callback that runs periodically in the present state, such as `on_execute`.

        The name is empty if the state has no such callback or the component does not define it.
        """
        name = _ACTIVITIES.get(self.state, "")
        own = name and getattr(type(self.component), name) is not getattr(CanopenComponent, name)
        return name if own else ""

    def boots(self) -> bool:
        """Run `on_initialize` if it is due; return whether the node boots (M1, K11)."""
        if not self._initialized and not self._finalized:
            self._initialized = self.call("on_initialize")
        return self._initialized and not self._finalized

    def admits(self, command: NmtCommand) -> bool:
        """Run the callback before an NMT command; return whether to carry out the command."""
        state = self.state
        table = _ADMITTED[state]
        if state is RtcState.ERROR and self.component.strict_cia301:
            table = _STRICT_ERROR
        if command not in table:
            return False
        well = self._call_all(table[command])
        if state is RtcState.ERROR:
            return well
        if command is NmtCommand.RESET_NODE:
            self.create()
        return True

    def moved(self, old: NmtState, new: NmtState) -> None:
        """Run the callbacks of the component that belong to a change of the NMT state.

        The node calls this method after the change. If a callback returns an error, the component
        changes to the state Error.
        """
        well = self._call_all(_ENTERED.get((old, new), ()))
        if well or new is NmtState.STOPPED:
            return
        if old is NmtState.OPERATIONAL:
            self.call("on_aborting")
        self._node.enter(NmtState.STOPPED)

    def run(self) -> None:
        """Run the periodic callback of the present state, such as `on_execute`.

        If the callback returns an error, the component changes to the state Error (transitions M5
        and M6 of the life cycle).
        """
        if not self.call(self.activity) and self.state is not RtcState.ERROR:
            self._node.enter(NmtState.STOPPED)

    def finalize(self) -> None:
        """End the component for good, and run the callbacks for its end.

        This is transition M11 of the life cycle. Afterwards the node sends nothing until its
        supply has been cut and restored.
        """
        if self.state in _ENDING:
            self._call_all(_ENDING[self.state])
            self._finalized = True
            self._node.reset_node()

    def _call_all(self, callbacks: tuple[str, ...]) -> bool:
        """Run all given callbacks; return False if one failed."""
        results = [self.call(name) for name in callbacks]
        return all(results)


# The physical side of a DeviceRTC: what the component declares, its ports and its state.

_SHUT_DOWN: Final = "shut_down"

_INPUTS: Final = (
    InputSignal(
        _SHUT_DOWN,
        "button: the component ends, and the node is silent until a power cut",
        SignalType.BUTTON,
    ),
)
"""Physical inputs of every DeviceRTC; a component may add inputs."""

_OUTPUTS: Final = (
    OutputSignal("rtc_state", "Created, Inactive, Active, Error or Finalized"),
    OutputSignal("callback", "the callback that ran last"),
    OutputSignal("executed", "how often on_execute ran"),
)
"""Physical outputs of every DeviceRTC; each port adds its value as in.NAME or out.NAME."""


def _inputs_of(kind: type[CanopenComponent]) -> tuple[InputSignal, ...]:
    """Return the physical inputs of a component; raise ValueError if two have the same name."""
    table = (*_INPUTS, *kind.physical)
    name, count = Counter(item.name for item in table).most_common(1)[0]
    if count > 1:
        raise ValueError(f"{kind.__name__}: {count} inputs are called {name!r}")
    return table


def _outputs_of(component: CanopenComponent) -> dict[str, OutputSignal]:
    """Return the physical outputs of a component."""
    ports = [
        OutputSignal(
            f"{port.direction.value}.{port.name}", f"value of this {port.direction.value}-port"
        )
        for port in component.ports.values()
    ]
    return {output.name: output for output in (*_OUTPUTS, *ports)}


def _text_of(life: CanopenLifeCycle, name: str) -> float | str:
    """Return the present value of an output; raise KeyError if the name is unknown."""
    match name:
        case "rtc_state":
            return life.state.value
        case "callback":
            return life.latest
        case "executed":
            return life.executed
    return shown(life.component.ports[name.partition(".")[2]].value)


# DeviceRTC: a component at work in a CANopen slave.


class DeviceRtc(Application):
    """Application of a CANopen slave that runs an RT component, a "DeviceRTC".

    The state of the component follows the NMT state of the slave (NEDO report, 3.4.43.3, Fig. 110).
    Callbacks take no time. The periodic callback of a state runs for the first time one period
    after the component has entered the state.

    Not emulated: service ports, configuration sets, several components on one node.

    Args:
        node: the slave, whose dictionary contains the objects of the ports.
        slot: position of the application in the order in which services act in a tick.
        kind: class of the component.

    Attributes:
        life: the life cycle, with the component.

    Raises:
        ValueError: a physical input is invalid.
    """

    def __init__(self, node: CanopenSlave, slot: int, kind: type[CanopenComponent]) -> None:
        super().__init__(node, slot)
        self._kind, self._placed = kind, kind.profile().placed()
        self.has_inputs(_inputs_of(kind))
        self.life = CanopenLifeCycle(node, self._make)
        self.outputs: Mapping[str, OutputSignal] = _outputs_of(self.life.component)
        self._timer = Timer(kind.rate_hz)
        node.boots, node.admits = self.life.boots, self.life.admits
        node.entered = self._moved

    def read(self, name: str) -> float | str:
        """Return the value that a physical output had after the latest tick.

        Args:
            name: name of an output in `outputs`.

        Returns:
            The value of the output.

        Raises:
            KeyError: there is no output of that name.
        """
        return _text_of(self.life, name)

    def power_on(self) -> None:
        """Make a new component."""
        self.life.create()

    def start(self) -> None:
        """Do nothing until the node has booted."""
        self._timer.stop()

    def on_execute(self, now_us: int) -> None:
        """Run the periodic callback of the state if a period has ended."""
        if self.inputs[_SHUT_DOWN]:
            self.life.finalize()
        if self._timer.elapsed(now_us):
            self.life.run()
        self.schedule(self._timer.due_us)

    def _moved(self, old: NmtState, new: NmtState) -> None:
        """Restart the period for the new state, then run the callbacks."""
        self._timer.stop()
        if self.life.activity:
            self._timer.start(self.node.now_us)
        self.request()
        self.life.moved(old, new)

    def _make(self) -> CanopenComponent:
        """Make a component and join it to the dictionary."""
        component = self._kind()
        component.inputs = self.inputs
        for place in self._placed:
            entries = [self.node.dictionary[place.index, sub] for sub in place.subs]
            component.ports[place.profile.name].join(entries, self._event)
        return component

    def _event(self, entry: Entry) -> None:
        PdoProducer.of(self.node).request_for(entry)


def make_dictionary(kind: type[CanopenComponent]) -> Dictionary:
    """Make the objects of a component; raise ValueError if its profile is invalid."""
    table = rtc_canopen.object_table(kind.profile())
    return Dictionary(table, table.objects)


def application_of(kind: type[CanopenComponent]) -> ServiceMaker:
    """Return a function that makes the application for a component."""
    return partial(DeviceRtc, kind=kind)


def make_device_rtc(
    kind: type[CanopenComponent], node_id: int, nonvolatile: Nonvolatile | None = None
) -> CanopenSlave:
    """Make a CANopen slave that runs an RT component (a DeviceRTC).

    Args:
        kind: class of the component.
        node_id: node-ID 1..127, or 255 for a slave that waits for LSS.
        nonvolatile: memory with parameters from an earlier run, or None for empty memory.

    Raises:
        ValueError: the component or the node-ID is invalid.
    """
    return make_slave(make_dictionary(kind), node_id, nonvolatile, application_of(kind))
