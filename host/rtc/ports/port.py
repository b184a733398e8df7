"""The common parts of data ports and service ports."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, Protocol, TypeVar

from tickrig.host.rtc.listeners import call_listeners


@dataclass(frozen=True, slots=True)
class ConnectorProfile:
    """Description of a connector, as in OpenRTM: its name, ID, ports and properties.

    Attributes:
        name: name of the connector, for display.
        connector_id: ID that is unique in a system.
        ports: full names of both ports, such as `ConsoleIn0.out`. The port that provides the values
            is first. A port in another process has the name that it has in its middleware, such as
            OpenRTM.
        properties: properties of the connector. Those of data ports begin with `dataport.`.
    """

    name: str
    connector_id: str
    ports: tuple[str, str]
    properties: Mapping[str, str]


def automatic_id(ports: tuple[str, str]) -> str:
    """Return the default ID of a connector, which is made from the names of its two ports.

    The ID is therefore the same in each run of a system.
    """
    return "_".join(ports)


@dataclass(frozen=True, slots=True)
class InterfaceProfile:
    """Description of an interface that a service port provides or requires.

    Attributes:
        instance_name: name of the interface on the port.
        type_name: name of the interface type. A required interface can use only a provided
            interface of the same type.
        polarity: `PROVIDED` or `REQUIRED`.
    """

    instance_name: str
    type_name: str
    polarity: str


@dataclass(frozen=True, slots=True)
class PortProfile:
    """Description of a port in its present state, as in OpenRTM.

    Attributes:
        name: full name, such as `ConsoleIn0.out`.
        interfaces: interfaces of a service port, empty for a data port.
        connector_profiles: descriptions of the connectors that the port has.
        properties: properties such as `port.port_type` and `dataport.data_type`.
    """

    name: str
    interfaces: tuple[InterfaceProfile, ...]
    connector_profiles: tuple[ConnectorProfile, ...]
    properties: Mapping[str, str]


Listener = Callable[[ConnectorProfile], None]


class ConnectorBase:
    """Base class of connectors, which connect two ports with each other until `end` is called.

    Attributes:
        profile: name, ID, ports and properties of the connector.
        ports: ports of the connector in this process: both ports, or one if the other port is in
            another process.
        joined: whether the ports are connected, which is True between `begin` and `end`.
    """

    def __init__(self, profile: ConnectorProfile, ports: tuple[AnyPort, ...]) -> None:
        self.profile, self.ports, self.joined = profile, ports, False

    @property
    def state(self) -> str:
        """State of the peer, `connected` or `lost`, empty if both ports are local."""
        return ""

    @property
    def joins_components(self) -> bool:
        """Whether both ports belong to local components.

        Ports of probes belong to no component.
        """
        return len(self.ports) == 2 and all(port.owner for port in self.ports)

    def begin(self) -> None:
        """Connect the ports: add the connector to both, then notify their listeners.

        Raises:
            RtcRefused: the guard of a port does not allow a further connector.
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
        """Disconnect the ports: remove the connector from both, then notify their listeners.

        A second call has no effect.
        """
        joined, self.joined = self.joined, False
        for port in self.ports if joined else ():
            port.detach(self)
        for port in self.ports if joined else ():
            port.notify(port.on_disconnect, self.profile)


C = TypeVar("C", bound=ConnectorBase)


class PortGuard(Protocol):
    """Object that can refuse a new connector of a port, or a value that the port transfers.

    Example: an emulated T-Kernel node limits the number of its connectors and the size of a value.
    So the node is the guard of its ports.
    """

    def admit(self, connector: ConnectorBase, /) -> None:
        """Raise RtcRefused if the port may not have this additional connector."""

    def passes(self, port: AnyPort, value: Any, /) -> bool:
        """Return whether a port may send a value, or receive it from another process."""
        ...


class Port(Generic[C]):
    """A port of a component, which is connected by connectors.

    Args:
        name: name of the port, without the name of its component.

    Attributes:
        name: name of the port, without the name of its component.
        port_type: name of the port's class in OpenRTM, such as `DataInPort`.
        owner: instance name of the port's component, empty without a component.
        guard: guard that keeps the port within the limits of its node, or None without limits.
        connectors: connectors of the port in the order in which they were made.
        on_connect: functions that are called with a connector's profile after the connector was
            made.
        on_disconnect: functions that are called with a connector's profile after the connector
            ended.
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
        """Name of the port in profiles, such as `ConsoleIn0.out`."""
        return f"{self.owner}.{self.name}" if self.owner else self.name

    @property
    def profile(self) -> PortProfile:
        """Profile of the port in its present state."""
        connectors = tuple(connector.profile for connector in self.connectors)
        properties = {"port.port_type": self.port_type, **self._properties()}
        return PortProfile(self.full_name, self._interfaces(), connectors, properties)

    def find_connector(self, connector_id: str) -> C | None:
        """Return the connector of this port that has a given ID.

        Args:
            connector_id: ID in the profile of the connector.

        Returns:
            The connector, or None if the port has no connector with this ID.
        """
        found = (own for own in self.connectors if own.profile.connector_id == connector_id)
        return next(found, None)

    def connector_to(self, other: AnyPort) -> C | None:
        """Return the connector that connects this port with another port.

        Args:
            other: port to which the connector leads.

        Returns:
            The connector, or None if the two ports are not connected.
        """
        shared = (own for own in self.connectors if own in other.connectors)
        return next(shared, None) if other is not self else None

    def disconnect_all(self) -> None:
        """End all connectors of the port."""
        for connector in self.connectors:
            connector.end()

    def attach(self, connector: C) -> None:
        """Add a connector to the port."""
        self.connectors += (connector,)

    def detach(self, connector: C) -> None:
        """Remove a connector from the port."""
        self.connectors = tuple(c for c in self.connectors if c is not connector)

    def notify(self, listeners: list[Listener], profile: ConnectorProfile) -> None:
        """Call functions with the profile of a connector.

        If a function raises an exception, the exception is logged.

        Args:
            listeners: functions to call: the list `on_connect` or `on_disconnect` of the port.
            profile: profile of the connector that was made or removed.
        """
        call_listeners(self.full_name, listeners, profile)

    def _properties(self) -> Mapping[str, str]:
        return {}

    def _interfaces(self) -> tuple[InterfaceProfile, ...]:
        return ()


AnyPort = Port[Any]
"""A port of any kind."""
