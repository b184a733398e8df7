"""The ports of components as peers see them: each has a PortService."""

from __future__ import annotations

import time
from functools import partial
from typing import Any, Final

from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.engines.openrtm.orb import Orb, Reference
from tickrig.host.rtc.engines.openrtm.ports.peer_connections import (
    PeerConnection,
    PeerConnections,
    Profile,
)
from tickrig.host.rtc.engines.openrtm.ports.port_service import PortAnswers
from tickrig.host.rtc.engines.openrtm.ports.properties import ENDIAN, agreed_endian, nvlist, offered
from tickrig.host.rtc.engines.openrtm.stubs import stubs
from tickrig.host.rtc.ports.connector import Connector
from tickrig.host.rtc.ports.data_port import DataPort
from tickrig.host.rtc.ports.port import AnyPort, ConnectorBase
from tickrig.host.rtc.remote.arrivals import Arrivals
from tickrig.host.rtc.remote.call_queue import CallQueue
from tickrig.host.rtc.remote.peer_threads import PeerThreads
from tickrig.host.rtc.system.manager import Manager

_CLOSE_S: Final = 1.5
"""So long peers are told at the end: a call, and its time-out."""

_POLL_US: Final = 10_000


class SystemPorts:
    """All ports of a system that peers see.

    Args:
        orb: of this process.
        calls: those of the manager's thread.
        manager: of the system.

    Attributes:
        orb: as given.
        calls: as given.
        references: the PortService of each port.
        ending: connectors that have ended, by ID, as long as their peers are being told.
        components: those that are served.
        arrivals: what peers brought, until the next tick.
        threads: call peers, for all data ports.
    """

    def __init__(self, orb: Orb, calls: CallQueue, manager: Manager) -> None:
        self.orb, self.calls, self._manager = orb, calls, manager
        self.references: dict[AnyPort, Reference] = {}
        self.ending: dict[str, PeerConnection] = {}
        self.components: list[ComponentPorts] = []
        self.arrivals, self.threads = Arrivals(), PeerThreads("peers of OpenRTM")
        manager.add_item(self.arrivals)
        self._by_key: dict[bytes, AnyPort] = {}

    def find(self, reference: Reference) -> AnyPort | None:
        """Return the port of ours that a reference is of; None if it is a peer's."""
        return self._by_key.get(self.orb.key(reference))

    def enter(self, port: AnyPort, reference: Reference) -> None:
        """Let peers call a port."""
        self.references[port] = reference
        self._by_key[self.orb.key(reference)] = port

    def remove(self, port: AnyPort) -> None:
        """Let nobody call a port any more."""
        reference = self.references.pop(port)
        del self._by_key[self.orb.key(reference)]
        self.orb.withdraw(reference)

    def connect(
        self, ports: tuple[AnyPort, AnyPort], profile: Profile, values: dict[str, str]
    ) -> None:
        """Join two ports of ours."""
        if isinstance(ports[0], DataPort):
            values = {**values, ENDIAN: agreed_endian(values.get(ENDIAN, ""))}
        names = {"name": profile.name, "connector_id": profile.connector_id}
        self._manager.connect(ports[0].full_name, ports[1].full_name, values, **names)

    def describe(self, connector: ConnectorBase) -> Profile | None:
        """Return a connector of two ports of ours; None if peers know not both."""
        references = [self.references.get(port) for port in connector.ports]
        if len(references) != 2 or None in references:
            return None
        profile = connector.profile
        properties = nvlist(profile.properties)
        return stubs().rtc.ConnectorProfile(
            profile.name, profile.connector_id, references, properties
        )

    def close(self) -> None:
        """End all connectors with peers; who does not answer is not told."""
        for component in tuple(self.components):
            component.close()
        self._manager.remove_item(self.arrivals)
        end_s = time.monotonic() + _CLOSE_S
        while self.ending and time.monotonic() < end_s:
            self.calls.serve(_POLL_US)  # who is told may call back
        self.threads.close()

    def schedule(self, connector: ConnectorBase) -> None:
        """Let a connector push from now on."""
        if isinstance(connector, Connector):
            self._manager.add_connector(connector)


class ComponentPorts:
    """The ports of a component, served as long as it lives.

    Args:
        system: all ports of the system.
        component: of ours.
        owner: its RTObject.
    """

    def __init__(self, system: SystemPorts, component: RtComponent, owner: Reference) -> None:
        self._system, self._component, self._owner = system, component, owner
        self._connections: dict[AnyPort, PeerConnections] = {}
        system.calls.call(self._begin)

    def services(self) -> list[Reference]:
        """Return the PortService of each port, in any thread."""
        return self._system.calls.call(self._services)

    def close(self) -> None:
        """End all connectors with peers, who are told, and serve nobody any more."""
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
        """Serve the ports that are there by now, and none else."""
        ports = tuple(self._component.ports.values())
        self._withdraw(tuple(port for port in self._connections if port not in ports))
        for port in ports:
            if port not in self._connections:
                self._serve(port)

    def _serve(self, port: AnyPort) -> None:
        system = self._system
        self._connections[port] = connections = PeerConnections(port, system)
        answers = PortAnswers(port, connections, system.calls, partial(self._profile, port))
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
        properties = offered(port) if isinstance(port, DataPort) else about
        return rtc.PortProfile(
            port.full_name,
            interfaces,
            self._system.references[port],
            self._connections[port].profiles(),
            self._owner,
            nvlist(properties),
        )
