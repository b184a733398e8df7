"""The ports of components as peers see them. Each port has a PortService."""

from __future__ import annotations

import time
import uuid
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any, Final

from omniORB import CORBA

from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.engines.openrtm import connector_ends
from tickrig.host.rtc.engines.openrtm.orb import Orb, Reference, carried, explain, nvlist
from tickrig.host.rtc.engines.openrtm.stubs import stubs
from tickrig.host.rtc.ports.connector import Connector
from tickrig.host.rtc.ports.data_port import DataPort, InPort, OutPort
from tickrig.host.rtc.ports.port import AnyPort, ConnectorBase, ConnectorProfile
from tickrig.host.rtc.ports.service_port import ServicePort
from tickrig.host.rtc.states import ReturnCode, RtcRefused
from tickrig.host.rtc.system.call_queue import Arrivals, CallQueue
from tickrig.host.rtc.system.manager import Manager
from tickrig.host.rtc.system.peer_thread import PeerThreads
from tickrig.host.text.log import log_of

# The connectors of a port of ours with ports of peers; all this is in the manager's thread.

_Profile = Any
"""A ConnectorProfile of CORBA."""

_LOG: Final = log_of(__name__)


class _PeerConnection:
    """A connector of a local port with a port of a peer.

    Attributes:
        connector_id: ID of the connector.
        place: position of the local port in the list of ports.
        peer: port of the peer.
        peer_name: name of the peer's port, for messages.
        end: local end of the connector.
        additions: properties that are added for the peer.
        profile: profile as peers and tools see it, or None until the connector is joined.
        peer_knows: whether the peer knows that the connector ends, or need not know it.
    """

    def __init__(
        self,
        place: int,
        peer: Reference,
        where: connector_ends.ConnectorPlace,
        end: connector_ends.ConnectorEnd,
    ) -> None:
        self.connector_id, self.peer_name = where.connector_id, where.peer
        self.place, self.peer, self.end = place, peer, end
        self.additions: dict[str, str] = {}
        self.profile: _Profile | None = None
        self.peer_knows = False

    def notify_peer(self) -> None:
        """Notify the peer that the connector has ended."""
        try:
            self.peer.notify_disconnect(self.connector_id)
        except CORBA.Exception as error:
            _LOG.info("%s could not be notified of the end: %s", self.peer_name, explain(error))


