"""The manager of a system: it makes and ends components, joins their ports, and runs them."""

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
"""The motion chain of RH3, what is around it, and the interfaces of IIS, in `host.rtc.motion`."""


def _is_component_type(found: object) -> bool:
    """Return whether this is a class of components, one that can be registered."""
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
"""The entry-point group `tickrig.components` (docs/howto/extending.md)."""


def _installed_type(name: str) -> type[RtComponent]:
    """Load one of them; RtcRefused if that fails, or if its class has another name."""
    try:
        found = COMPONENT_TYPES.load(name)
    except ExtensionError as error:
        raise RtcRefused(str(error)) from error
    if found.spec.type_name != name:
        raise RtcRefused(f"component type {name!r} calls itself {found.spec.type_name!r}")
    return found


# What a system has to do with components that run elsewhere: an engine looks after it.


@dataclass(frozen=True, slots=True)
class RemoteEntry:
    """A component that runs elsewhere.

    Attributes:
        name: how it is called in the system, such as `Joystick0` in `Joystick0.out`.
        path: where its engine finds it, such as `localhost:2809/robot.host_cxt/Joystick0.rtc`.
    """

    name: str
    path: str


@dataclass(frozen=True, slots=True)
class RemoteConnection:
    """A connector of a local port with a port of a component that runs elsewhere.

    Attributes:
        port: full name of the local port.
        remote: the component that runs elsewhere.
        remote_port: its port, without the name of the component.
        ports: both full names, in the order in which they were given.
        name: for people.
        properties: properties of the connector.
        connector_id: its ID.
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
    """The components that run elsewhere and the connectors with them, as a system file has them."""

    components: list[RemoteEntry] = field(default_factory=list)
    connections: list[RemoteConnection] = field(default_factory=list)


# The name service of a manager: components by path.


class NameService:
    """Components by path, as rtshell writes them: `localhost/ConsoleIn0.rtc`.

    These names exist only in this process. Not emulated: a CORBA naming service for other ones.
    """

    def __init__(self) -> None:
        self._components: dict[str, RtComponent] = {}

    def bind(self, path: str, component: RtComponent) -> None:
        """Give a component a path; RtcRefused if it is taken."""
        path = _plain(path)
        if path in self._components:
            raise RtcRefused(f"{path} is taken")
        self._components[path] = component

    def unbind(self, path: str) -> None:
        """Take a path away; one that is not there is no error."""
        self._components.pop(_plain(path), None)

    def resolve(self, path: str) -> RtComponent:
        """Return the component at a path; RtcRefused if there is none."""
        path = _plain(path)
        if path not in self._components:
            known = ", ".join(self._components) or "none"
            raise RtcRefused(f"nothing at {path}; known: {known}")
        return self._components[path]

    def names(self, context: str = "") -> tuple[str, ...]:
        """Return what stands in a naming context: names, and contexts with `/` at their end."""
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
    """Creates components, names them, joins their ports and runs them (OpenRTM-aist 1.x, Manager).

    It has no clock: `run_for` and `run_to` pass virtual time, in us; in real time `RealTime` waits
    for `due_us` and calls `tick`.

    Not emulated: loading of modules from files, and master managers. Component
    types are registered, or found by the name that an installed package gives them.

    Args:
        host: naming context of its components.

    Attributes:
        names: its components, such as `localhost/ConsoleIn0.rtc`.
        path_uris: by instance name, paths of components in other name servers, from RTSProfiles.
        remotes: components that run elsewhere, which an engine joins with those here.
        on_added: called with each component that is added, once it has its name.
        on_removed: called with each component that ended, once its name is free.
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
        """Names of the types that can be created, registered ones before those installed."""
        return tuple(dict.fromkeys((*self._registered, *self._installed)))

    @property
    def components(self) -> tuple[RtComponent, ...]:
        """The components, in the order in which they were added."""
        return tuple(self._components.values())

    @property
    def connectors(self) -> tuple[ConnectorProfile, ...]:
        """All connectors between its components, each once."""
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
        """Register a class, so that `create` can create components of it.

        Args:
            kind: the class, under the type name of its `spec`.
        """
        self._registered[kind.spec.type_name] = kind

    def create(
        self,
        type_name: str,
        instance_name: str = "",
        rate_hz: float = DEFAULT_RATE_HZ,
        context: ExecutionContext | None = None,
    ) -> RtComponent:
        """Create a component of a type that is registered or installed, and add it; see `add`.

        Args:
            type_name: as registered, or as a package names it (docs/howto/extending.md).
            instance_name: the type name with the lowest number that is free, if left out.
            rate_hz: of its own execution context.
            context: execution context of the component; if left out, it gets its own.

        Returns:
            The component.

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
        """Initialize a component, name it, and start its execution context.

        Args:
            component: a component of your own.
            rate_hz: of its own execution context, 1 uHz to 1 MHz.
            context: execution context of the component; if left out, it gets its own.

        Returns:
            The component itself.

        Raises:
            RtcRefused: its name is taken, or on_initialize failed.
            ValueError: no execution context can have this rate.
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
        """End a component; if a callback calls this method, at the end of the tick.

        Args:
            name: its instance name or path.

        Raises:
            RtcRefused: no such component.
        """
        component = self.find(name)
        self.defer(lambda: self._end(component))

    def find(self, name: str) -> RtComponent:
        """Find a component.

        Args:
            name: its instance name or path, as `ConsoleIn0` or `localhost/ConsoleIn0.rtc`.

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
        """Look a port up.

        Args:
            name: its full name or path, as `ConsoleIn0.out` or `localhost/ConsoleIn0.rtc:out`.

        Returns:
            The port.

        Raises:
            RtcRefused: no such component or port.
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
        """Join two ports.

        Args:
            first: the name of one, as `port` takes it.
            second: the name of the other.
            properties: what is to hold for the connector, such as
                `{"dataport.subscription_type": "new"}`; the rest is as OpenRTM has it.
            name: of the connector, for people.
            connector_id: its ID; made of the names of the ports if left out.

        Returns:
            The connector as it was made.

        Raises:
            RtcRefused: there is no such port, the ports do not fit, another connector has this ID,
                or the properties are not possible.
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
            first: the name of one, as `port` takes it.
            second: the name of the other; if it belongs to no component here, as the profile of the
                connector has it.

        Raises:
            RtcRefused: no such port, or they are not connected.
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
        """Return the connector of a port here with one that no component here has."""
        ends = {first, second}
        ports = (port for one in self.components for port in one.ports.values())
        found = (one for port in ports for one in port.connectors)
        return next((one for one in found if set(one.profile.ports) == ends), None)

    def context_of(self, name: str) -> ExecutionContext:
        """Look up the first execution context of a component.

        Args:
            name: the component's instance name or path.

        Returns:
            The execution context.

        Raises:
            RtcRefused: no such component, or it takes part in none.
        """
        if not (contexts := self.find(name).contexts):
            raise RtcRefused(f"{name} takes part in no execution context")
        return contexts[0]

    def state_of(self, name: str) -> LifeCycleState:
        """Look at the state of a component in its first execution context.

        Args:
            name: the component's instance name or path.

        Returns:
            The state.

        Raises:
            RtcRefused: no such component, or it takes part in no execution context.
        """
        return self.context_of(name).state_of(self.find(name))

    def activate(self, *names: str) -> None:
        """Request the move to Active.

        Args:
            names: names of the components; the requests are made one after the other.

        Raises:
            RtcRefused: a component is unknown or cannot make the move now; earlier requests stay.
        """
        self._request("activate", ExecutionContext.activate_component, names)

    def deactivate(self, *names: str) -> None:
        """Request the move to Inactive.

        Args:
            names: names of the components; the requests are made one after the other.

        Raises:
            RtcRefused: a component is unknown or cannot make the move now; earlier requests stay.
        """
        self._request("deactivate", ExecutionContext.deactivate_component, names)

    def reset(self, *names: str) -> None:
        """Request the move from Error to Inactive.

        Args:
            names: names of the components; the requests are made one after the other.

        Raises:
            RtcRefused: a component is unknown or cannot make the move now; earlier requests stay.
        """
        self._request("reset", ExecutionContext.reset_component, names)

    def free_name(self, type_name: str) -> str:
        """Find an instance name that is free.

        Args:
            type_name: the beginning of the name.

        Returns:
            The type name with the lowest number that is free, such as `ConsoleIn0`.
        """
        return next(
            name for number in count() if (name := f"{type_name}{number}") not in self._components
        )

    def path(self, name: str) -> str:
        """Return the path of a component in the name service.

        Args:
            name: its instance name.

        Returns:
            The path, such as `localhost/ConsoleIn0.rtc`.
        """
        return f"{self._host}/{name}.rtc"

    @cached_property
    def _installed(self) -> tuple[str, ...]:
        """Names of the types that installed packages have, ours first."""
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
        """Take a component that could not be initialized out of its context."""
        for own in component.own_contexts:
            self.remove_context(own)
        for context in tuple(component.contexts):
            context.remove_component(component)
