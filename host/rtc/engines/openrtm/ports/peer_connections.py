"""The connectors of a port of ours with ports of peers; all this is in the manager's thread."""

from __future__ import annotations

from functools import partial
from typing import Any, Final, Protocol

from omniORB import CORBA

from tickrig.host.rtc.engines.openrtm.orb import Orb, Reference, explain
from tickrig.host.rtc.engines.openrtm.ports.data_end import DataEnd
from tickrig.host.rtc.engines.openrtm.ports.ends import End, Place
from tickrig.host.rtc.engines.openrtm.ports.service_end import ServiceEnd
from tickrig.host.rtc.ports.data_port import InPort, OutPort
from tickrig.host.rtc.ports.port import AnyPort, ConnectorBase, ConnectorProfile
from tickrig.host.rtc.ports.service_port import ServicePort
from tickrig.host.rtc.remote.arrivals import Arrivals
from tickrig.host.rtc.remote.call_queue import CallQueue
from tickrig.host.rtc.remote.peer_threads import PeerThreads
from tickrig.host.rtc.states import ReturnCode, RtcRefused
from tickrig.host.text.log import log_of

Profile = Any
"""A ConnectorProfile of CORBA."""

_LOG: Final = log_of(__name__)


class System(Protocol):
    """The ports of the same system, and its orb.

    Attributes:
        threads: call peers, for all data ports.
        arrivals: what came, until the next tick.
        ending: connectors that have ended, by ID, as long as their peers are being told.
    """

    orb: Orb
    calls: CallQueue
    threads: PeerThreads
    arrivals: Arrivals
    ending: dict[str, PeerConnection]

    def find(self, reference: Reference) -> AnyPort | None:
        """Return the port of ours that a reference is of; None if it is a peer's."""
        ...

    def connect(
        self, ports: tuple[AnyPort, AnyPort], profile: Profile, values: dict[str, str]
    ) -> None:
        """Join two ports of ours."""
        ...

    def describe(self, connector: ConnectorBase) -> Profile | None:
        """Return a connector of two ports of ours; None if peers know not both."""
        ...

    def schedule(self, connector: ConnectorBase) -> None:
        """Let a connector push from now on."""
        ...


class PeerConnection:
    """A connector of a port of ours with a port of a peer.

    Attributes:
        connector_id: of the connector.
        place: of our port in its list of ports.
        peer: the peer's port.
        peer_name: how that is called, for people.
        end: our end.
        additions: properties that the peer is to have.
        profile: as peers and tools see it; None until it is joined.
        peer_knows: whether the peer knows, or need not be told, that it ends.
    """

    def __init__(self, place: int, peer: Reference, where: Place, end: End) -> None:
        self.connector_id, self.peer_name = where.connector_id, where.peer
        self.place, self.peer, self.end = place, peer, end
        self.additions: dict[str, str] = {}
        self.profile: Profile | None = None
        self.peer_knows = False

    def notify_peer(self) -> None:
        """Tell the peer that the connector has ended."""
        try:
            self.peer.notify_disconnect(self.connector_id)
        except CORBA.Exception as error:
            _LOG.info("%s was not told of the end: %s", self.peer_name, explain(error))