class _PeerConnections:
    """The connectors of a local port with peers.

    Args:
        port: the local port.
        system: all ports of its system.
    """

    def __init__(self, port: AnyPort, system: SystemPorts) -> None:
        self._port, self._system = port, system
        self._by_id: dict[str, _PeerConnection] = {}
        self._closed = False
        port.on_disconnect.append(self._ended)

    def reserve(
        self, profile: _Profile, values: dict[str, str], peer_name: str
    ) -> _PeerConnection | None:
        """Begin a new connector: check it, and serve the object that the other process will call.

        Later, call `keep` to complete the connector, or `drop` to remove it.

        Args:
            profile: profile of the connector.
            values: properties of the connector.
            peer_name: name of the other port, for display.

        Returns:
            The new connection, which is the argument of `keep` or `drop`. If both ports are local,
            the connector is complete at once, and the result is None.

        Raises:
            RtcRefused: the connector cannot be made.
        """
        place, other = self._place(profile)
        peer = profile.ports[1 - place]
        self._refuse_known(profile.connector_id, peer)
        if other is not None:
            ports = (self._port, other) if place == 0 else (other, self._port)
            self._system.connect(ports, profile, values)
            return None
        system = self._system
        where = connector_ends.ConnectorPlace(
            system.orb,
            system.calls,
            system.threads,
            system.arrivals.post,
            profile.connector_id,
            profile.name,
            peer_name,
        )
        connection = _PeerConnection(place, peer, where, _end_at(where, self._port))
        connection.additions = connection.end.publish(values)
        self._by_id[connection.connector_id] = connection
        return connection

    def keep(self, connection: _PeerConnection, profile: _Profile, values: dict[str, str]) -> None:
        """Complete a connector that `reserve` began: connect the local port with the other process.

        Args:
            connection: result of `reserve`.
            profile: profile that the other process returned.
            values: properties of the connector.

        Raises:
            RtcRefused: the connector is not possible, or the local port has ended.
        """
        if self._closed or self._by_id.get(connection.connector_id) is not connection:
            message = f"{self._port.full_name} has ended"
            raise RtcRefused(message, ReturnCode.PRECONDITION_NOT_MET)
        connector = connection.end.join(values)
        connection.profile = profile
        self._system.schedule(connector)

    def drop(self, connection: _PeerConnection) -> None:
        """Undo a reserved connector that cannot be completed."""
        connection.peer_knows = True
        self.end(connection.connector_id)

    def end(self, connector_id: str) -> None:
        """End a connector to a peer or to a local port."""
        if (connector := self._port.find_connector(connector_id)) is not None:
            connector.end()
        elif (connection := self._by_id.get(connector_id)) is not None:
            self._end(connection)

    def look(self, connector_id: str) -> tuple[_PeerConnection | None, bool]:
        """Find a connector that the other process or a tool wants to end.

        After this call, `end` does not notify the other process.

        Returns:
            Two values. The first value is the object for a connector to another process, or None if
            no such connector has this ID. The second value is False if the ID is unknown. An ID is
            known if a connector of the port has it, or if a connector with this ID has just ended.
        """
        if (connection := self._by_id.get(connector_id)) is not None:
            connection.peer_knows = True
        known = connection is not None or connector_id in self._system.ending
        return connection, known or self._port.find_connector(connector_id) is not None

    def profiles(self) -> list[_Profile]:
        """Return the profiles of the port's connectors, without those of probes."""
        found = (self._describe(connector) for connector in self._port.connectors)
        return [profile for profile in found if profile is not None]

    def close(self) -> None:
        """End all connectors to peers, and notify the peers, because the port is gone."""
        self._closed = True
        for connection in tuple(self._by_id.values()):
            self.end(connection.connector_id)

    def _place(self, profile: _Profile) -> tuple[int, AnyPort | None]:
        """Return the position of the local port in a connector, and the other port if local."""
        if len(profile.ports) != 2 or None in profile.ports:
            raise RtcRefused(f"a connector joins two ports, not {len(profile.ports)}")
        found = [self._system.find(reference) for reference in profile.ports]
        if self._port not in found:
            raise RtcRefused(f"{self._port.full_name} is not a port of the connector")
        place = found.index(self._port)
        return place, found[1 - place]

    def _refuse_known(self, connector_id: str, peer: Reference) -> None:
        if not connector_id:
            raise RtcRefused("a connector has an ID")
        not_met = ReturnCode.PRECONDITION_NOT_MET
        if connector_id in self._by_id or self._port.find_connector(connector_id) is not None:
            raise RtcRefused(f"there is a connector {connector_id!r} already", not_met)
        if any(connection.peer._is_equivalent(peer) for connection in self._by_id.values()):
            raise RtcRefused("these ports are connected already", not_met)

    def _describe(self, connector: ConnectorBase) -> _Profile | None:
        connection = self._by_id.get(connector.profile.connector_id)
        return self._system.describe(connector) if connection is None else connection.profile

    def _ended(self, profile: ConnectorProfile) -> None:
        """Process the end of a connector that either side requested."""
        if (connection := self._by_id.get(profile.connector_id)) is not None:
            self._end(connection)

    def _end(self, connection: _PeerConnection) -> None:
        """Stop serving the peer, and notify it unless it knows the end."""
        self._by_id.pop(connection.connector_id, None)
        connection.end.close()
        if not connection.peer_knows:
            self._system.ending[connection.connector_id] = connection
            connection.end.calling_thread().submit(partial(self._notify, connection))
        if connection.end.thread is not None:
            connection.end.thread.close()

    def _notify(self, connection: _PeerConnection) -> None:
        """Notify a peer in its thread."""
        connection.notify_peer()
        self._system.ending.pop(connection.connector_id, None)


