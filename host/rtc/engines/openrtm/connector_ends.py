"""The local end of a connector, which makes and receives calls (OpenRTM-aist 1.x, CorbaPort)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from types import SimpleNamespace
from typing import Any, Final

from omniORB import CORBA

from tickrig.host.rtc.engines import peer_ports
from tickrig.host.rtc.engines.openrtm.orb import Orb, Reference, explain, nvlist
from tickrig.host.rtc.engines.openrtm.stubs import stubs
from tickrig.host.rtc.ports.connect import connect
from tickrig.host.rtc.ports.connector import DataflowType
from tickrig.host.rtc.ports.data_port import DataPort, InPort, OutPort
from tickrig.host.rtc.ports.port import ConnectorBase, InterfaceProfile
from tickrig.host.rtc.ports.service_port import Consumer, Provider, ServicePort
from tickrig.host.rtc.states import PortStatus, RtcRefused
from tickrig.host.rtc.system.call_queue import CallQueue
from tickrig.host.rtc.system.peer_thread import PeerThread, PeerThreads
from tickrig.host.text.log import log_of
from tickrig.wire.rtc_types.cdr import Endian

# Properties of ports and connectors: NVLists of CORBA, and the texts in them.

_Properties = list[Any]
"""An NVList. Each item has a `name` and a `value`, which is an Any."""

ENDIAN: Final = "dataport.serializer.cdr.endian"
DATA_TYPE: Final = "dataport.data_type"
INTERFACE: Final = "dataport.interface_type"
CORBA_CDR: Final = "corba_cdr"
_DIRECT: Final = "direct"
"""Interface type between ports of one process, for saved systems and rtresurrect."""

_BOTH: Final = ",".join(Endian)


def texts(properties: _Properties) -> dict[str, str]:
    """Return the properties that are texts or numbers, as texts. Others are left out."""
    found: dict[str, str] = {}
    for item in properties:
        value = item.value.value()
        if isinstance(value, str | int | float):
            found[item.name] = str(value)
    return found


def changed(properties: _Properties, values: Mapping[str, str]) -> _Properties:
    """Return a copy of properties in which some values are replaced or added."""
    kept = [item for item in properties if item.name not in values]
    return kept + nvlist(values)


def completed(properties: _Properties) -> _Properties:
    """Return the properties of a connector, with the default byte orders if they have none."""
    return properties if ENDIAN in texts(properties) else changed(properties, {ENDIAN: _BOTH})


def agreed_endian(text: str) -> Endian:
    """Return the byte order for a connector, which is the first known one of a list.

    Args:
        text: byte orders, separated by commas. An empty text means little endian.

    Raises:
        RtcRefused: no byte order of the list is known.
    """
    words = [word.strip().lower() for word in text.split(",") if word.strip()] or [Endian.LITTLE]
    known = [endian for word in words for endian in Endian if endian == word]
    if not known:
        raise RtcRefused(f"{ENDIAN}: {text!r} is not one of: {', '.join(Endian)}")
    return known[0]


def _agreed(port: DataPort[Any], values: dict[str, str]) -> dict[str, str]:
    """Return the settings of a connector of a data port with a peer.

    Raises:
        RtcRefused: the interface type is not corba_cdr, the data type is not that of the port, or
            the byte order is unknown.
    """
    if (interface := values.get(INTERFACE, CORBA_CDR)) != CORBA_CDR:
        raise RtcRefused(f"{INTERFACE}: {interface!r} is not {CORBA_CDR}")
    ours = port.data_type.idl_id()
    if (theirs := values.get(DATA_TYPE, ours)) not in (ours, port.data_type.__name__):
        raise RtcRefused(f"{DATA_TYPE}: {theirs!r} is not {ours}")
    return {**values, INTERFACE: CORBA_CDR, ENDIAN: agreed_endian(values.get(ENDIAN, ""))}


def offered(port: DataPort[Any]) -> dict[str, str]:
    """Return the properties that a data port reports to OpenRTM tools, such as rtcon.

    The tools compare the properties of two ports to find out whether the ports can be connected.
    """
    subscriptions = "Any" if isinstance(port, InPort) else "flush,new,periodic"
    return {
        "port.port_type": port.port_type,
        DATA_TYPE: port.data_type.idl_id(),
        INTERFACE: f"{CORBA_CDR},{_DIRECT}",
        "dataport.dataflow_type": "push,pull",
        "dataport.subscription_type": subscriptions,
    }


# Our end of a connector with a peer: the properties for the peer, and those from the peer.


@dataclass(frozen=True, slots=True)
class ConnectorPlace:
    """Objects and names that a `ConnectorEnd` needs: ORB, threads, queues and connector names.

    Attributes:
        orb: ORB of this process.
        calls: queue that runs calls in the manager's thread, also between two ticks.
        threads: threads that call other processes. All data ports share these threads.
        post: function that schedules a call in the manager's thread. The call waits until just
            before the next tick.
        connector_id: ID of the connector.
        name: name of the connector, for display.
        peer: name of the port in the other process, for display.
    """

    orb: Orb
    calls: CallQueue
    threads: PeerThreads
    post: Callable[[Callable[[], object]], object]
    connector_id: str
    name: str
    peer: str

    def end(self, properties: dict[str, str]) -> peer_ports.PeerEnd:
        """Return the settings of the connector, with the properties that apply."""
        return peer_ports.PeerEnd(self.peer, self.connector_id, properties, self.name)


class ConnectorEnd(ABC):
    """Base class for the local half of a connector to a port in another process.

    Only the manager's thread may use it.

    Attributes:
        thread: thread that calls the other process, one call after the other, or None until it is
            started.
    """

    def __init__(self, place: ConnectorPlace) -> None:
        self._place = place
        self._served: list[Reference] = []
        self.thread: PeerThread | None = None

    @abstractmethod
    def publish(self, values: dict[str, str]) -> dict[str, str]:
        """Serve the CORBA objects of this end that the other process will call, if there are any.

        Args:
            values: properties of the connector.

        Returns:
            Properties that tell the other process where the objects are. They are empty if no
            object is served.

        Raises:
            RtcRefused: the properties are invalid.
        """

    @abstractmethod
    def join(self, values: dict[str, str]) -> ConnectorBase:
        """Connect the local port with the object of the other process, and return the connector.

        This method does not call the other process.

        Args:
            values: properties of the connector, including those from the other process.

        Raises:
            RtcRefused: the properties are invalid.
        """

    def close(self) -> None:
        """Stop serving peers."""
        for reference in self._served:
            self._place.orb.withdraw(reference)
        self._served.clear()

    def calling_thread(self) -> PeerThread:
        """Return the thread that makes calls to the peer."""
        if self.thread is None:
            self.thread = PeerThread(self._place.peer)
        return self.thread

    def serve(self, interface: str, answers: object) -> str:
        """Serve an object until the end of the connector. Return its IOR."""
        self._served.append(self._place.orb.serve(stubs().skeleton(interface), answers))
        return self._place.orb.text(self._served[-1])

    def reference(self, ior: str, kind: Any) -> Reference:
        """Return the CORBA reference that an IOR contains, as a reference to a given interface.

        This method does not check that the object in the other process has this interface. If the
        object has another interface, the first call ends with an error.

        Args:
            ior: text of the IOR (interoperable object reference).
            kind: stub class of the interface.

        Raises:
            RtcRefused: the text is not a reference.
        """
        try:
            found = self._place.orb.reference(ior)
        except ValueError as error:
            raise RtcRefused(str(error)) from error
        if found is None:
            raise RtcRefused("the peer gives no reference")
        return found._unchecked_narrow(kind)


# InPortCdr and OutPortCdr: clients of a peer's objects, and servants for the peer.

_LOG: Final = log_of(__name__)

_GONE: Final = (CORBA.TRANSIENT, CORBA.TIMEOUT, CORBA.COMM_FAILURE, CORBA.OBJECT_NOT_EXIST)
"""CORBA exceptions that mean that a peer did not answer. All other exceptions are answers."""

_EMPTY: Final = (PortStatus.BUFFER_EMPTY, PortStatus.BUFFER_TIMEOUT)


class NoAnswerError(Exception):
    """A CORBA call had no answer: the process does not run or hangs, or the object has ended."""


class _Complaints:
    """A log of a peer's faults. The first fault is logged, and again the first after a success."""

    def __init__(self, peer: str) -> None:
        self._peer, self._complained = peer, False

    def wrong(self, what: str) -> None:
        if not self._complained:
            _LOG.warning("%s: %s", self._peer, what)
        self._complained = True

    def right(self) -> None:
        self._complained = False

    def raised(self, error: CORBA.SystemException) -> None:
        """Process the exception of a call. Raise NoAnswerError if the peer did not answer."""
        if isinstance(error, _GONE):
            raise NoAnswerError(explain(error)) from None
        self.wrong(f"the peer answers with {type(error).__name__}")


