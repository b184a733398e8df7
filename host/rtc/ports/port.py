"""What data ports and service ports have in common."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, Protocol, TypeVar

from tickrig.host.rtc.listeners import call_listeners


@dataclass(frozen=True, slots=True)
class ConnectorProfile:
    """A connector as OpenRTM describes it.

    Attributes:
        name: for people.
        connector_id: unique in a system.
        ports: full names of both ports, the providing port first; a port of a peer has the name
            that its engine uses.
        properties: its properties, `dataport.*` for data ports.
    """

    name: str
    connector_id: str
    ports: tuple[str, str]
    properties: Mapping[str, str]


def automatic_id(ports: tuple[str, str]) -> str:
    """Return the ID of a connector for which its caller gave none: runs are the same."""
    return "_".join(ports)


@dataclass(frozen=True, slots=True)
class InterfaceProfile:
    """An interface of a service port.

    Attributes:
        instance_name: its name on the port.
        type_name: name of the interface type; a consumer accepts only providers of its type.
        polarity: `PROVIDED` or `REQUIRED`.
    """

    instance_name: str
    type_name: str
    polarity: str


@dataclass(frozen=True, slots=True)
class PortProfile:
    """A port as OpenRTM describes it.

    Attributes:
        name: full name, such as `ConsoleIn0.out`.
        interfaces: the interfaces of a service port.
        connector_profiles: its connectors.
        properties: `port.port_type`, `dataport.data_type`, ...
    """

    name: str
    interfaces: tuple[InterfaceProfile, ...]
    connector_profiles: tuple[ConnectorProfile, ...]
    properties: Mapping[str, str]


Listener = Callable[[ConnectorProfile], None]


class ConnectorBase:
    """A connector between two ports, which have it until it is ended.

    Attributes:
        profile: its profile.
        ports: the local ports of `profile.ports`: both, or the one that is joined with a peer's.
        joined: True between begin and end.
    """

    def __init__(self, profile: ConnectorProfile, ports: tuple[AnyPort, ...]) -> None:
        self.profile, self.ports, self.joined = profile, ports, False

    @property
    def state(self) -> str:
        """Whether its peer answers, `connected` or `lost`; empty if both ports are here."""
        return ""

    @property
    def joins_components(self) -> bool:
        """Whether both its ports are here, each of a component; those of probes are of none."""
        return len(self.ports) == 2 and all(port.owner for port in self.ports)

    def begin(self) -> None:
        """Add the connector to both ports, then notify their listeners.

        Raises:
            RtcRefused: the guard of a port does not admit the connector.
        """
        for port in self.ports:
            if port.guard is not None:
                port.guard.admit(self)
        self.joined = True
        for port in self.ports:
            port.attach(self)
        for port in self.ports:
            port.notify(port.on_connect, self.profile)

    def end(self) -> None:
        """Take it from both ports, then notify their listeners; ending it twice is no error."""
        joined, self.joined = self.joined, False
        for port in self.ports if joined else ():
            port.detach(self)
        for port in self.ports if joined else ():
            port.notify(port.on_disconnect, self.profile)


C = TypeVar("C", bound=ConnectorBase)


class PortGuard(Protocol):
    """Sees to it that a port stays within the limits of the node that it is on."""

    def admit(self, connector: ConnectorBase, /) -> None:
        """Raise RtcRefused unless a port may have one more connector, this one."""

    def passes(self, port: AnyPort, value: Any, /) -> bool:
        """Return whether a value may leave by a port, or come in by one from a peer."""
        ...


class Port(Generic[C]):
    """A named end of connectors.

    Args:
        name: without that of its component.

    Attributes:
        name: without that of its component.
        port_type: the name of its class in OpenRTM, such as `DataInPort`.
        owner: instance name of its component; empty without a component.
        guard: keeps the port within the limits of its node, if the node has limits.
        connectors: its connectors in the order in which they were made.
        on_connect: called with its profile after a connector was made.
        on_disconnect: called with its profile after a connector ended.
    """

    port_type: ClassVar[str]

    def __init__(self, name: str) -> None:
        self.name, self.owner = name, ""
        self.guard: PortGuard | None = None
        self.connectors: tuple[C, ...] = ()
        self.on_connect: list[Listener] = []
        self.on_disconnect: list[Listener] = []

    @property
    def full_name(self) -> str:
        """Its name in profiles, such as `ConsoleIn0.out`."""
        return f"{self.owner}.{self.name}" if self.owner else self.name

    @property
    def profile(self) -> PortProfile:
        """The port as it is."""
        connectors = tuple(connector.profile for connector in self.connectors)
        properties = {"port.port_type": self.port_type, **self._properties()}
        return PortProfile(self.full_name, self._interfaces(), connectors, properties)

    def find_connector(self, connector_id: str) -> C | None:
        """Look for a connector by its ID.

        Args:
            connector_id: the ID in its profile.

        Returns:
            The connector; None if the port has no connector with this ID.
        """
        found = (own for own in self.connectors if own.profile.connector_id == connector_id)
        return next(found, None)

    def connector_to(self, other: AnyPort) -> C | None:
        """Look for the connector that joins this port with another one.

        Args:
            other: the other port.

        Returns:
            The connector, None if there is none.
        """
        shared = (own for own in self.connectors if own in other.connectors)
        return next(shared, None) if other is not self else None

    def disconnect_all(self) -> None:
        """End all its connectors."""
        for connector in self.connectors:
            connector.end()

    def attach(self, connector: C) -> None:
        """Have a connector."""
        self.connectors += (connector,)

    def detach(self, connector: C) -> None:
        """Have a connector no more."""
        self.connectors = tuple(c for c in self.connectors if c is not connector)

    def notify(self, listeners: list[Listener], profile: ConnectorProfile) -> None:
        """Call listeners with the profile of a connector; what one raises is logged."""
        call_listeners(self.full_name, listeners, profile)

    def _properties(self) -> Mapping[str, str]:
        return {}

    def _interfaces(self) -> tuple[InterfaceProfile, ...]:
        return ()


AnyPort = Port[Any]
"""A port of whatever kind."""
