"""The manager of a system, which makes and ends components, connects their ports, and runs them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import count
from typing import Final, TypeVar

from tickrig.host.cli.extensions import ExtensionError, ExtensionGroup
from tickrig.host.rtc.component import ExecutionContext, ModuleSpec, RtComponent
from tickrig.host.rtc.listeners import call_listeners
from tickrig.host.rtc.ports.connect import Properties, connect
from tickrig.host.rtc.ports.connector import Connector
from tickrig.host.rtc.ports.port import AnyPort, ConnectorBase, ConnectorProfile
from tickrig.host.rtc.states import LifeCycleState, ReturnCode, RtcRefused
from tickrig.host.rtc.system.schedule import Schedule

# Component types that a manager finds by name: ours, and those of installed packages.

_HERE: Final = "tickrig.host.rtc.components"
_UCODE: Final = {
    "infrared_rays_reader": "InfraredRaysReader",
    "ucode_settlement": "UcodeSettlement",
    "contents_interpretation": "ContentsInterpretation",
}
_MOTION: Final[dict[str, str]] = {
    "RefHardRh3": "components.ref_hard:RefHardRh3",
    "Odometry": "components.odometry:Odometry",
    "PositionInput": "components.position_input:PositionInput",
    "OmniTo2WD": "components.omni_to_2wd:OmniTo2WD",
    "Navigation": "components.navigation:Navigation",
    "PathFollower": "components.path_follower:PathFollower",
    "GamePad": "options.game_pad:GamePad",
    "SwitchInputRTC": "options.switch_input:SwitchInput",
    "LRFCapture_URG": "options.lrf_capture_urg:LrfCaptureUrg",
    "Urg_to_Obstacles": "options.obstacles:UrgToObstacles",
    "ObstacleMonitor": "options.obstacles:ObstacleMonitor",
    "CollisionDetection": "options.obstacles:CollisionDetection",
    "ObstaclesAvoidance": "options.obstacles:ObstaclesAvoidance",
    "Follower": "options.follower:Follower",
    "GoalInterface": "iis_interfaces:GoalInterface",
    "RunningInformation": "iis_interfaces:RunningInformation",
    "PathInterface": "iis_interfaces:PathInterface",
    "Velocity1To2": "iis_interfaces:Velocity1To2",
    "Velocity2To1": "iis_interfaces:Velocity2To1",
    "Velocity2To3": "iis_interfaces:Velocity2To3",
    "Velocity3To2": "iis_interfaces:Velocity3To2",
    "Position2To3": "iis_interfaces:Position2To3",
    "Position3To2": "iis_interfaces:Position3To2",
    "PositiveHeading": "iis_interfaces:PositiveHeading",
    "WrappedHeading": "iis_interfaces:WrappedHeading",
}
"""Types in `host.rtc.motion`: the motion chain of RH3, options for it, and interfaces of IIS."""


def _is_component_type(found: object) -> bool:
    """Return whether an object is a class of components that can be registered."""
    return (
        isinstance(found, type)
        and issubclass(found, RtComponent)
        and isinstance(getattr(found, "spec", None), ModuleSpec)
    )


COMPONENT_TYPES: Final = ExtensionGroup[type[RtComponent]](
    "tickrig.components",
    "component type",
    {
        name: f"{_HERE}:{name}"
        for name in ("ConsoleIn", "ConsoleOut", "SeqIn", "SeqOut", "ConfigSample")
    }
    | {name: f"tickrig.host.rtc.ucode.{module}:{name}" for module, name in _UCODE.items()}
    | {name: f"tickrig.host.rtc.motion.{place}" for name, place in _MOTION.items()}
    | {name: f"tickrig.host.rtc.canopen.robots:{name}" for name in ("Joystick", "Beego", "FourX")},
    _is_component_type,
    "an RtComponent with a spec",
)
"""Entry-point group `tickrig.components` (docs/howto/extending.md)."""


def _installed_type(name: str) -> type[RtComponent]:
    """Load an installed type. Raise RtcRefused if that fails, or if its class has another name."""
    try:
        found = COMPONENT_TYPES.load(name)
    except ExtensionError as error:
        raise RtcRefused(str(error)) from error
    if found.spec.type_name != name:
        raise RtcRefused(f"component type {name!r} calls itself {found.spec.type_name!r}")
    return found


# Connections of a system to components that run elsewhere, which an engine maintains.


@dataclass(frozen=True, slots=True)
class RemoteEntry:
    """Name and path of a component that runs in another process and is part of a system.

    Attributes:
        name: name of the component in the system, such as `Joystick0` in `Joystick0.out`.
        path: path by which an engine finds the component. An engine is code that connects to other
            processes, such as the code for OpenRTM-aist. An example of a path is
            `localhost:2809/robot.host_cxt/Joystick0.rtc`.
    """

    name: str
    path: str


@dataclass(frozen=True, slots=True)
class RemoteConnection:
    """Description of a connector between a port in this process and a port in another process.

    Attributes:
        port: full name of the port in this process.
        remote: component in the other process.
        remote_port: name of the port in the other process, without the name of its component.
        ports: full names of both ports, in the order in which they were given.
        name: name of the connector, for display.
        properties: properties of the connector.
        connector_id: ID of the connector.
    """

    port: str
    remote: RemoteEntry
    remote_port: str
    ports: tuple[str, str]
    name: str = ""
    properties: Mapping[str, str] = field(default_factory=dict)
    connector_id: str = ""


@dataclass(slots=True)
class Remotes:
    """Components of a system that run in other processes, and the connectors to them."""

    components: list[RemoteEntry] = field(default_factory=list)
    connections: list[RemoteConnection] = field(default_factory=list)


# The name service of a manager: components by path.


class NameService:
    """Table of a manager's components by their path, such as `localhost/ConsoleIn0.rtc`.

    The paths are written as in rtshell. They exist only in this process, because a CORBA naming
    service for other processes is not emulated.
    """

    def __init__(self) -> None:
        self._components: dict[str, RtComponent] = {}

    def bind(self, path: str, component: RtComponent) -> None:
        """Bind a component to a path. Raise RtcRefused if the path is taken."""
        path = _plain(path)
        if path in self._components:
            raise RtcRefused(f"{path} is taken")
        self._components[path] = component

    def unbind(self, path: str) -> None:
        """Remove a path. A path that does not exist has no effect."""
        self._components.pop(_plain(path), None)

    def resolve(self, path: str) -> RtComponent:
        """Return the component at a path. Raise RtcRefused if there is none."""
        path = _plain(path)
        if path not in self._components:
            known = ", ".join(self._components) or "none"
            raise RtcRefused(f"nothing at {path}; known: {known}")
        return self._components[path]

    def names(self, context: str = "") -> tuple[str, ...]:
        """Return the names in a naming context. Names of contexts end with `/`."""
        prefix = f"{_plain(context)}/" if _plain(context) else ""
        rests = (path.removeprefix(prefix) for path in self._components if path.startswith(prefix))
        heads = (rest.partition("/") for rest in rests)
        return tuple(dict.fromkeys(head + slash for head, slash, _ in heads))


def _plain(path: str) -> str:
    return path.strip("/")


R = TypeVar("R", bound=RtComponent)

ComponentListener = Callable[[RtComponent], object]

DEFAULT_RATE_HZ: Final = 1_000.0


class Manager(Schedule):
    """A manager that creates, names, connects and runs components (OpenRTM-aist 1.x, Manager).

    The manager has no clock. `run_for` and `run_to` pass virtual time, in us. In real time,
    `RealTime` waits for `due_us` and calls `tick`.

    Not emulated: loading of modules from files, and master managers. Component
    types are registered, or found by the name that an installed package gives them.

    Args:
        host: naming context of the manager's components.

    Attributes:
        names: names of the manager's components, such as `localhost/ConsoleIn0.rtc`.
        path_uris: paths of components in other name servers, from RTSProfiles, by instance name.
        remotes: components that run elsewhere. An engine connects them with the local components.
        on_added: functions that are called with each component that is added, once the component
            has its name.
        on_removed: functions that are called with each component that ended, once its name is free.
    """

    def __init__(self, host: str = "localhost") -> None:
        super().__init__()
        self.names, self.remotes = NameService(), Remotes()
        self._host = host
        self._registered: dict[str, type[RtComponent]] = {}
        self._components: dict[str, RtComponent] = {}
        self.path_uris: dict[str, str] = {}
        self.on_added: list[ComponentListener] = []
        self.on_removed: list[ComponentListener] = []

    @property
    def types(self) -> tuple[str, ...]:
        """Names of the types that can be created. Registered types come before installed types."""
        return tuple(dict.fromkeys((*self._registered, *self._installed)))

    @property
    def components(self) -> tuple[RtComponent, ...]:
        """The components, in the order in which they were added."""
        return tuple(self._components.values())

    @property
    def connectors(self) -> tuple[ConnectorProfile, ...]:
        """All connectors between the manager's components. Each connector occurs once."""
        ports = [port for component in self.components for port in component.ports.values()]
        own = set(ports)
        profiles = {
            connector: connector.profile
            for port in ports
            for connector in port.connectors
            if connector.joins_components and own.issuperset(connector.ports)
        }
        return tuple(profiles.values())

    def register(self, kind: type[RtComponent]) -> None:
        """Register a component class, so that `create` can create components of this type.

        Args:
            kind: component class. Its type name is the one in its `spec`.
        """
        self._registered[kind.spec.type_name] = kind

    def create(
        self,
        type_name: str,
        instance_name: str = "",
        rate_hz: float = DEFAULT_RATE_HZ,
        context: ExecutionContext | None = None,
    ) -> RtComponent:
        """Create a component of a type that is registered or installed, and add it to the system.

        Args:
            type_name: name of the type, as registered or as an installed package names it
                (docs/howto/extending.md).
            instance_name: name of the component. By default, it is the type name with the lowest
                free number.
            rate_hz: rate of the execution context that is made for the component.
            context: existing execution context for the component. By default, a new one is made.

        Returns:
            The created component.

        Raises:
            RtcRefused: the type is unknown or cannot be loaded, or `add` refuses the component.
        """
        component = self._type(type_name)(instance_name or self.free_name(type_name))
        return self.add(component, rate_hz, context)

    def add(
        self,
        component: R,
        rate_hz: float = DEFAULT_RATE_HZ,
        context: ExecutionContext | None = None,
    ) -> R:
        """Add an existing component to the system: initialize it, register its name, and run it.

        Args:
            component: component to add, for example one of your own class.
            rate_hz: rate of the execution context that is made for the component, 1 uHz to 1 MHz.
            context: existing execution context for the component. By default, a new one is made.

        Returns:
            The added component.

        Raises:
            RtcRefused: another component has the same name, or on_initialize failed.
            ValueError: the rate is out of range.
        """
        name = component.instance_name
        if name in self._components:
            raise RtcRefused(f"a component {name!r} is there already")
        if context is None:
            component.own(own := ExecutionContext(rate_hz))
            self.add_context(own)
        else:
            context.add_component(component)
            self.add_context(context)
        if (code := component.initialize()) is not ReturnCode.RTC_OK:
            self._leave(component)
            raise RtcRefused(f"on_initialize of {name} returned {code.name}", code)
        self._components[name] = component
        self.names.bind(self.path(name), component)
        call_listeners(name, self.on_added, component)
        return component

    def delete(self, name: str) -> None:
        """End a component and remove it from the system.

        If a callback calls this method, the component ends at the end of the tick.

        Args:
            name: instance name or path of the component.

        Raises:
            RtcRefused: there is no such component.
        """
        component = self.find(name)
        self.defer(lambda: self._end(component))

    def find(self, name: str) -> RtComponent:
        """Return the component that has a given instance name or path.

        Args:
            name: instance name or path, such as `ConsoleIn0` or `localhost/ConsoleIn0.rtc`.

        Returns:
            The component.

        Raises:
            RtcRefused: there is no component with that name.
        """
        if "/" in name:
            return self.names.resolve(name)
        if (component := self._components.get(name)) is None:
            known = ", ".join(self._components) or "none"
            raise RtcRefused(f"no component {name!r}; known: {known}")
        return component

    def port(self, name: str) -> AnyPort:
        """Return the port that has a given full name or path.

        Args:
            name: full name or path of the port, such as `ConsoleIn0.out` or
                `localhost/ConsoleIn0.rtc:out`.

        Returns:
            The port.

        Raises:
            RtcRefused: there is no such component or port.
        """
        owner, _, port_name = name.rpartition(":" if ":" in name else ".")
        component = self.find(owner)
        if (port := component.ports.get(port_name)) is None:
            known = ", ".join(component.ports) or "none"
            raise RtcRefused(f"{owner} has no port {port_name!r}; known: {known}")
        return port

    def connect(
        self,
        first: str,
        second: str,
        properties: Properties | None = None,
        *,
        name: str = "",
        connector_id: str = "",
    ) -> ConnectorProfile:
        """Connect two ports of the manager's components.

        Args:
            first: full name or path of one port, such as `ConsoleIn0.out`.
            second: full name or path of the other port, such as `ConsoleOut0.in`.
            properties: properties of the connector, such as `{"dataport.subscription_type":
                "new"}`. Other properties have OpenRTM's defaults.
            name: name of the connector, for display.
            connector_id: ID of the connector. By default, it is made from the names of the ports.

        Returns:
            The profile of the connector.

        Raises:
            RtcRefused: there is no such port, the ports do not fit, another connector has this ID,
                or a property has an invalid value.
        """
        if connector_id and connector_id in (other.connector_id for other in self.connectors):
            message = f"a connector {connector_id!r} is there already"
            raise RtcRefused(message, ReturnCode.PRECONDITION_NOT_MET)
        ports = self.port(first), self.port(second)
        connector = connect(*ports, properties, name=name, connector_id=connector_id)
        if isinstance(connector, Connector):
            self.add_connector(connector)
        return connector.profile

    def disconnect(self, first: str, second: str) -> None:
        """End the connector between two ports.

        Args:
            first: full name or path of one port, such as `ConsoleIn0.out`.
            second: full name or path of the other port. If the other port belongs to another
                process, give the name of the port that is listed in `profile.ports` of the
                connector.

        Raises:
            RtcRefused: there is no such port, or the ports are not connected.
        """
        try:
            connector = self.port(first).connector_to(self.port(second))
        except RtcRefused:
            connector = self._connector_elsewhere(first, second)
            if connector is None:
                raise
        if connector is None:
            raise RtcRefused(f"{first} and {second} are not connected")
        connector.end()

    def _connector_elsewhere(self, first: str, second: str) -> ConnectorBase | None:
        """Return the connector of a local port to a port that no local component has."""
        ends = {first, second}
        ports = (port for one in self.components for port in one.ports.values())
        found = (one for port in ports for one in port.connectors)
        return next((one for one in found if set(one.profile.ports) == ends), None)

    def context_of(self, name: str) -> ExecutionContext:
        """Return the (first) execution context that runs a component.

        Args:
            name: instance name or path of the component.

        Returns:
            The execution context.

        Raises:
            RtcRefused: there is no such component, or no execution context runs it.
        """
        if not (contexts := self.find(name).contexts):
            raise RtcRefused(f"{name} takes part in no execution context")
        return contexts[0]

    def state_of(self, name: str) -> LifeCycleState:
        """Return the life-cycle state of a component in its (first) execution context.

        Args:
            name: instance name or path of the component.

        Returns:
            The state.

        Raises:
            RtcRefused: there is no such component, or no execution context runs it.
        """
        return self.context_of(name).state_of(self.find(name))

    def activate(self, *names: str) -> None:
        """Request that components move from Inactive to Active in their next period.

        Args:
            names: instance names or paths of the components. The requests are made one after the
                other.

        Raises:
            RtcRefused: a component is unknown or not Inactive. The requests made before it remain
                valid.
        """
        self._request("activate", ExecutionContext.activate_component, names)

    def deactivate(self, *names: str) -> None:
        """Request that components move from Active to Inactive in their next period.

        Args:
            names: instance names or paths of the components. The requests are made one after the
                other.

        Raises:
            RtcRefused: a component is unknown or not Active. The requests made before it remain
                valid.
        """
        self._request("deactivate", ExecutionContext.deactivate_component, names)

    def reset(self, *names: str) -> None:
        """Request that components move from Error to Inactive in their next period.

        Args:
            names: instance names or paths of the components. The requests are made one after the
                other.

        Raises:
            RtcRefused: a component is unknown or not in Error. The requests made before it remain
                valid.
        """
        self._request("reset", ExecutionContext.reset_component, names)

    def free_name(self, type_name: str) -> str:
        """Return an instance name for a new component. No other component has this name.

        Args:
            type_name: type name of the component, with which the instance name begins.

        Returns:
            The type name with the lowest free number, such as `ConsoleIn0`.
        """
        return next(
            name for number in count() if (name := f"{type_name}{number}") not in self._components
        )

    def path(self, name: str) -> str:
        """Return the path that a component has in the manager's name service.

        Args:
            name: instance name of the component.

        Returns:
            The path, such as `localhost/ConsoleIn0.rtc`.
        """
        return f"{self._host}/{name}.rtc"

    @cached_property
    def _installed(self) -> tuple[str, ...]:
        """Names of the installed types. The types of this package come first."""
        return tuple(COMPONENT_TYPES.names())

    def _type(self, name: str) -> type[RtComponent]:
        if name in self._registered:
            return self._registered[name]
        if name not in self._installed:
            raise RtcRefused(f"no component type {name!r}; known: {', '.join(self.types)}")
        return _installed_type(name)

    def _request(
        self,
        what: str,
        request: Callable[[ExecutionContext, RtComponent], ReturnCode],
        names: tuple[str, ...],
    ) -> None:
        for name in names:
            code = request(self.context_of(name), self.find(name))
            if code is not ReturnCode.RTC_OK:
                state = self.state_of(name).name
                raise RtcRefused(f"{what} {name}: {code.name}, it is {state}", code)

    def _end(self, component: RtComponent) -> None:
        """End a component, unless it has already ended."""
        name = component.instance_name
        if self._components.get(name) is component:
            contexts = tuple(component.own_contexts)
            component.exit()
            for context in contexts:
                self.remove_context(context)
            self.names.unbind(self.path(name))
            del self._components[name]
            call_listeners(name, self.on_removed, component)

    def _leave(self, component: RtComponent) -> None:
        """Remove a component that could not be initialized from its context."""
        for own in component.own_contexts:
            self.remove_context(own)
        for context in tuple(component.contexts):
            context.remove_component(component)