class InPortClient:
    """Client that writes to an InPort in another process (OpenRTM-aist, InPortCorbaCdrConsumer).

    Args:
        reference: CORBA reference of the port's object InPortCdr.
        peer: name of that port, for display.
    """

    def __init__(self, reference: Reference, peer: str) -> None:
        self._put: Callable[[bytes], Any] = reference.put
        self._complaints = _Complaints(peer)

    def put(self, payload: bytes) -> PortStatus:
        """Put a value. Raise NoAnswerError if the peer does not answer."""
        try:
            status = self._put(payload)
        except CORBA.SystemException as error:
            self._complaints.raised(error)
            return PortStatus.PORT_ERROR
        self._complaints.right()
        return _ours(status)


class _OutPortClient:
    """A client that gets values from the OutPort of a peer (OpenRTM-aist, OutPortCorbaCdrConsumer).

    Args:
        reference: reference of an OutPortCdr.
        peer: name of the peer's port, for display.
    """

    def __init__(self, reference: Reference, peer: str) -> None:
        self._get: Callable[[], tuple[Any, bytes]] = reference.get
        self._complaints = _Complaints(peer)

    def get(self) -> bytes | None:
        """Return the next value of the port in the other process, or None if there is no value.

        Raise NoAnswerError if the other process does not answer.
        """
        try:
            status, payload = self._get()
        except CORBA.BAD_PARAM:  # OpenRTM-aist-Python 2.1.0 returns "" for an empty buffer
            return None
        except CORBA.SystemException as error:
            self._complaints.raised(error)
            return None
        if _ours(status) is PortStatus.PORT_OK:
            self._complaints.right()
            return payload
        if _ours(status) not in _EMPTY:
            self._complaints.wrong(f"the peer answers with {status}")
        return None


