"""A system as it is saved, with its components, their configuration, and their connections."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass, field, replace

from tickrig.host.rtc.component import ExecutionContext, RtComponent
from tickrig.host.rtc.configuration import DEFAULT
from tickrig.host.rtc.ports.port import ConnectorProfile, automatic_id
from tickrig.host.rtc.states import LifeCycleState, RtcRefused
from tickrig.host.rtc.system.manager import (
    DEFAULT_RATE_HZ,
    Manager,
    RemoteConnection,
    RemoteEntry,
    Remotes,
)

_Sets = Mapping[str, Mapping[str, str]]


@dataclass(frozen=True, slots=True)
class ComponentEntry:
    """Description of a component in the description of a system.

    Attributes:
        name: instance name of the component.
        type_name: name of the component type.
        rate_hz: rate of the component's execution context in periods per second.
        context: name of the execution context that the component shares with other components. The
            name may be any word. It is empty if the component has its own execution context.
        active: whether the component is activated.
        configuration_set: name of the active configuration set.
        configuration: values of each configuration set as text, by set and parameter name.
        path: path of the component in an RTSProfile, empty if there is none.
    """

    name: str
    type_name: str
    rate_hz: float = DEFAULT_RATE_HZ
    context: str = ""
    active: bool = False
    configuration_set: str = DEFAULT
    configuration: _Sets = field(default_factory=dict)
    path: str = field(default="", compare=False)


@dataclass(frozen=True, slots=True)
class ConnectionEntry:
    """Description of a connector in the description of a system.

    Attributes:
        ports: full names of both ports, such as `ConsoleIn0.out`. The port that provides the values
            is first.
        name: name of the connector, for display.
        properties: properties of the connector.
        connector_id: ID of the connector, empty if it is made from the names of the ports.
    """

    ports: tuple[str, str]
    name: str = ""
    properties: Mapping[str, str] = field(default_factory=dict)
    connector_id: str = ""


@dataclass(frozen=True, slots=True)
class System:
    """Description of a system, as in a system file: its components and their connectors.

    Values in ports and buffers, and the internal state of components, are not part of it.

    Attributes:
        components: components that are created in this process.
        connections: connectors of the components, with each other and with remote components.
        remotes: components that run in other processes.
    """

    components: tuple[ComponentEntry, ...] = ()
    connections: tuple[ConnectionEntry, ...] = ()
    remotes: tuple[RemoteEntry, ...] = ()


def describe(manager: Manager) -> System:
    """Return the system of a manager in its present state."""
    shared: dict[int, str] = {}
    return System(
        tuple(_entry(component, shared) for component in manager.components),
        (
            *map(_connection, manager.connectors),
            *map(_connection, manager.remotes.connections),
        ),
        tuple(manager.remotes.components),
    )


def restore(manager: Manager, system: System) -> None:
    """Create the components and connectors that a system description lists, in a manager.

    Components that are marked as active are activated. Connectors to components in other processes
    are only listed in `manager.remotes`. An engine makes them later. An engine is code that
    connects to other processes, such as the code for OpenRTM-aist.

    Raises:
        RtcRefused: a component or connector cannot be created. All created components are then
            removed again.
    """
    made: list[str] = []
    before = Remotes(list(manager.remotes.components), list(manager.remotes.connections))
    try:
        _make(manager, system, made)
    except ValueError:
        manager.remotes = before
        for name in reversed(made):
            manager.delete(name)
        raise


def with_remotes(system: System, types: Container[str]) -> System:
    """Return a copy of a system description, with components of unknown types as remote components.

    An RTSProfile can describe a system that several processes run. If this process cannot create a
    component, the component runs in another process. Then this process needs the path of the
    component, such as `localhost:2809/robot.host_cxt/Joystick0.rtc`. A component of an unknown type
    without a path stays unchanged.

    Args:
        system: system description that was read.
        types: names of the types that can be created in this process.
    """
    there = [one for one in system.components if one.path and one.type_name not in types]
    here = tuple(one for one in system.components if one not in there)
    remotes = tuple(RemoteEntry(one.name, one.path) for one in there)
    return replace(system, components=here, remotes=system.remotes + remotes)


def _entry(component: RtComponent, shared: dict[int, str]) -> ComponentEntry:
    context, configuration = component.contexts[0], component.configuration
    own = context in component.own_contexts
    return ComponentEntry(
        component.instance_name,
        component.spec.type_name,
        context.rate_hz,
        "" if own else shared.setdefault(id(context), f"shared{len(shared)}"),
        context.state_of(component) is LifeCycleState.ACTIVE,
        configuration.active_id,
        {set_id: dict(values) for set_id, values in configuration.sets.items() if values},
    )


def _connection(one: ConnectorProfile | RemoteConnection) -> ConnectionEntry:
    given = given_id(one.connector_id, one.ports)
    return ConnectionEntry(one.ports, one.name, dict(one.properties), given)


def given_id(connector_id: str, ports: tuple[str, str]) -> str:
    """Return the ID of a connector for a system file, or an empty text if it is the default ID.

    The default ID is made from the names of the two ports, so a system file does not need it.
    """
    return "" if connector_id == automatic_id(ports) else connector_id


def _make(manager: Manager, system: System, made: list[str]) -> None:
    contexts: dict[str, ExecutionContext] = {}
    for entry in system.components:
        context = _context(entry, contexts)
        component = manager.create(entry.type_name, entry.name, entry.rate_hz, context)
        made.append(entry.name)
        _configure(component, entry)
    remotes = {entry.name: entry for entry in system.remotes}
    for connection in system.connections:
        if not remotes.keys().isdisjoint(map(_owner, connection.ports)):
            continue
        names = {"name": connection.name, "connector_id": connection.connector_id}
        manager.connect(*connection.ports, connection.properties, **names)
    _take_remotes(manager, system, remotes)
    for context in contexts.values():
        context.start()
    manager.activate(*(entry.name for entry in system.components if entry.active))


def _take_remotes(manager: Manager, system: System, remotes: Mapping[str, RemoteEntry]) -> None:
    """Record the components that run elsewhere, and their connectors to the local components."""
    here = {component.instance_name for component in manager.components}
    for name in sorted(here.intersection(remotes)):
        raise RtcRefused(f"{name} is here and runs elsewhere, too")
    wanted = [
        _remote(manager, connection, remotes)
        for connection in system.connections
        if not remotes.keys().isdisjoint(map(_owner, connection.ports))
    ]
    manager.remotes.components += remotes.values()
    manager.remotes.connections += wanted


def _remote(
    manager: Manager, entry: ConnectionEntry, remotes: Mapping[str, RemoteEntry]
) -> RemoteConnection:
    owners = [_owner(port) for port in entry.ports]
    if all(owner in remotes for owner in owners):
        raise RtcRefused(f"{' and '.join(entry.ports)} both run elsewhere")
    place = int(owners[0] in remotes)
    port, theirs = entry.ports[place], entry.ports[1 - place]
    return RemoteConnection(
        manager.port(port).full_name,
        remotes[_owner(theirs)],
        theirs.rpartition(".")[2],
        entry.ports,
        entry.name or automatic_id(entry.ports),
        entry.properties,
        entry.connector_id or automatic_id(entry.ports),
    )


def _owner(port: str) -> str:
    return port.rpartition(".")[0]


def _context(
    entry: ComponentEntry, contexts: dict[str, ExecutionContext]
) -> ExecutionContext | None:
    if not entry.context:
        return None
    if entry.context not in contexts:
        contexts[entry.context] = ExecutionContext(entry.rate_hz)
    return contexts[entry.context]


def _configure(component: RtComponent, entry: ComponentEntry) -> None:
    configuration = component.configuration
    try:
        for set_id, values in entry.configuration.items():
            configuration.add_set(set_id, values)
        configuration.activate(entry.configuration_set)
    except RtcRefused as error:
        raise RtcRefused(f"{entry.name}: {error}", error.code) from error


def differences(wanted: System, found: System) -> Iterator[str]:
    """Compare two system descriptions. Yield a line for each part that is missing or different.

    Args:
        wanted: description of the expected system.
        found: description of the actual system. Additional parts in it are ignored.
    """
    there = {entry.name: entry for entry in found.components}
    for entry in wanted.components:
        if entry.name not in there:
            yield f"{entry.name} is not there"
        else:
            yield from _component(entry, there[entry.name])
    joined = {frozenset(entry.ports): entry for entry in found.connections}
    for connection in wanted.connections:
        ends = " and ".join(connection.ports)
        if (other := joined.get(frozenset(connection.ports))) is None:
            yield f"{ends} are not connected"
        else:
            yield from _properties(ends, connection, other)


def _component(wanted: ComponentEntry, found: ComponentEntry) -> Iterator[str]:
    if found.type_name != wanted.type_name:
        yield f"{wanted.name} is a {found.type_name}, not a {wanted.type_name}"
    if found.rate_hz != wanted.rate_hz:
        yield f"{wanted.name} runs at {found.rate_hz:g} Hz, not at {wanted.rate_hz:g} Hz"
    if found.active != wanted.active:
        yield f"{wanted.name} is {'' if found.active else 'not '}Active"
    if found.configuration_set != wanted.configuration_set:
        sets = f"{found.configuration_set}, not {wanted.configuration_set}"
        yield f"{wanted.name} has the set {sets}"
    for set_id, values in wanted.configuration.items():
        for name, value in values.items():
            other = found.configuration.get(set_id, {}).get(name)
            if other != value:
                is_ = "is not there" if other is None else f"is {other}, not {value}"
                yield f"{wanted.name}: {name} of the set {set_id} {is_}"


def _properties(ends: str, wanted: ConnectionEntry, found: ConnectionEntry) -> Iterator[str]:
    for key, value in wanted.properties.items():
        if (other := found.properties.get(key)) != value:
            yield f"{ends}: {key} is {other or 'not there'}, not {value}"
