"""RT components as JSON objects."""

from __future__ import annotations

from tickrig.host.control.requests import Object
from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.configuration.configuration import Configuration
from tickrig.host.rtc.configuration.parameter import as_text
from tickrig.host.rtc.execution.states import LifeCycleState
from tickrig.host.rtc.ports.port import AnyPort, ConnectorProfile
from tickrig.host.rtc.system.manager import Manager


def describe_component(manager: Manager, component: RtComponent) -> Object:
    """Return all that there is to know about a component."""
    name, spec = component.instance_name, component.spec
    return {
        "name": name,
        "path": manager.path(name),
        "type": spec.type_name,
        "description": spec.description,
        "version": spec.version,
        "vendor": spec.vendor,
        "category": spec.category,
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
        "configuration": describe_configuration(component.configuration),
    }


def describe_configuration(configuration: Configuration) -> Object:
    """Return the sets, and the parameters with the values that hold now."""
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
        "connectors": [_connector(connector) for connector in profile.connector_profiles],
    }


def _connector(profile: ConnectorProfile) -> Object:
    return {
        "name": profile.name,
        "ports": list(profile.ports),
        "properties": dict(profile.properties),
    }
