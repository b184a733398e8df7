"""RTSProfile XML, version 0.2, as in rtshell (rtcryo, rtresurrect) and RT System Editor.

Positions on a drawing, and the start-up and shut-down orders, are not written. The reader ignores
all data that `System` does not have. A restored system is Inactive.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final
from xml.etree import ElementTree as ET

from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.configuration import DEFAULT
from tickrig.host.rtc.ports.data_port import DataPort
from tickrig.host.rtc.ports.port import ConnectorProfile
from tickrig.host.rtc.states import RtcRefused
from tickrig.host.rtc.system.manager import DEFAULT_RATE_HZ, Manager
from tickrig.host.rtc.system.system import ComponentEntry, ConnectionEntry, System, given_id

_RTS: Final = "http://www.openrtp.org/namespaces/rts"
_EXT: Final = "http://www.openrtp.org/namespaces/rts_ext"
_XSI: Final = "http://www.w3.org/2001/XMLSchema-instance"

_DECLARATION: Final = '<?xml version="1.0" encoding="UTF-8"?>'
_PREFIXES: Final = {"rts": _RTS, "rtsExt": _EXT, "xsi": _XSI}
_KINDS: Final[Mapping[str, str]] = {
    "Components": "component_ext",
    "DataPorts": "dataport_ext",
    "ServicePorts": "serviceport_ext",
    "ExecutionContexts": "execution_context_ext",
    "DataPortConnectors": "dataport_connector_ext",
    "ServicePortConnectors": "serviceport_connector_ext",
}
_TYPES: Final[Mapping[str, str]] = {
    "interfaceType": "dataport.interface_type",
    "dataflowType": "dataport.dataflow_type",
    "subscriptionType": "dataport.subscription_type",
}


def write_rts_profile(
    manager: Manager,
    name: str = "system",
    vendor: str = "tickrig",
    version: str = "1.0",
    date: str = "1970-01-01T00:00:00",
) -> str:
    """Return the system of a manager as an XML text in the format RTSProfile.

    Args:
        manager: manager whose components and connectors are written.
        name: name of the system.
        vendor: vendor of the system.
        version: version of the system.
        date: date of creation and update, such as `2010-09-02T12:00:00`.
    """
    for prefix, space in _PREFIXES.items():
        ET.register_namespace(prefix, space)
    root = ET.Element(_rts("RtsProfile"))
    about = {"id": f"RTSystem:{vendor}:{name}:{version}", "version": "0.2"}
    _set(root, **about, creationDate=date, updateDate=date)
    for component in manager.components:
        _add_component(root, component, manager)
    for connector in manager.connectors:
        _add_connector(root, connector, manager)
    ET.indent(root)
    return f"{_DECLARATION}\n{ET.tostring(root, 'unicode')}\n"


def parse_rts_profile(text: str) -> System:
    """Read the description of a system from an XML text in the format RTSProfile.

    Raises:
        RtcRefused: the text is not XML, not an RTSProfile, or an incomplete RTSProfile.
    """
    try:
        root = ET.fromstring(text)
    except ET.ParseError as error:
        raise RtcRefused(f"not XML: {error}") from error
    if root.tag != _rts("RtsProfile"):
        raise RtcRefused(f"{root.tag} is not an RTSProfile")
    return System(
        tuple(_component(node) for node in root.iter(_rts("Components"))),
        (
            *(_connection(node, "Data") for node in root.iter(_rts("DataPortConnectors"))),
            *(_connection(node, "Service") for node in root.iter(_rts("ServicePortConnectors"))),
        ),
    )


def _rts(name: str) -> str:
    return f"{{{_RTS}}}{name}"


def _set(node: ET.Element, **attributes: str) -> None:
    for name, value in attributes.items():
        node.set(_rts(name), value)


def _child(parent: ET.Element, name: str, /, **attributes: str) -> ET.Element:
    node = ET.SubElement(parent, _rts(name))
    if name in _KINDS:
        node.set(f"{{{_XSI}}}type", f"rtsExt:{_KINDS[name]}")
    _set(node, **attributes)
    return node


def _component_id(component: RtComponent) -> str:
    spec = component.spec
    return f"RTC:{spec.vendor}:{spec.category}:{spec.type_name}:{spec.version}"


def _add_component(root: ET.Element, component: RtComponent, manager: Manager) -> None:
    name, configuration = component.instance_name, component.configuration
    node = _child(root, "Components", id=_component_id(component), instanceName=name)
    path_uri = manager.path_uris.get(name, manager.path(name))
    _set(node, pathUri=path_uri, activeConfigurationSet=configuration.active_id)
    _set(node, compositeType="None", isRequired="true")
    for port in component.ports.values():
        is_data = isinstance(port, DataPort)
        _child(node, "DataPorts" if is_data else "ServicePorts", name=port.full_name)
    for set_id, values in configuration.sets.items():
        configuration_set = _child(node, "ConfigurationSets", id=set_id)
        for parameter, text in values.items():
            _child(configuration_set, "ConfigurationData", name=parameter, data=text)
    for number, context in enumerate(component.contexts):
        kind, rate = context.kind.name, str(float(context.rate_hz))
        _child(node, "ExecutionContexts", id=str(number), kind=kind, rate=rate)


def _add_connector(root: ET.Element, profile: ConnectorProfile, manager: Manager) -> None:
    is_data = isinstance(manager.port(profile.ports[0]), DataPort)
    word = "Data" if is_data else "Service"
    node = _child(root, f"{word}PortConnectors", name=profile.name)
    _set(node, connectorId=profile.connector_id)
    properties = dict(profile.properties)
    if is_data:
        _set(node, dataType=properties.pop("dataport.data_type"), pushInterval="0.0")
        _set(node, **{name: properties.pop(key) for name, key in _TYPES.items()})
    for role, port in zip(("source", "target"), profile.ports, strict=True):
        owner = manager.find(port.rpartition(".")[0])
        end = _child(node, f"{role}{word}Port", portName=port, instanceName=owner.instance_name)
        _set(end, componentId=_component_id(owner))
    for key, value in properties.items():
        extra = ET.SubElement(node, f"{{{_EXT}}}Properties")
        extra.set(f"{{{_EXT}}}name", key)
        extra.set(f"{{{_EXT}}}value", value)


def _need(node: ET.Element, name: str) -> str:
    if not (value := node.get(_rts(name))):
        raise RtcRefused(f"{node.tag.partition('}')[2]} without {name}")
    return value


def _component(node: ET.Element) -> ComponentEntry:
    component_id = _need(node, "id").split(":")
    if len(component_id) != 5:
        raise RtcRefused(f"id {':'.join(component_id)} is not like RTC:vendor:category:type:1.0")
    context = node.find(_rts("ExecutionContexts"))
    rate = DEFAULT_RATE_HZ if context is None else _number(context, "rate")
    return ComponentEntry(
        _need(node, "instanceName"),
        component_id[3],
        rate,
        configuration_set=node.get(_rts("activeConfigurationSet")) or DEFAULT,
        configuration=dict(_sets(node)),
        path=node.get(_rts("pathUri"), ""),
    )


def _sets(node: ET.Element) -> Iterator[tuple[str, Mapping[str, str]]]:
    """Yield the configuration sets, except the sets that editors use."""
    for configuration_set in node.iter(_rts("ConfigurationSets")):
        set_id = _need(configuration_set, "id")
        if not set_id.startswith("__"):
            data = configuration_set.iter(_rts("ConfigurationData"))
            yield set_id, {_need(d, "name"): d.get(_rts("data"), "") for d in data}


def _connection(node: ET.Element, word: str) -> ConnectionEntry:
    source, target = (_port(node, f"{role}{word}Port") for role in ("source", "target"))
    properties = {
        key: value.lower() for name, key in _TYPES.items() if (value := node.get(_rts(name)))
    }
    periodic = properties.get("dataport.subscription_type") == "periodic"
    has_interval = periodic and node.get(_rts("pushInterval"))
    if has_interval and (interval_s := _number(node, "pushInterval")) > 0:
        properties["dataport.publisher.push_rate"] = str(1 / interval_s)
    for extra in node.findall(f"{{{_EXT}}}Properties"):
        properties[extra.get(f"{{{_EXT}}}name", "")] = extra.get(f"{{{_EXT}}}value", "")
    properties.pop("dataport.data_type", None)  # of rtcryo; the ports say it
    ports, connector_id = (source, target), node.get(_rts("connectorId"), "")
    name, given = node.get(_rts("name"), ""), given_id(connector_id, (source, target))
    return ConnectionEntry(ports, name, properties, given)


def _port(node: ET.Element, name: str) -> str:
    end = node.find(_rts(name))
    if end is None:
        raise RtcRefused(f"{node.tag.partition('}')[2]} without {name}")
    owner = _need(end, "instanceName")
    return f"{owner}.{_need(end, 'portName').removeprefix(f'{owner}.')}"


def _number(node: ET.Element, name: str) -> float:
    text = _need(node, name)
    try:
        return float(text)
    except ValueError as error:
        raise RtcRefused(f"{name} {text!r} is not a number") from error