def _end_at(place: connector_ends.ConnectorPlace, port: AnyPort) -> connector_ends.ConnectorEnd:
    match port:
        case InPort() | OutPort():
            return connector_ends.DataEnd(place, port)
        case ServicePort():
            return connector_ends.ServiceEnd(place, port)
    raise RtcRefused(f"{port.full_name} cannot be joined with a peer")


# PortService: how tools and peers join a port of ours (OMG RTC 1.0; OpenRTM-aist, PortBase).


_OK: Final = ReturnCode.RTC_OK
_NAME_LENGTH: Final = 100


class _PortAnswers:
    """The operations of PortService, executed in threads of the ORB.

    The manager's thread does everything that concerns the port. Peers are called here without a
    lock, because the call may come back.

    Args:
        port: local port of the service.
        connections: connectors of the port to peers.
        calls: queue that runs calls in the manager's thread.
        describe: function that returns the PortProfile, in the manager's thread.
    """

    def __init__(
        self,
        port: AnyPort,
        connections: _PeerConnections,
        calls: CallQueue,
        describe: Callable[[], Any],
    ) -> None:
        self._last_line = ""
        self._port, self._connections = port, connections
        self._calls, self._describe = calls, describe

    def get_port_profile(self) -> Any:
        """Return the profile of the port."""
        return self._calls.call(self._describe)

    def get_connector_profiles(self) -> list[_Profile]:
        """Return the connectors of the port."""
        return self._calls.call(self._connections.profiles)

    def get_connector_profile(self, connector_id: str) -> _Profile:
        """Return the connector with an ID, or an empty one if there is none."""
        for profile in self.get_connector_profiles():
            if profile.connector_id == connector_id:
                return profile
        return stubs().rtc.ConnectorProfile("", "", [], [])

    def connect(self, profile: _Profile) -> tuple[Any, _Profile]:
        """Connect the ports in a connector profile. Return the result and the completed profile.

        A missing ID and missing byte orders are added to the profile. Then the first port of the
        profile is asked to connect itself with the next port.
        """
        profile.connector_id = profile.connector_id or str(uuid.uuid4())
        profile.properties = connector_ends.completed(profile.properties)
        if not profile.ports or profile.ports[0] is None:
            return _code(ReturnCode.BAD_PARAMETER), profile
        try:
            answer: tuple[Any, _Profile] = profile.ports[0].notify_connect(profile)
        except CORBA.SystemException as error:
            self._log("its first port: %s", explain(error))
            self.notify_disconnect(profile.connector_id)
            return _code(ReturnCode.RTC_ERROR), profile
        return answer

    def notify_connect(self, profile: _Profile) -> tuple[Any, _Profile]:
        """Connect the local port as a profile describes, and make the next port do the same."""
        code, values = _OK, connector_ends.texts(profile.properties)
        try:
            name = _peer_name(profile, self._port.full_name)
            connection = self._calls.call(partial(self._connections.reserve, profile, values, name))
            if connection is not None:
                profile = self._join(connection, profile)
            self._last_line = ""
        except RtcRefused as error:
            self._log("%s", error)
            code = error.code
        except TimeoutError:
            self._log("%s", "the system is busy")
            code = ReturnCode.RTC_ERROR
        except CORBA.SystemException as error:
            self._log("the peer: %s", explain(error))
            code = ReturnCode.RTC_ERROR
        return _code(code), profile

    def disconnect(self, connector_id: str) -> Any:
        """End a connector. The first port that answers notifies the ports after it."""
        profile = self.get_connector_profile(connector_id)
        for port in profile.ports:
            with suppress(CORBA.SystemException):
                return port.notify_disconnect(connector_id)
        return _code(ReturnCode.RTC_ERROR if profile.ports else ReturnCode.BAD_PARAMETER)

    def disconnect_all(self) -> Any:
        """End all connectors."""
        codes = [self.disconnect(one.connector_id) for one in self.get_connector_profiles()]
        return next((code for code in codes if code != _code(_OK)), _code(_OK))

    def notify_disconnect(self, connector_id: str) -> Any:
        """End a connector of the local port.

        If the local port is the first port of the connector, it also notifies the second port.
        """
        connection, known = self._calls.call(partial(self._connections.look, connector_id))
        if not known:
            return _code(ReturnCode.BAD_PARAMETER)
        if connection is not None and connection.place == 0 and connection.profile is not None:
            connection.notify_peer()
        self._calls.call(partial(self._connections.end, connector_id))
        return _code(_OK)

    def _join(self, connection: _PeerConnection, profile: _Profile) -> _Profile:
        """Make the peer join, then join the local end. If that fails, undo both."""
        asked = False
        try:
            profile.properties = connector_ends.changed(profile.properties, connection.additions)
            if connection.place == 0:
                asked, ports = True, profile.ports
                code, profile = connection.peer.notify_connect(profile)
                _refuse(connection.peer_name, code)
                profile.connector_id, profile.ports = connection.connector_id, ports
            values = connector_ends.texts(profile.properties)
            self._calls.call(partial(self._connections.keep, connection, profile, values))
        except Exception:
            if asked:
                connection.notify_peer()
            with suppress(RtcRefused):  # the system has ended
                self._calls.post(partial(self._connections.drop, connection))
            raise
        return profile

    def _log(self, text: str, reason: object) -> None:
        """Log why the port is not connected, unless the last reason was the same."""
        line = f"{self._port.full_name} is not connected: {text % reason}"
        if line != self._last_line:
            _LOG.warning("%s", line)
        self._last_line = line


