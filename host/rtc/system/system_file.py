"""System files on disk: TOML, or RTSProfile where the name ends in .xml.

In TOML:

[[component]]
name = "ConsoleIn0"
type = "ConsoleIn"
rate_hz = 1000.0          # 1000 if left out
context = "main"          # shared with all that name it; own if left out
active = true             # false if left out
configuration_set = "default"

[component.configuration.default]
int_param0 = "5"

[[connection]]
ports = ["ConsoleIn0.out", "ConsoleOut0.in"]    # one of them may be of a remote component
connector_id = "9c1f"     # made of the names of the ports if left out

[connection.properties]
"dataport.subscription_type" = "new"

[[remote]]                # a component that runs elsewhere
name = "Joystick0"        # how the ports of a connection name it
path = "localhost:2809/robot.host_cxt/Joystick0.rtc"
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree as ET

from tickrig.host.cli.messages import Refused, refuse_path
from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.configuration import DEFAULT
from tickrig.host.rtc.ports.data_port import DataPort
from tickrig.host.rtc.ports.port import ConnectorProfile
from tickrig.host.rtc.states import RtcRefused
from tickrig.host.rtc.system.manager import DEFAULT_RATE_HZ, Manager, RemoteEntry
from tickrig.host.rtc.system.system import (
    ComponentEntry,
    ConnectionEntry,
    System,
    differences,
    given_id,
)
from tickrig.host.text.section import (
    Field,
    Schema,
    Section,
    anything,
    flag,
    in_a_line,
    lines,
    number,
    read_section,
    shown,
    string,
    table,
    text,
)
from tickrig.host.text.whole_file import check_file, write_whole

# RTSProfile XML, version 0.2, as rtshell (rtcryo, rtresurrect) and RT System Editor have it.
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
    """Write the system of a manager.

    Args:
        manager: whose system.
        name: of the system.
        vendor: of the system.
        version: of the system.
        date: of creation and update, as `2010-09-02T12:00:00`.
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
    """Read a system.

    Raises:
        RtcRefused: no XML, no RTSProfile, or one with something missing.
    """
    try:
        root = ET.fromstring(text)
    except ET.ParseError as error:
        raise RtcRefused(f"not XML: {error}") from error
    if root.tag != _rts("RtsProfile"):
        raise RtcRefused(f"{root.tag} is not an RTSProfile")
    return System(
        tuple(_rts_component(node) for node in root.iter(_rts("Components"))),
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
        for parameter, held in values.items():
            _child(configuration_set, "ConfigurationData", name=parameter, data=held)
    for at, context in enumerate(component.contexts):
        kind, rate = context.kind.name, str(float(context.rate_hz))
        _child(node, "ExecutionContexts", id=str(at), kind=kind, rate=rate)


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


def _rts_component(node: ET.Element) -> ComponentEntry:
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
    """Yield the configuration sets, but not those in which editors keep their own."""
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
    if properties.get("dataport.subscription_type") == "periodic" and node.get(
        _rts("pushInterval")
    ):
        interval_s = _number(node, "pushInterval")
        if interval_s > 0:
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


def _ports(value: object) -> tuple[str, str]:
    if isinstance(value, list) and len(value) == 2 and all(isinstance(each, str) for each in value):
        return value[0], value[1]
    raise ValueError(f'it takes two ports, as ["A0.out", "B0.in"], not {shown(value)}')


_TEXT: Final = Field(text, "a text", "how it is called")
_COMPONENT: Final[Schema] = {
    "name": _TEXT,
    "type": Field(text, "a text", "its type"),
    "rate_hz": Field(number(0, 1e9), "a number", "how often it runs", "1000"),
    "context": Field(string, "a text", "what shares its execution context", "its own"),
    "active": Field(flag, "true, false", "whether it is activated", "false"),
    "configuration_set": Field(string, "a text", "the active one", "default"),
    "configuration": Field(table, "tables", "values of each set", "none"),
}
_CONNECTION: Final[Schema] = {
    "ports": Field(_ports, '["A0.out", "B0.in"]', "what it connects"),
    "name": Field(string, "a text", "how it is called", "none"),
    "connector_id": Field(string, "a text", "its ID", "made of the ports"),
    "properties": Field(lines, 'lines like name = "value"', "of the connector", "none"),
}
_REMOTE: Final[Schema] = {"name": _TEXT, "path": Field(text, "a text", "where its engine finds it")}
_TOP: Final[Schema] = {
    name: Field(anything, f"tables [[{name}]]", "a part of the system", "none")
    for name in ("component", "connection", "remote")
}


def parse_toml(content: str) -> System:
    """Read a system file.

    Raises:
        RtcRefused: no TOML, or a key or value that is not in the table above.
    """
    top = read_section(content)
    top.read(_TOP)
    components = [_component(each) for each in top.tables("component")]
    connections = [each.read(_CONNECTION) for each in top.tables("connection")]
    remotes = [each.read(_REMOTE) for each in top.tables("remote")]
    if mistakes := top.notes.all:
        raise RtcRefused(in_a_line(mistakes))
    return System(
        tuple(ComponentEntry(**entry) for entry in components),
        tuple(ConnectionEntry(**entry) for entry in connections),
        tuple(RemoteEntry(**entry) for entry in remotes),
    )


def _component(section: Section) -> dict[str, Any]:
    entry = section.read(_COMPONENT)
    for set_id, values in entry.get("configuration", {}).items():
        try:
            lines(values)
        except ValueError as error:
            section.wrong(str(error), "configuration", set_id)
    if "rate_hz" in entry:
        entry["rate_hz"] = float(entry["rate_hz"])
    return {("type_name" if key == "type" else key): value for key, value in entry.items()}


def write_toml(system: System) -> str:
    """Write a system file."""
    return "\n".join(
        (*_component_lines(system), *_connection_lines(system), *_remote_lines(system))
    )


def _component_lines(system: System) -> Iterator[str]:
    for entry in system.components:
        yield "[[component]]"
        yield f"name = {_quoted(entry.name)}"
        yield f"type = {_quoted(entry.type_name)}"
        yield f"rate_hz = {float(entry.rate_hz)!r}"
        if entry.context:
            yield f"context = {_quoted(entry.context)}"
        yield f"active = {str(entry.active).lower()}"
        yield f"configuration_set = {_quoted(entry.configuration_set)}"
        yield ""
        for set_id, values in entry.configuration.items():
            yield f"[component.configuration.{_quoted(set_id)}]"
            yield from _texts(values)


def _connection_lines(system: System) -> Iterator[str]:
    for entry in system.connections:
        yield "[[connection]]"
        yield f"ports = [{', '.join(map(_quoted, entry.ports))}]"
        yield f"name = {_quoted(entry.name)}"
        if entry.connector_id:
            yield f"connector_id = {_quoted(entry.connector_id)}"
        yield ""
        if entry.properties:
            yield "[connection.properties]"
            yield from _texts(entry.properties)


def _remote_lines(system: System) -> Iterator[str]:
    for entry in system.remotes:
        yield f"[[remote]]\nname = {_quoted(entry.name)}\npath = {_quoted(entry.path)}\n"


def _texts(values: Mapping[str, str]) -> Iterator[str]:
    for name, value in values.items():
        yield f"{_quoted(name)} = {_quoted(value)}"
    yield ""


def _quoted(text: str) -> str:
    """Quote a text: TOML's rules are JSON's, but for DEL."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


TOML: Final = ".toml"
XML: Final = ".xml"


def read_system(path: Path) -> System:
    """Read a system file; Refused if that cannot be done."""
    try:
        return _parse(path, path.read_text("utf-8"))
    except UnicodeDecodeError as error:
        raise Refused(f"system {path}: byte {error.start} is not UTF-8") from None
    except OSError as error:
        refuse_path("system", error)
    except RtcRefused as error:
        raise Refused(f"system {path}: {error}") from None


def lacking(path: Path, text: str) -> tuple[str, ...]:
    """Return a line for all that a system lacks of a file.

    Args:
        path: the file, TOML or XML.
        text: the system in the same format.

    Raises:
        Refused: the file cannot be read.
    """
    return tuple(differences(read_system(path), _parse(path, text)))


def _parse(path: Path, text: str) -> System:
    return parse_rts_profile(text) if file_format(path) == "xml" else parse_toml(text)


def write_system(text: str, path: Path) -> None:
    """Write a system file; Refused if that cannot be done."""
    try:
        write_whole(path, text)
    except OSError as error:
        refuse_path("system", error)


def file_format(path: Path) -> str:
    """Return `toml` or `xml`; Refused for another ending."""
    if path.suffix.lower() not in (TOML, XML):
        raise Refused(f"system {path}: the name ends in {TOML} or {XML}")
    return path.suffix.lower().removeprefix(".")


def check_system(path: Path) -> None:
    """See before a run whether a system could be written after it; Refused if not."""
    file_format(path)
    try:
        check_file(path, "system")
    except ValueError as error:
        raise Refused(str(error)) from None
