"""The requests that a running system of RT components answers (docs/reference/rtc/rtc.md)."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final, Protocol

from tickrig.host.control.requests import Object, RequestDispatcher, short, text_of, whole
from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.configuration import Configuration, as_text
from tickrig.host.rtc.ports.connect import connect
from tickrig.host.rtc.ports.data_port import InPort, OutPort
from tickrig.host.rtc.ports.literal import literal, read_literal
from tickrig.host.rtc.ports.port import AnyPort, ConnectorBase
from tickrig.host.rtc.states import LifeCycleState, RtcRefused
from tickrig.host.rtc.system.manager import DEFAULT_RATE_HZ, Manager
from tickrig.host.rtc.system.rts_profile import write_rts_profile
from tickrig.host.rtc.system.system import describe
from tickrig.host.rtc.system.system_file import write_toml
from tickrig.host.text.user_file import explain_error
from tickrig.wire.instant import NEVER
from tickrig.wire.rtc_types.idl import Struct

# Ports for observers of a running system: they display values, and inject values.

HELD: Final = 1_000
"""Number of values of a port that are kept. If there are more, the oldest values are lost."""

LEASE_US: Final = 5_000_000
"""Time without a request for its values after which an OutPort is no longer watched."""


@dataclass(frozen=True, slots=True)
class _NumberedValue:
    """A value that an OutPort wrote. Numbers start at 1 each time the port is watched."""

    number: int
    value: Struct


@dataclass(slots=True)
class _WatchedPort:
    """An InPort that takes the values that an OutPort writes."""

    port: InPort[Any]
    requested_us: int
    count: int = 0
    seen: deque[_NumberedValue] = field(default_factory=lambda: deque(maxlen=HELD))

    def take(self) -> None:
        while self.port.is_new and (value := self.port.read()) is not None:
            self.count += 1
            self.seen.append(_NumberedValue(self.count, value))


class Probes:
    """Probes that read the values of OutPorts for the user, and write the user's values to InPorts.

    A probe is a port that belongs to no component. A connector joins each probe with the port to be
    read or written. When a system is saved, its file does not contain these connectors. When a
    probe has written a value, the connector of the probe ends as soon as the InPort has read the
    value.

    Args:
        manager: manager with the ports.
    """

    def __init__(self, manager: Manager) -> None:
        self._manager = manager
        self._watches: dict[AnyPort, _WatchedPort] = {}
        self._injections: dict[AnyPort, OutPort[Any]] = {}

    def watch(self, name: str, since: int = 0) -> tuple[tuple[_NumberedValue, ...], int]:
        """Return the values that an OutPort has written since a previous call.

        The values are recorded from the first call on.

        Args:
            name: full name or path of the port, such as `ConsoleIn0.out`.
            since: number of the latest value that the caller already has, or 0 for all.

        Returns:
            The values with a number above `since`, at most 1000, and the number of the latest
            value.

        Raises:
            RtcRefused: there is no such port, or the port is not an OutPort.
        """
        port = self._manager.port(name)
        if not isinstance(port, OutPort):
            raise RtcRefused(f"{name} is a {port.port_type}; values are shown of a DataOutPort")
        watch = self._watches.get(port) or self._start(port)
        watch.requested_us = self._manager.now_us
        watch.take()
        return tuple(seen for seen in watch.seen if seen.number > since), watch.count

    def inject(self, name: str, given: object) -> Struct:
        """Write a value to an InPort as a connected OutPort would, and return the value.

        Args:
            name: full name or path of the port, such as `ConsoleOut0.in`.
            given: value as parsed JSON, in the form that `read_literal` accepts.

        Raises:
            RtcRefused: there is no such port, the port is not an InPort, or the value does not fit.
        """
        port = self._manager.port(name)
        if not isinstance(port, InPort):
            raise RtcRefused(f"{name} is a {port.port_type}; values go into a DataInPort")
        value: Struct = read_literal(port.data_type, given, self._manager.now_us)
        if port not in self._injections:
            self._injections[port] = source = OutPort("inject", port.data_type)
            connect(source, port)
        self._injections[port].write(value)
        return value

    def tick(self, now_us: int) -> None:
        """Store the values that OutPorts wrote, and end connectors that are no longer needed."""
        for port, watch in tuple(self._watches.items()):
            watch.take()
            if now_us - watch.requested_us > LEASE_US or not watch.port.connectors:
                watch.port.disconnect_all()
                del self._watches[port]
        for port, source in tuple(self._injections.items()):
            if not any(connector.buffer.readable for connector in source.connectors):
                source.disconnect_all()
                del self._injections[port]

    def _start(self, port: OutPort[Any]) -> _WatchedPort:
        watch = _WatchedPort(InPort("print", port.data_type), self._manager.now_us)
        connect(port, watch.port, {"dataport.buffer.length": str(HELD)})
        self._watches[port] = watch
        return watch


class _Runner(Protocol):
    """An object that runs a system: `RealTime`, or the loop of a server that contains the system.

    Attributes:
        after_tick: function that is called with the time in us after each tick.
    """

    after_tick: list[Callable[[int], None]]

    @property
    def late_ticks(self) -> int:
        """The number of ticks that began late."""
        ...

    @property
    def worst_late_us(self) -> int:
        """The largest delay of a tick in us."""
        ...

    def stop(self) -> None:
        """End the run after the present tick."""


class SystemControl(RequestDispatcher):
    """Answers the requests to the control socket of a running system, such as `describe`.

    The system must not tick during a request.

    Args:
        manager: manager of the system.
        runner: object that runs the system, such as `RealTime`.
    """

    def __init__(self, manager: Manager, runner: _Runner) -> None:
        self._manager, self._runner, self._probes = manager, runner, Probes(manager)
        runner.after_tick.append(self._probes.tick)
        super().__init__(
            {
                "describe": (self._describe, ("names",)),
                "create": (self._create, ("type", "name", "rate_hz")),
                "connect": (self._connect, ("ports", "properties", "name")),
                "disconnect": (self._disconnect, ("ports",)),
                "activate": (self._move(manager.activate), ("name",)),
                "deactivate": (self._move(manager.deactivate), ("name",)),
                "reset": (self._move(manager.reset), ("name",)),
                "delete": (self._move(manager.delete), ("name",)),
                "set_parameter": (self._set_parameter, ("name", "parameter", "value", "set")),
                "add_set": (self._add_set, ("name", "set", "like")),
                "activate_set": (self._activate_set, ("name", "set")),
                "seen": (self._seen, ("port", "since")),
                "inject": (self._inject, ("port", "value")),
                "save": (self._save, ("format",)),
                "status": (self._status, ()),
                "stop": (self._stop, ()),
            }
        )

    def saved(self, what: str) -> str:
        """Return the description of the running system as text for a system file.

        Args:
            what: format of the file, `toml` or `xml`.

        Raises:
            ValueError: the format is neither `toml` nor `xml`.
        """
        match what:
            case "toml":
                return write_toml(describe(self._manager))
            case "xml":
                return write_rts_profile(self._manager)
            case _:
                raise ValueError(f"format is toml or xml, not {short(what)}")

    def _describe(self, request: Object) -> Object:
        manager = self._manager
        names = _texts(request, "names", 0) if "names" in request else ()
        components = [manager.find(name) for name in names] or manager.components
        return {
            "components": [describe_component(manager, component) for component in components],
            "types": list(manager.types),
        }

    def _create(self, request: Object) -> Object:
        type_name, name = text_of(request, "type"), text_of({"name": "", **request}, "name")
        rate_hz = request.get("rate_hz", DEFAULT_RATE_HZ)
        if not isinstance(rate_hz, int | float) or isinstance(rate_hz, bool):
            raise ValueError(f"rate_hz is a number, not {short(rate_hz)}")
        try:
            return {"name": self._manager.create(type_name, name, rate_hz).instance_name}
        except ValueError:
            raise
        except Exception as error:  # a user's constructor may raise anything
            raise ValueError(f"{type_name}: {explain_error(error)}") from error

    def _connect(self, request: Object) -> Object:
        first, second = _texts(request, "ports", 2)
        properties = request.get("properties", {})
        if not isinstance(properties, dict) or not all(
            isinstance(value, str) for value in properties.values()
        ):
            raise ValueError(f"properties are strings by name, not {short(properties)}")
        name = text_of({"name": "", **request}, "name")
        profile = self._manager.connect(first, second, properties, name=name)
        return {"name": profile.name, "properties": dict(profile.properties)}

    def _disconnect(self, request: Object) -> Object:
        names = _texts(request, "ports", 0)
        if len(names) == 2:
            self._manager.disconnect(*names)
            return {}
        for port in self._ports(*names):
            port.disconnect_all()
        return {}

    def _ports(self, *names: str) -> tuple[AnyPort, ...]:
        """Return a port, or all ports of a component."""
        if len(names) != 1:
            raise ValueError(f"ports are one or two names, not {len(names)}")
        (name,) = names
        if ":" in name or ("." in name and "/" not in name):
            return (self._manager.port(name),)
        return tuple(self._manager.find(name).ports.values())

    def _move(self, action: Callable[[str], None]) -> Callable[[Object], Object]:
        def move(request: Object) -> Object:
            action(text_of(request, "name"))
            return {}

        return move

    def _set_parameter(self, request: Object) -> Object:
        set_id = text_of({"set": "", **request}, "set")
        value = text_of(request, "value")
        self._configuration(request).set(text_of(request, "parameter"), value, set_id)
        return {}

    def _add_set(self, request: Object) -> Object:
        """Add a configuration set with the values of another set."""
        configuration = self._configuration(request)
        set_id, like = text_of(request, "set"), text_of(request, "like")
        if not set_id or set_id in configuration.sets:
            raise RtcRefused(f"configuration set {short(set_id)} has no name, or is there already")
        if like not in configuration.sets:
            known = ", ".join(configuration.sets)
            raise RtcRefused(f"no configuration set {short(like)}; known: {known}")
        configuration.add_set(set_id, configuration.sets[like])
        return {}

    def _activate_set(self, request: Object) -> Object:
        self._configuration(request).activate(text_of(request, "set"))
        return {}

    def _configuration(self, request: Object) -> Configuration:
        return self._manager.find(text_of(request, "name")).configuration

    def _seen(self, request: Object) -> Object:
        since = whole(request.get("since", 0), "since", 0, NEVER)
        seen, latest = self._probes.watch(text_of(request, "port"), since)
        values = [{"number": one.number, "value": literal(one.value)} for one in seen]
        return {"values": values, "latest": latest}

    def _inject(self, request: Object) -> Object:
        if "value" not in request:
            raise ValueError("inject needs a value")
        return {"value": literal(self._probes.inject(text_of(request, "port"), request["value"]))}

    def _save(self, request: Object) -> Object:
        return {"text": self.saved(text_of({"format": "toml", **request}, "format"))}

    def _status(self, request: Object) -> Object:
        return {
            "components": len(self._manager.components),
            "now_us": self._manager.now_us,
            "late_ticks": self._runner.late_ticks,
            "late_us": self._runner.worst_late_us,
        }

    def _stop(self, request: Object) -> Object:
        self._runner.stop()
        return {}


def _texts(request: Object, key: str, count: int) -> list[str]:
    """Return a list of strings. The length is checked unless `count` is 0."""
    value = request.get(key)
    texts = [text for text in value if isinstance(text, str)] if isinstance(value, list) else None
    if texts is None or texts != value or (count and len(texts) != count):
        raise ValueError(f"{key} is a list of {count or 'some'} names, not {short(value)}")
    return texts


def describe_component(manager: Manager, component: RtComponent) -> Object:
    """Return the full description of a component, as the control socket sends it."""
    name, spec = component.instance_name, component.spec
    return {
        "name": name,
        "path": manager.path(name),
        "type": spec.type_name,
        "description": spec.description,
        "version": spec.version,
        "vendor": spec.vendor,
        "category": spec.category,
        "properties": dict(component.profile.properties),
        "state": _state(component),
        "contexts": [
            {
                "rate_hz": context.rate_hz,
                "running": context.running,
                "state": context.state_of(component).name,
            }
            for context in component.contexts
        ],
        "ports": [_port(port) for port in component.ports.values()],
        "configuration": _describe_configuration(component.configuration),
    }


def _describe_configuration(configuration: Configuration) -> Object:
    """Return the sets, and the parameters with their present values."""
    return {
        "active": configuration.active_id,
        "sets": {set_id: dict(values) for set_id, values in configuration.sets.items()},
        "parameters": [
            {
                "name": parameter.name,
                "value": as_text(parameter.value),
                "unit": parameter.unit,
                "constraint": str(parameter.constraint),
            }
            for parameter in configuration.parameters.values()
        ],
    }


def _state(component: RtComponent) -> str:
    """Return the state in the first execution context."""
    contexts = component.contexts
    return (contexts[0].state_of(component) if contexts else LifeCycleState.CREATED).name


def _port(port: AnyPort) -> Object:
    profile = port.profile
    return {
        "name": profile.name,
        "kind": port.port_type,
        "data_type": profile.properties.get("dataport.data_type", ""),
        "interfaces": [
            {"name": item.instance_name, "type": item.type_name, "polarity": item.polarity}
            for item in profile.interfaces
        ],
        "connectors": [_connector(connector) for connector in port.connectors],
    }


def _connector(connector: ConnectorBase) -> Object:
    profile, state = connector.profile, connector.state
    return {
        "name": profile.name,
        "ports": list(profile.ports),
        "properties": dict(profile.properties),
        **({"state": state} if state else {}),
    }
