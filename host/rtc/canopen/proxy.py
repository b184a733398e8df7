"""ProxyRTC, an RT component that represents a CANopen device (NEDO report, Figs. 108 and 109)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from typing import Any, Final, TypeVar

from tickrig.host.canopen.dialogue import Script
from tickrig.host.canopen.sdo_transfer import download, upload
from tickrig.host.rtc.canopen import pdo_layout
from tickrig.host.rtc.canopen.definition import NodeEntry, SdoPortEntry
from tickrig.host.rtc.component import ExecutionContext, ModuleSpec, RtComponent
from tickrig.host.rtc.ports.data_port import InPort, OutPort
from tickrig.host.rtc.ports.port import AnyPort
from tickrig.host.rtc.states import LifeCycleState, ReturnCode
from tickrig.wire import rtc_canopen
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.rtc_types.idl import Struct
from tickrig.wire.rtc_types.rtc import Time

# Ports of a PDO (ours: K2, K3, K4).


class _PortShape:
    """The ports of a PDO. All its objects share one port, or have one port each if types differ.

    Args:
        layout: layout of the PDO.
        name: name of the port, or the beginning of the names of ports for single objects.

    Attributes:
        names: names of the ports.
        types: the type that each port carries.
        single: whether one port carries all objects as a sequence.
    """

    def __init__(self, layout: pdo_layout.PdoLayout, name: str) -> None:
        fields = layout.fields
        kinds = {field.type.one for field in fields}
        many = fields[0].type.many if len(kinds) == 1 and len(fields) > 1 else None
        self.single = many is not None
        self.names: tuple[str, ...] = (name,)
        self.types: tuple[type[Struct], ...] = ()
        if many is not None:
            self.types = (many,)
        elif len(fields) == 1:
            self.types = (fields[0].type.one,)
        else:
            ends = (f"{one.mapped.index:04X}_{one.mapped.sub:02X}" for one in fields)
            self.names = tuple(f"{name}_{end}" for end in ends)
            self.types = tuple(field.type.one for field in fields)


class PdoSource:
    """A TPDO of a device, with the proxy's OutPorts to which the received values are written.

    Attributes:
        layout: layout of the PDO.
        size: minimum number of bytes of a frame.
        ports: OutPorts of the PDO.
    """

    def __init__(self, layout: pdo_layout.PdoLayout, name: str) -> None:
        shape = _PortShape(layout, name)
        self.layout, self.size, self._single = layout, layout.size, shape.single
        self._decode = pdo_layout.pdo_decoder(layout)
        self.ports = tuple(
            OutPort[Any](port, kind) for port, kind in zip(shape.names, shape.types, strict=True)
        )

    def receive(self, now_us: int, data: bytes) -> None:
        """Write the values of a received frame to the OutPorts, with the time of reception.

        Args:
            now_us: time of reception in us.
            data: data of the frame.
        """
        tm, values = Time.from_us(now_us), self._decode(data)
        if self._single:
            (port,) = self.ports
            if port.connectors:
                port.write(pdo_layout.sequence_of(port.data_type, tm, values))
            return
        for port, value in zip(self.ports, values, strict=True):
            if port.connectors:
                port.write(port.data_type(tm, value))


class PdoSink:
    """An RPDO of a device, with the proxy's InPorts whose values are sent to the device.

    An RPDO has either one InPort for all its objects, or one InPort for each object. For each value
    that arrives at an InPort, one frame is sent. If the value is for one object only, the frame
    also contains the last values of the other objects.

    Attributes:
        layout: layout of the PDO.
        ports: InPorts of the PDO.
        linked: whether another device sends this PDO. The server then does not send it.
    """

    def __init__(self, layout: pdo_layout.PdoLayout, name: str) -> None:
        shape = _PortShape(layout, name)
        self.layout, self._shape, self.linked = layout, shape, False
        self.ports = tuple(
            InPort[Any](port, kind) for port, kind in zip(shape.names, shape.types, strict=True)
        )
        self._latest: list[Value] = [field.type.decode(0) for field in layout.fields]

    def preset(self, index: int, value: Value) -> None:
        """Set the initial value of an object.

        The frames contain this value until a value arrives at the InPort of the object.
        """
        for place, field in enumerate(self.layout.fields):
            if field.mapped.index == index:
                self._latest[place] = value

    def clear(self) -> None:
        """Drop the values that have not been sent."""
        for port in self.ports:
            port.clear()

    def take(self) -> Iterator[tuple[str, Struct]]:
        """Take all new values of the InPorts, each with the name of its port."""
        for port in self.ports:
            while port.is_new:
                value = port.read()
                assert isinstance(value, port.data_type)
                yield port.name, value

    def encode(self, port: str, value: Struct) -> bytes:
        """Return the data of the frame that carries a new value of a port.

        Raise ValueError if the value does not fit.

        Args:
            port: name of the port.
            value: new value.
        """
        data: Any = getattr(value, "data", None)
        if not self._shape.single:
            latest = list(self._latest)
            latest[self._shape.names.index(port)] = data
        elif len(data) != len(self._latest):
            raise ValueError(f"{len(data)} values, {self.layout.name} has {len(self._latest)}")
        else:
            latest = list(data)
        encoded = self.layout.encode(tuple(latest))
        self._latest = latest
        return encoded


# Ports that SDO carries: texts, and what is wider than a PDO (ours: K5).

_T = TypeVar("_T", bound=Struct)

_TRANSPORT: Final = {"transport": rtc_canopen.PortTransport.SDO.value}
"""Additional properties in the profile of such a port."""


class _SdoOutPort(OutPort[_T]):
    """An OutPort whose profile contains its transport."""

    def _properties(self) -> Mapping[str, str]:
        return {**super()._properties(), **_TRANSPORT}


class _SdoInPort(InPort[_T]):
    """An InPort whose profile contains its transport."""

    def _properties(self) -> Mapping[str, str]:
        return {**super()._properties(), **_TRANSPORT}


@dataclass(frozen=True, slots=True)
class _SdoPortLayout:
    """The objects of a port that is transferred by SDO.

    Attributes:
        name: name of the port.
        direction: `out` if the object is read for the port, `in` if it is written from the port.
        index: index of the object.
        subs: sub-indices of the elements.
        kind: type of the value as in Table 4.
        struct: struct that the port carries.
    """

    name: str
    direction: rtc_canopen.PortDirection
    index: int
    subs: tuple[int, ...]
    kind: rtc_canopen.CanopenPortType[Any]
    struct: type[Struct]

    def read(self) -> Script[tuple[bytes, ...]]:
        """Read all elements in their order. The errors are those of `upload`."""
        elements = []
        for sub in self.subs:
            elements.append((yield from upload(self.index, sub, self.kind.data_type.size)))
        return tuple(elements)

    def decode(self, tm: Time, elements: Sequence[bytes]) -> Struct:
        """Convert the bytes read from the object to a value of the port.

        Raise FieldError if the bytes are invalid.
        """
        value: Any = self.kind.decode(elements)
        if not self.kind.element_bits:  # a string ends before the first 0, in C and in CORBA
            value = tuple(map(_text, value)) if self.kind.many else _text(value)
        kind: Any = self.struct
        return pdo_layout.sequence_of(kind, tm, value) if self.kind.many else kind(tm, value)

    def write(self, elements: Sequence[bytes]) -> Script[None]:
        """Write all elements in their order. The errors are those of `download`."""
        for sub, data in zip(self.subs, elements, strict=True):
            yield from download(self.index, sub, data)

    def encode(self, value: Struct) -> tuple[bytes, ...]:
        """Convert a value of the port to the bytes to write, one item per element of the object.

        Raise ValueError or TypeError if the value does not fit.
        """
        data: Any = getattr(value, "data", None)
        return self.kind.encode(tuple(data) if self.kind.many else data)


class SdoSource:
    """An OutPort of a proxy, and the object of the device that is read by SDO for this OutPort.

    Attributes:
        layout: layout of the object.
        port: OutPort that gets the value.
    """

    def __init__(self, layout: _SdoPortLayout) -> None:
        self.layout, self.port = layout, _SdoOutPort[Any](layout.name, layout.struct)


class SdoSink:
    """An InPort of a proxy, and the object of the device to which its values are written by SDO.

    Attributes:
        layout: layout of the object.
        port: InPort that provides the value.
        pending: bytes that are to be written, or None if there are none.
    """

    def __init__(self, layout: _SdoPortLayout) -> None:
        self.layout, self.port = layout, _SdoInPort[Any](layout.name, layout.struct)
        self.pending: tuple[bytes, ...] | None = None

    def take(self) -> Struct | None:
        """Remove all values from the InPort, and return the newest. Without values, return None."""
        value = None
        while self.port.is_new:
            value = self.port.read()
        return value

    def clear(self) -> None:
        """Drop the value that has not been written."""
        self.port.clear()
        self.pending = None


def lay_out_sdo_ports(
    entry: NodeEntry, data_types: Mapping[tuple[int, int], int]
) -> tuple[tuple[_SdoPortLayout, ...], tuple[str, ...]]:
    """Return the layouts of those ports of a node whose values are transferred by SDO.

    Args:
        entry: settings of the node.
        data_types: data types in the node's EDS, by index and sub-index.

    Returns:
        The layouts of the valid ports, and an error message for each invalid port.
    """
    made, refused = list[_SdoPortLayout](), list[str]()
    for name, port in entry.sdo_ports.items():
        try:
            made.append(_lay_out(name, port, data_types))
        except ValueError as error:
            refused.append(f"{name}: {error}")
    return tuple(made), tuple(refused)


def _lay_out(
    name: str, port: SdoPortEntry, data_types: Mapping[tuple[int, int], int]
) -> _SdoPortLayout:
    subs: tuple[int, ...] = (0,)
    if (port.index, 1) in data_types:
        subs = tuple(
            sub
            for sub in range(1, rtc_canopen.MOST_ELEMENTS + 1)
            if (port.index, sub) in data_types
        )
    found = {data_types.get((port.index, sub)) for sub in subs}
    if found == {None}:
        raise ValueError(f"the EDS has no object {port.index:04X}h")
    data_type = found.pop()
    if found or data_type is None:
        raise ValueError(f"the elements of {port.index:04X}h have several data types")
    for row, one, many in pdo_layout.PORT_KINDS:
        if row.data_type == data_type and (port.type or _usual(row)) == row.name:
            if len(subs) == 1 and subs == (0,):
                return _SdoPortLayout(name, port.direction, port.index, subs, row, one)
            kind = row.sequence(len(subs))
            return _SdoPortLayout(name, port.direction, port.index, subs, kind, many)
    wanted = port.type or "any type of a port"
    raise ValueError(f"{port.index:04X}h is {DataType(data_type).name} in the EDS, not {wanted}")


def _usual(row: rtc_canopen.CanopenPortType[Any]) -> str:
    """Return the default name of a row without `type`. A Unicode string is a text."""
    return "" if row is rtc_canopen.WIDE_CHARACTER else row.name


def _text(value: str) -> str:
    return value.partition("\0")[0]


_OK: Final = ReturnCode.RTC_OK


class ProxyRequest(Enum):
    """What a proxy wants the server to do with the device, such as to activate it.

    The server has not sent anything for this request to the bus yet.
    """

    NOTHING = auto()
    ACTIVATE = auto()
    DEACTIVATE = auto()
    ABORT = auto()
    RESET = auto()


NOTHING: Final = ProxyRequest.NOTHING
"""Value that is looked up once, because a look-up takes 0.1 us for each proxy in each period."""


class ProxyRtc(RtComponent):
    """RT component that represents a CANopen device in a system.

    The callbacks record requests. The server executes the requests on the bus after the period.
    on_reset fails until the device has booted again, so the proxy stays in Error until then.

    Not emulated: a CANopen node for the proxy on the bus (`visible_proxies` of K1).

    Args:
        entry: settings of the node in the System Definition.
        layouts: layouts of the PDOs of the device.
        sdo_layouts: objects of the device that have ports by SDO.

    Attributes:
        node_id: node-ID of the device.
        sources: TPDOs of the device, whose data go to OutPorts.
        sinks: RPDOs of the device, which take data from InPorts.
        sdo_sources: objects of the device whose values go to OutPorts.
        sdo_sinks: objects of the device that take values from InPorts.
        requested: request that the callbacks recorded.
        passing: whether data from the device reach the OutPorts, which is True between
            on_activated and on_deactivated.
        confirmed: whether the device has reported Operational. Only then are data sent to the
            device.
        ready: whether the device can leave Error.
    """

    spec = ModuleSpec("ProxyRTC", "A CANopen device", category="RTC-CANopen")

    def __init__(
        self,
        entry: NodeEntry,
        layouts: tuple[pdo_layout.PdoLayout, ...],
        sdo_layouts: tuple[_SdoPortLayout, ...] = (),
    ) -> None:
        super().__init__(entry.name)
        self.node_id = entry.id
        self.requested, self.ready = NOTHING, False
        self.passing = self.confirmed = False
        named = [(layout, entry.ports.get(layout.name, layout.name)) for layout in layouts]
        fit = [(layout, name) for layout, name in named if layout.fields and not layout.unknown]
        self.sources = tuple(PdoSource(layout, name) for layout, name in fit if layout.sends)
        self.sinks = tuple(PdoSink(layout, name) for layout, name in fit if not layout.sends)
        outs = [
            layout for layout in sdo_layouts if layout.direction is rtc_canopen.PortDirection.OUT
        ]
        self.sdo_sources = tuple(map(SdoSource, outs))
        self.sdo_sinks = tuple(SdoSink(layout) for layout in sdo_layouts if layout not in outs)
        ports: list[AnyPort] = [port for source in self.sources for port in source.ports]
        ports += (port for sink in self.sinks for port in sink.ports)
        ports += (source.port for source in self.sdo_sources)
        ports += (sink.port for sink in self.sdo_sinks)
        for port in ports:
            self.add_port(port)

    @property
    def state(self) -> LifeCycleState:
        """Life-cycle state of the proxy in its execution context, or Created without a context."""
        return self.contexts[0].state_of(self) if self.contexts else LifeCycleState.CREATED

    def take_request(self) -> ProxyRequest:
        """Return the recorded request and clear it."""
        requested, self.requested = self.requested, NOTHING
        return requested

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Let data from the device reach the OutPorts, and request Operational."""
        self.requested, self.passing, self.confirmed = ProxyRequest.ACTIVATE, True, False
        for sink in self.sinks:
            sink.clear()
        for written in self.sdo_sinks:
            written.clear()
        return _OK

    def on_deactivated(self, ec: ExecutionContext) -> ReturnCode:
        """Stop the data from the device, and request Pre-operational."""
        self.requested, self.passing, self.confirmed = ProxyRequest.DEACTIVATE, False, False
        return _OK

    def on_aborting(self, ec: ExecutionContext) -> ReturnCode:
        """Request Stopped. The request replaces the request of on_deactivated."""
        self.requested, self.ready = ProxyRequest.ABORT, False
        return _OK

    def on_reset(self, ec: ExecutionContext) -> ReturnCode:
        """Request a reset of the device. Return RTC_OK once the device has booted."""
        if self.ready:
            return _OK
        self.requested = ProxyRequest.RESET
        return ReturnCode.RTC_ERROR