class InPortAnswers:
    """CORBA operations of InPortCdr, by which another process writes values to a local InPort."""

    def __init__(self, connector: peer_ports.InPortPushConnector[Any, bytes]) -> None:
        self._put, self._theirs = connector.put, _theirs()

    def put(self, data: bytes) -> Any:
        """Take a value from a peer."""
        return self._theirs[self._put(data)]


class _OutPortAnswers:
    """The operations of OutPortCdr, executed by a connector."""

    def __init__(self, connector: peer_ports.OutPortPullConnector[Any, bytes]) -> None:
        self._get, self._theirs = connector.get, _theirs()

    def get(self) -> tuple[Any, bytes]:
        """Give a value to a peer."""
        status, payload = self._get()
        return self._theirs[status], payload or b""


def _theirs() -> dict[PortStatus, Any]:
    """Return the OpenRTM status for each local status. OpenRTM lacks some of them."""
    openrtm = stubs().openrtm
    return {one: getattr(openrtm, one.name, openrtm.UNKNOWN_ERROR) for one in PortStatus}


def _ours(status: Any) -> PortStatus:
    """Return the local status for an OpenRTM status. `UNKNOWN_ERROR` is an error."""
    return PortStatus.__members__.get(str(status), PortStatus.PORT_ERROR)


# Our end of a connector of data ports, by corba_cdr (OpenRTM-aist 1.x).

INPORT_IOR: Final = "dataport.corba_cdr.inport_ior"
_OUTPORT_IOR: Final = "dataport.corba_cdr.outport_ior"


class DataEnd(ConnectorEnd):
    """The local half of a connector between a local data port and a data port in another process.

    One side of a connector offers a CORBA object, and the other side calls this object to push or
    pull values. This class does the part of the local side: it offers the object, or it calls the
    object of the other process.

    Args:
        place: ORB, threads, queues and names that the connector needs.
        port: local port of the connector.
    """

    def __init__(self, place: ConnectorPlace, port: InPort[Any] | OutPort[Any]) -> None:
        super().__init__(place)
        self._port = port
        self._connector: ConnectorBase | None = None

    def publish(self, values: dict[str, str]) -> dict[str, str]:
        """Serve InPortCdr or OutPortCdr, if the peer makes the calls."""
        end, codec = self._agree(values)
        port, pulls = self._port, end.options.dataflow is DataflowType.PULL
        if isinstance(port, InPort) and not pulls:
            self._connector = put_into = peer_ports.InPortPushConnector(
                port, end, codec, self._place.calls, self._place.post
            )
            put_into.begin()  # the peer may push before its answer is here
            return {INPORT_IOR: self.serve("OpenRTM.InPortCdr", InPortAnswers(put_into))}
        if isinstance(port, OutPort) and pulls:
            self._connector = held = peer_ports.OutPortPullConnector(port, end, codec)
            held.begin()
            return {_OUTPORT_IOR: self.serve("OpenRTM.OutPortCdr", _OutPortAnswers(held))}
        return {}

    def join(self, values: dict[str, str]) -> ConnectorBase:
        """Connect to the peer's InPortCdr or OutPortCdr, if this end makes the calls."""
        if self._connector is None:
            self._connector = self._calling(values)
            self._connector.begin()
        return self._connector

    def _calling(self, values: dict[str, str]) -> ConnectorBase:
        end, codec = self._agree(values)
        place, port, openrtm = self._place, self._port, stubs().openrtm
        key = INPORT_IOR if isinstance(port, OutPort) else _OUTPORT_IOR
        if (ior := values.get(key)) is None:
            raise RtcRefused(f"{place.peer} says no {key}")
        if isinstance(port, OutPort):
            put = InPortClient(self.reference(ior, openrtm.InPortCdr), place.peer)
            return peer_ports.OutPortPushConnector(port, end, codec, put, place.threads)
        get = _OutPortClient(self.reference(ior, openrtm.OutPortCdr), place.peer)
        return peer_ports.InPortPullConnector(port, end, codec, get, place.threads, place.calls)

    def _agree(
        self, values: dict[str, str]
    ) -> tuple[peer_ports.PeerEnd, peer_ports.Codec[Any, bytes]]:
        values = _agreed(self._port, values)
        return self._place.end(values), peer_ports.cdr(self._port.data_type, Endian(values[ENDIAN]))