def _refuse(peer: str, code: Any) -> None:
    """Raise RtcRefused with the return code of a peer, unless it is RTC_OK."""
    if (ours := ReturnCode.__members__.get(str(code), ReturnCode.RTC_ERROR)) is not _OK:
        raise RtcRefused(f"{peer} answers {ours.name}", ours)


def _code(code: ReturnCode) -> Any:
    """Return the ReturnCode_t of CORBA."""
    return getattr(stubs().rtc, code.name)


def _peer_name(profile: _Profile, our_name: str) -> str:
    """Return the name of the peer's port.

    Tools name a connector after both ports, such as `A0.out_B0.in`. If the connector has no such
    name, this function requests it from the peer, unless the peer is the present caller.
    """
    if rest := _line(profile.name.removeprefix(our_name).removesuffix(our_name).strip("_")):
        return rest
    with suppress(CORBA.SystemException):
        if len(profile.ports) == 2 and profile.ports[1] is not None:
            name = _line(profile.ports[1].get_port_profile().name)
            if name not in {"", our_name}:
                return name
    return _line(profile.connector_id)


def _line(text: str) -> str:
    """Return a text of a peer in a form that a log line can contain."""
    return " ".join(text.split())[:_NAME_LENGTH]


_CLOSE_S: Final = 1.5
"""Time limit to notify peers at the end, which is a call and its time-out."""

_POLL_US: Final = 10_000


