"""Service ports, with interfaces that one component provides and another calls."""

from __future__ import annotations

from typing import Any, Generic, TypeVar

from tickrig.host.rtc.ports import port
from tickrig.host.rtc.states import ReturnCode, RtcRefused

T = TypeVar("T")  # an interface: a Protocol


class Provider(Generic[T]):
    """An interface that a service port provides. Consumers on other ports can call it.

    Args:
        instance_name: name of the interface on the port.
        type_name: name of the interface type. Only consumers of the same type can be connected.
        servant: object whose methods execute the calls.
    """

    def __init__(self, instance_name: str, type_name: str, servant: T) -> None:
        self.servant = servant
        self.profile = port.InterfaceProfile(instance_name, type_name, "PROVIDED")


class Consumer(Generic[T]):
    """An interface that a service port requires, such as `Consumer[RefHard]("refhard", "RefHard")`.

    Once the port is connected, the attribute `service` is the object (servant) of the provider, and
    the component calls the methods of this object. The calls are plain method calls in the same
    thread. If a method of the provider raises an exception, the component receives the exception.
    """

    def __init__(self, instance_name: str, type_name: str) -> None:
        self.profile = port.InterfaceProfile(instance_name, type_name, "REQUIRED")
        self._provider: Provider[T] | None = None

    @property
    def connected(self) -> bool:
        """Whether there is a provider."""
        return self._provider is not None

    @property
    def service(self) -> T:
        """The provider's servant.

        RtcRefused (PRECONDITION_NOT_MET) is raised if there is no provider.
        """
        if self._provider is None:
            message = f"{self.profile.instance_name} is not connected"
            raise RtcRefused(message, ReturnCode.PRECONDITION_NOT_MET)
        return self._provider.servant

    def take(self, provider: Provider[T] | None) -> None:
        """Set the provider whose servant is called. None removes the present provider."""
        self._provider = provider


_Interface = Provider[Any] | Consumer[Any]


class ServicePort(port.Port["ServiceConnector"]):
    """A port with interfaces that the component provides to others, or requires from others."""

    port_type = "CorbaPort"

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.providers: list[Provider[Any]] = []
        self.consumers: list[Consumer[Any]] = []

    def provide(self, provider: Provider[T]) -> Provider[T]:
        """Add an interface that others may call, and return it."""
        self.providers.append(provider)
        return provider

    def require(self, consumer: Consumer[T]) -> Consumer[T]:
        """Add an interface that this component calls, and return it."""
        self.consumers.append(consumer)
        return consumer

    def _interfaces(self) -> tuple[port.InterfaceProfile, ...]:
        interfaces: list[_Interface] = [*self.providers, *self.consumers]
        return tuple(interface.profile for interface in interfaces)


class ServiceConnector(port.ConnectorBase):
    """A connector of two service ports, which gives each port's consumers the other's providers."""

    def __init__(
        self,
        profile: port.ConnectorProfile,
        ports: tuple[port.AnyPort, port.AnyPort],
        pairs: tuple[tuple[Consumer[Any], Provider[Any]], ...],
    ) -> None:
        super().__init__(profile, ports)
        self._pairs = pairs

    def begin(self) -> None:
        """Connect the consumers with their providers, then notify the listeners of both ports."""
        for consumer, provider in self._pairs:
            consumer.take(provider)
        super().begin()

    def end(self) -> None:
        """Remove the providers, then notify the listeners of both ports."""
        for consumer, _ in self._pairs if self.joined else ():
            consumer.take(None)
        super().end()