_OPERATIONS: Final[Mapping[str, tuple[str, ...]]] = {"RefHard": ("Go", "Stop")}
"""Interface types in Tickrig's IDL, with their operations that have no arguments and no result."""


class ServiceEnd(ConnectorEnd):
    """The local half of a connector between a local service port and one in another process.

    A call from the other process is executed in the manager's thread. A call to the other process
    returns at once, because another thread makes it. A call without an answer is logged and not
    repeated.

    Not emulated: interfaces whose operations have arguments or results.

    Args:
        place: ORB, threads, queues and names that the connector needs.
        port: local port of the connector.
    """

    def __init__(self, place: ConnectorPlace, port: ServicePort) -> None:
        super().__init__(place)
        self._port = port

    def publish(self, values: dict[str, str]) -> dict[str, str]:
        """Serve the interfaces of the local port, and return the properties that refer to them.

        Two properties refer to each interface. One has the name that OpenRTM 1.0 uses. The other
        one has the name that later versions of OpenRTM use.
        """
        found: dict[str, str] = {}
        for provider in self._port.providers:
            if (operations := _OPERATIONS.get(provider.profile.type_name)) is not None:
                servant, call = provider.servant, self._place.calls.call
                answers = {name: partial(call, getattr(servant, name)) for name in operations}
                ior = self.serve(provider.profile.type_name, SimpleNamespace(**answers))
                found[self._name("provided", provider.profile)] = ior
                found[_old_name(provider.profile)] = ior
        return found

    def join(self, values: dict[str, str]) -> ConnectorBase:
        """Connect the local port with a new port, which represents the other process.

        The new port provides the services of the other process, and passes each call on to that
        process.
        """
        peer = ServicePort(self._place.peer)
        for provider in self._port.providers:
            wanted = provider.profile
            peer.require(Consumer[Any](wanted.instance_name, wanted.type_name))
        for consumer in self._port.consumers:
            wanted = consumer.profile
            if wanted.type_name in _OPERATIONS and (ior := self._ior(wanted, values)):
                kind = getattr(stubs().services, wanted.type_name)
                calls = self._calls(self.reference(ior, kind), wanted)
                peer.provide(Provider[Any](wanted.instance_name, wanted.type_name, calls))
        names = {"name": self._place.name, "connector_id": self._place.connector_id}
        return connect(self._port, peer, values, **names)

    def _calls(self, reference: Reference, wanted: InterfaceProfile) -> object:
        """Return an object whose operations call the peer in its thread."""
        watch = peer_ports.PeerWatch(f"{self._port.full_name} to {self._place.peer}")
        submit, calls = self.calling_thread().submit, SimpleNamespace()
        for name in _OPERATIONS[wanted.type_name]:
            setattr(calls, name, partial(submit, partial(_call, getattr(reference, name), watch)))
        return calls

    def _ior(self, wanted: InterfaceProfile, values: dict[str, str]) -> str:
        """Return the reference for an interface that the local port requires, empty without one."""
        for text in self._candidates(wanted, values):
            if text and text not in {"null", "nil"}:
                return text
        return ""

    def _candidates(self, wanted: InterfaceProfile, values: dict[str, str]) -> Iterator[str]:
        mapped = values.get(self._name("required", wanted), "")  # what a tool mapped it to
        yield values.get(mapped, "")
        yield values.get(_old_name(wanted), "")
        kind = f".provided.{wanted.type_name}."
        yield from (text for name, text in values.items() if kind in name)

    def _name(self, polarity: str, interface: InterfaceProfile) -> str:
        port, kind = self._port, f"{interface.type_name}.{interface.instance_name}"
        return f"{port.owner}.port.{port.name}.{polarity}.{kind}"


def _call(operation: Callable[[], None], watch: peer_ports.PeerWatch) -> None:
    """Call a peer in its thread."""
    try:
        operation()
    except CORBA.SystemException as error:
        watch.unanswered(NoAnswerError(explain(error)))
    else:
        watch.answered(PortStatus.PORT_OK)


def _old_name(interface: InterfaceProfile) -> str:
    return f"port.{interface.type_name}.{interface.instance_name}"