class SystemPorts:
    """All ports of a system that other processes can connect by OpenRTM.

    Args:
        orb: ORB of this process.
        calls: queue that runs calls in the manager's thread.
        manager: manager of the system.

    Attributes:
        orb: ORB of this process.
        calls: queue that runs calls in the manager's thread.
        references: CORBA references of the ports.
        ending: connectors that have ended, by ID, until the other process is notified.
        components: components that are served.
        arrivals: values from other processes that wait for the next tick.
        threads: threads that call other processes, for all data ports.
    """

    def __init__(self, orb: Orb, calls: CallQueue, manager: Manager) -> None:
        self.orb, self.calls, self._manager = orb, calls, manager
        self.references: dict[AnyPort, Reference] = {}
        self.ending: dict[str, _PeerConnection] = {}
        self.components: list[ComponentPorts] = []
        self.arrivals, self.threads = Arrivals(), PeerThreads("peers of OpenRTM")
        manager.add_item(self.arrivals)
        self._by_key: dict[bytes, AnyPort] = {}

    def find(self, reference: Reference) -> AnyPort | None:
        """Return the local port of a CORBA reference, or None for a port in another process."""
        return self._by_key.get(self.orb.key(reference))

    def enter(self, port: AnyPort, reference: Reference) -> None:
        """Let peers call a port."""
        self.references[port] = reference
        self._by_key[self.orb.key(reference)] = port

    def remove(self, port: AnyPort) -> None:
        """Stop accepting calls for a port."""
        reference = self.references.pop(port)
        del self._by_key[self.orb.key(reference)]
        self.orb.withdraw(reference)

    def connect(
        self, ports: tuple[AnyPort, AnyPort], profile: _Profile, values: dict[str, str]
    ) -> None:
        """Connect two local ports."""
        if isinstance(ports[0], DataPort):
            endian = connector_ends.agreed_endian(values.get(connector_ends.ENDIAN, ""))
            values = {**values, connector_ends.ENDIAN: endian}
        names = {"name": profile.name, "connector_id": profile.connector_id}
        self._manager.connect(ports[0].full_name, ports[1].full_name, values, **names)

    def describe(self, connector: ConnectorBase) -> _Profile | None:
        """Return the CORBA profile of a connector between two local ports.

        The result is None if other processes cannot call one of the ports.
        """
        references = [self.references.get(port) for port in connector.ports]
        if len(references) != 2 or None in references:
            return None
        profile = connector.profile
        properties = nvlist(profile.properties)
        return stubs().rtc.ConnectorProfile(
            carried("name", profile.name), profile.connector_id, references, properties
        )

    def close(self) -> None:
        """End all connectors to peers. Peers that do not answer are not notified."""
        for component in tuple(self.components):
            component.close()
        self._manager.remove_item(self.arrivals)
        end_s = time.monotonic() + _CLOSE_S
        while self.ending and time.monotonic() < end_s:
            self.calls.serve(_POLL_US)  # a notified peer may call back
        self.threads.close()

    def schedule(self, connector: ConnectorBase) -> None:
        """Make a connector push from now on."""
        if isinstance(connector, Connector):
            self._manager.add_connector(connector)


class ComponentPorts:
    """The ports of one component, which other processes can connect until the component ends.

    Args:
        system: all ports of the system.
        component: local component.
        owner: CORBA reference of the component.
    """

    def __init__(self, system: SystemPorts, component: RtComponent, owner: Reference) -> None:
        self._system, self._component, self._owner = system, component, owner
        self._connections: dict[AnyPort, _PeerConnections] = {}
        system.calls.call(self._begin)

    def services(self) -> list[Reference]:
        """Return the PortService of each port, in any thread."""
        return self._system.calls.call(self._services)

    def close(self) -> None:
        """End all connectors to peers, notify the peers, and stop serving."""
        self._system.calls.call(self._end)

    def _begin(self) -> None:
        self._system.components.append(self)
        self._update()

    def _end(self) -> None:
        self._withdraw(tuple(self._connections))
        if self in self._system.components:
            self._system.components.remove(self)

    def _services(self) -> list[Reference]:
        self._update()
        return [self._system.references[port] for port in self._component.ports.values()]

    def _update(self) -> None:
        """Serve all ports that exist now, and no others."""
        ports = tuple(self._component.ports.values())
        self._withdraw(tuple(port for port in self._connections if port not in ports))
        for port in ports:
            if port not in self._connections:
                self._serve(port)

    def _serve(self, port: AnyPort) -> None:
        system = self._system
        self._connections[port] = connections = _PeerConnections(port, system)
        answers = _PortAnswers(port, connections, system.calls, partial(self._profile, port))
        system.enter(port, system.orb.serve(stubs().skeleton("RTC.PortService"), answers))

    def _withdraw(self, ports: tuple[AnyPort, ...]) -> None:
        for port in ports:
            self._connections.pop(port).close()
            self._system.remove(port)

    def _profile(self, port: AnyPort) -> Any:
        """Return a PortProfile, in the manager's thread."""
        rtc = stubs().rtc
        interfaces = [
            rtc.PortInterfaceProfile(one.instance_name, one.type_name, getattr(rtc, one.polarity))
            for one in port.profile.interfaces
        ]
        about = {"port.port_type": port.port_type}
        properties = connector_ends.offered(port) if isinstance(port, DataPort) else about
        return rtc.PortProfile(
            port.full_name,
            interfaces,
            self._system.references[port],
            self._connections[port].profiles(),
            self._owner,
            nvlist(properties),
        )