class PeerConnections:
    """What joins a port of ours with peers.

    Args:
        port: of ours.
        system: its own.
    """

    def __init__(self, port: AnyPort, system: System) -> None:
        self._port, self._system = port, system
        self._by_id: dict[str, PeerConnection] = {}
        self._closed = False
        port.on_disconnect.append(self._ended)

    def reserve(
        self, profile: Profile, values: dict[str, str], peer_name: str
    ) -> PeerConnection | None:
        """Begin a connector: check it, and serve what the peer is to call.

        Args:
            profile: of the connector.
            values: its properties.
            peer_name: how the other port is called, for people.

        Returns:
            What is still to be joined, or None if both ports are ours: then it is done.

        Raises:
            RtcRefused: it cannot be.
        """
        place, other = self._place(profile)
        peer = profile.ports[1 - place]
        self._refuse_known(profile.connector_id, peer)
        if other is not None:
            ports = (self._port, other) if place == 0 else (other, self._port)
            self._system.connect(ports, profile, values)
            return None
        system = self._system
        where = Place(
            system.orb,
            system.calls,
            system.threads,
            system.arrivals.post,
            profile.connector_id,
            profile.name,
            peer_name,
        )
        connection = PeerConnection(place, peer, where, _end_at(where, self._port))
        connection.additions = connection.end.publish(values)
        self._by_id[connection.connector_id] = connection
        return connection

    def keep(self, connection: PeerConnection, profile: Profile, values: dict[str, str]) -> None:
        """Join what was begun.

        Args:
            connection: what `reserve` returned.
            profile: as it is after the peer was asked.
            values: its properties.

        Raises:
            RtcRefused: it cannot be, or the port is gone.
        """
        if self._closed or self._by_id.get(connection.connector_id) is not connection:
            message = f"{self._port.full_name} has ended"
            raise RtcRefused(message, ReturnCode.PRECONDITION_NOT_MET)
        connector = connection.end.join(values)
        connection.profile = profile
        self._system.schedule(connector)

    def drop(self, connection: PeerConnection) -> None:
        """Leave nothing of what was begun and cannot be joined."""
        connection.peer_knows = True
        self.end(connection.connector_id)

    def end(self, connector_id: str) -> None:
        """End a connector, with a peer or not."""
        if (connector := self._port.find_connector(connector_id)) is not None:
            connector.end()
        elif (connection := self._by_id.get(connector_id)) is not None:
            self._end(connection)

    def look(self, connector_id: str) -> tuple[PeerConnection | None, bool]:
        """Return the connector with a peer of an ID, and whether there is, or was just now, any.

        Its peer need not be told of the end from now on.
        """
        if (connection := self._by_id.get(connector_id)) is not None:
            connection.peer_knows = True
        known = connection is not None or connector_id in self._system.ending
        return connection, known or self._port.find_connector(connector_id) is not None

    def profiles(self) -> list[Profile]:
        """Return its connectors, but not those of probes."""
        found = (self._describe(connector) for connector in self._port.connectors)
        return [profile for profile in found if profile is not None]

    def close(self) -> None:
        """End all connectors with peers, who are told; the port is no more."""
        self._closed = True
        for connection in tuple(self._by_id.values()):
            self.end(connection.connector_id)

    def _place(self, profile: Profile) -> tuple[int, AnyPort | None]:
        """Return the place of our port in a connector, and the other port if it is ours."""
        if len(profile.ports) != 2 or None in profile.ports:
            raise RtcRefused(f"a connector joins two ports, not {len(profile.ports)}")
        found = [self._system.find(reference) for reference in profile.ports]
        if self._port not in found:
            raise RtcRefused(f"{self._port.full_name} is none of the ports of the connector")
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

    def _describe(self, connector: ConnectorBase) -> Profile | None:
        connection = self._by_id.get(connector.profile.connector_id)
        return self._system.describe(connector) if connection is None else connection.profile

    def _ended(self, profile: ConnectorProfile) -> None:
        """Take the end of a connector, whoever ended it."""
        if (connection := self._by_id.get(profile.connector_id)) is not None:
            self._end(connection)

    def _end(self, connection: PeerConnection) -> None:
        """Serve the peer no more, and tell it unless it knows."""
        self._by_id.pop(connection.connector_id, None)
        connection.end.close()
        if not connection.peer_knows:
            self._system.ending[connection.connector_id] = connection
            connection.end.calling_thread().submit(partial(self._notify, connection))
        if connection.end.thread is not None:
            connection.end.thread.close()

    def _notify(self, connection: PeerConnection) -> None:
        """Tell a peer, in its thread."""
        connection.notify_peer()
        self._system.ending.pop(connection.connector_id, None)


def _end_at(place: Place, port: AnyPort) -> End:
    match port:
        case InPort() | OutPort():
            return DataEnd(place, port)
        case ServicePort():
            return ServiceEnd(place, port)
    raise RtcRefused(f"{port.full_name} cannot be joined with a peer")
