"""System files on disk in TOML, or in RTSProfile if the name ends in .xml.

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

from tickrig.host.cli.messages import Refused, refuse_path
from tickrig.host.rtc.states import RtcRefused
from tickrig.host.rtc.system.manager import RemoteEntry
from tickrig.host.rtc.system.rts_profile import parse_rts_profile
from tickrig.host.rtc.system.system import ComponentEntry, ConnectionEntry, System, differences
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
    """Read the description of a system from the text of a system file in TOML.

    Raises:
        RtcRefused: the text is not TOML, or it has an unknown key or an invalid value.
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
    """Return a system as a TOML file."""
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
    """Quote a text. TOML has the rules of JSON, except for DEL."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


_TOML: Final = ".toml"
_XML: Final = ".xml"


def read_system(path: Path) -> System:
    """Read a system file. Raise Refused if that fails."""
    try:
        return _parse(path, path.read_text("utf-8"))
    except UnicodeDecodeError as error:
        raise Refused(f"system {path}: byte {error.start} is not UTF-8") from None
    except OSError as error:
        refuse_path("system", error)
    except RtcRefused as error:
        raise Refused(f"system {path}: {error}") from None


def lacking(path: Path, text: str) -> tuple[str, ...]:
    """Compare a running system with a system file, and return what the running system lacks.

    Args:
        path: path of the system file in TOML or XML.
        text: text that describes the running system, in the same format.

    Returns:
        A line for each part of the file that is missing or different.

    Raises:
        Refused: the file cannot be read.
    """
    return tuple(differences(read_system(path), _parse(path, text)))


def _parse(path: Path, text: str) -> System:
    return parse_rts_profile(text) if file_format(path) == "xml" else parse_toml(text)


def write_system(text: str, path: Path) -> None:
    """Write a system file. Raise Refused if that fails."""
    try:
        write_whole(path, text)
    except OSError as error:
        refuse_path("system", error)


def file_format(path: Path) -> str:
    """Return `toml` or `xml`. Raise Refused for another suffix."""
    if path.suffix.lower() not in (_TOML, _XML):
        raise Refused(f"system {path}: the name ends in {_TOML} or {_XML}")
    return path.suffix.lower().removeprefix(".")


def check_system(path: Path) -> None:
    """Check before a run that the system file can be written after the run.

    Raises:
        Refused: the file cannot be written, or the suffix of its name is not a known one.
    """
    file_format(path)
    try:
        check_file(path, "system")
    except ValueError as error:
        raise Refused(str(error)) from None
