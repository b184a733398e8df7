"""An RT component: callbacks, ports and configuration under a name (OMG RTC 1.0, RTObject)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import ClassVar, TypeVar

from tickrig.host.rtc.component_action import ComponentAction, guarded
from tickrig.host.rtc.configuration import Configuration
from tickrig.host.rtc.execution import ExecutionContext
from tickrig.host.rtc.ports.port import AnyPort, PortProfile
from tickrig.host.rtc.states import ReturnCode, RtcRefused

P = TypeVar("P", bound=AnyPort)


@dataclass(frozen=True, slots=True)
class ModuleSpec:
    """What is the same for all components of a class (OpenRTM-aist 1.x, module profile).

    Attributes:
        type_name: of the class, such as `ConsoleIn`.
        description: in a line.
        version: of the class.
        vendor: who made it.
        category: what it is for, such as `sensor`.
    """

    type_name: str
    description: str = ""
    version: str = "1.0.0"
    vendor: str = "tickrig"
    category: str = "generic"


@dataclass(frozen=True, slots=True, kw_only=True)
class ComponentProfile(ModuleSpec):
    """A component as OpenRTM describes it: what its class has, and what it has itself."""

    instance_name: str
    port_profiles: tuple[PortProfile, ...]
    properties: Mapping[str, str] = field(default_factory=dict)


class RtComponent(ComponentAction):
    """An RT component: life cycle, ports and configuration (OMG RTC 1.0, LightweightRTObject).

    A subclass has a `spec`, makes its ports and parameters in the constructor
    (`add_port`, `configuration.bind`), and overrides the callbacks that it needs
    (`on_activated`, `on_execute`, ...). A `Manager` creates components and runs them.

    Not emulated: composite components, and states per execution context beside
    that of the life cycle.

    Args:
        instance_name: unique in a system, such as `ConsoleIn0`.

    Attributes:
        spec: what is the same for all components of the class; each subclass sets it.
        instance_name: as above.
        alive: True between `initialize` and `finalize`.
        configuration: its configuration sets; one of them is active.
        ports: by name, in the order in which they were added.
        contexts: execution contexts it takes part in; the first decides its state.
        own_contexts: those that end with it.
    """

    spec: ClassVar[ModuleSpec]

    def __init__(self, instance_name: str) -> None:
        self.instance_name, self.alive = instance_name, False
        self.configuration = Configuration()
        self.ports: dict[str, AnyPort] = {}
        self.contexts: list[ExecutionContext] = []
        self.own_contexts: list[ExecutionContext] = []

    @property
    def profile(self) -> ComponentProfile:
        """The component as it is."""
        ports = tuple(port.profile for port in self.ports.values())
        return ComponentProfile(
            **asdict(self.spec), instance_name=self.instance_name, port_profiles=ports
        )

    def add_port(self, port: P) -> P:
        """Add a port.

        Args:
            port: a data port or service port.

        Returns:
            The port itself.

        Raises:
            RtcRefused: one has its name.
        """
        if port.name in self.ports:
            raise RtcRefused(f"{self.instance_name} has a port {port.name!r} already")
        port.owner = self.instance_name
        self.ports[port.name] = port
        return port

    def remove_port(self, port: AnyPort) -> None:
        """End a port's connectors and take it away."""
        port.disconnect_all()
        del self.ports[port.name]
        port.owner = ""

    def own(self, context: ExecutionContext) -> ReturnCode:
        """Take part in an execution context that ends with this component.

        Args:
            context: the execution context.

        Returns:
            What `ExecutionContext.add_component` says.
        """
        code = context.add_component(self)
        if code is ReturnCode.RTC_OK:
            self.own_contexts.append(context)
        return code

    def initialize(self) -> ReturnCode:
        """Created to alive, with on_initialize; then its own execution contexts start.

        Returns:
            PRECONDITION_NOT_MET unless Created; else what on_initialize returned, and it
            stays Created unless that is RTC_OK.
        """
        if self.alive:
            return ReturnCode.PRECONDITION_NOT_MET
        code = guarded(self.instance_name, self._begin)
        if code is ReturnCode.RTC_OK:
            self.alive = True
            for context in self.own_contexts:
                context.start()
        return code

    def finalize(self) -> ReturnCode:
        """End, with on_finalize, whatever that returns.

        Returns:
            PRECONDITION_NOT_MET in Created or while it takes part in an execution context;
            else what on_finalize returned.
        """
        if not self.alive or self.contexts:
            return ReturnCode.PRECONDITION_NOT_MET
        self.alive = False
        return guarded(self.instance_name, self.on_finalize)

    def exit(self) -> ReturnCode:
        """Leave all execution contexts, Active with on_deactivated; stop those it owns; finalize.

        Components that took part in a context it owns do so no more. Not to be
        called from a callback.

        Returns:
            PRECONDITION_NOT_MET in Created; else what on_finalize returned.
        """
        if not self.alive:
            return ReturnCode.PRECONDITION_NOT_MET
        for port in self.ports.values():
            port.disconnect_all()
        for context in self.own_contexts:
            context.close()
        for context in tuple(self.contexts):
            context.release_component(self)
        self.own_contexts.clear()
        return self.finalize()

    def _begin(self) -> ReturnCode:
        self.configuration.update()
        return self.on_initialize()
