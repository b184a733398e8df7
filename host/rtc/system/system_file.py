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
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from tickrig.host.cli.messages import Refused, refuse_path
from tickrig.host.rtc.states import RtcRefused
from tickrig.host.rtc.system.manager import RemoteEntry
from tickrig.host.rtc.system.rts_profile import parse_rts_profile
from tickrig.host.rtc.system.system import ComponentEntry, ConnectionEntry, System
from tickrig.host.text.toml_reader import load_toml
from tickrig.host.text.whole_file import check_file, write_whole

_COMPONENT: Final[Mapping[str, type]] = {
    "name": str,
    "type": str,
    "rate_hz": float,
    "context": str,
    "active": bool,
    "configuration_set": str,
    "configuration": dict,
}
_CONNECTION: Final[Mapping[str, type]] = {
    "ports": list,
    "name": str,
    "connector_id": str,
    "properties": dict,
}
_REMOTE: Final[Mapping[str, type]] = {"name": str, "path": str}
_FIELDS: Final[Mapping[str, str]] = {"type": "type_name"}


def parse_toml(text: str) -> System:
    """Read a system file.

    Raises:
        RtcRefused: no TOML, or a key or value that is not in the table above.
    """
    try:
        tables = load_toml(text)
    except tomllib.TOMLDecodeError as error:
        raise RtcRefused(f"not TOML: {error}") from error
    if unknown := set(tables) - {"component", "connection", "remote"}:
        raise RtcRefused(f"{min(unknown)!r} is none of: component, connection, remote")
    components = _read(tables, "component", _COMPONENT, ("name", "type"))
    connections = _read(tables, "connection", _CONNECTION, ("ports",))
    remotes = _read(tables, "remote", _REMOTE, ("name", "path"))
    return System(
        tuple(_component(entry) for entry in components),
        tuple(_connection(entry) for entry in connections),
        tuple(RemoteEntry(**entry) for entry in remotes),
    )


def write_toml(system: System) -> str:
    """Write a system file."""
    return "\n".join(
        (*_component_lines(system), *_connection_lines(system), *_remote_lines(system))
    )


def _read(
    tables: Mapping[str, Any], name: str, kinds: Mapping[str, type], needed: tuple[str, ...]
) -> Iterator[Mapping[str, Any]]:
    """Yield the tables of a name, each checked."""
    entries = tables.get(name, [])
    if not isinstance(entries, list):
        raise RtcRefused(f"{name} is written [[{name}]]")
    for number, entry in enumerate(entries, 1):
        place = f"[[{name}]] {number}"
        for key in needed:
            if key not in entry:
                raise RtcRefused(f"{place} has no {key}")
        yield {key: _value(f"{place}: {key}", kinds, key, value) for key, value in entry.items()}


def _value(place: str, kinds: Mapping[str, type], key: str, value: object) -> object:
    if key not in kinds:
        raise RtcRefused(f"{place} is none of: {', '.join(kinds)}")
    if kinds[key] is float and type(value) is int:
        return float(value)
    if type(value) is not kinds[key]:
        raise RtcRefused(f"{place} takes {kinds[key].__name__}, not {value!r}")
    return value


def _component(entry: Mapping[str, Any]) -> ComponentEntry:
    sets = entry.get("configuration", {})
    for set_id, values in sets.items():
        _check_texts(f"{entry['name']}: configuration.{set_id}", values)
    return ComponentEntry(**{_FIELDS.get(key, key): value for key, value in entry.items()})


def _connection(entry: Mapping[str, Any]) -> ConnectionEntry:
    ports = entry["ports"]
    if len(ports) != 2 or not all(isinstance(port, str) for port in ports):
        raise RtcRefused(f'[[connection]]: ports {ports} is not like ["A0.out", "B0.in"]')
    _check_texts("[[connection]]: properties", entry.get("properties", {}))
    return ConnectionEntry((ports[0], ports[1]), **{k: v for k, v in entry.items() if k != "ports"})


def _check_texts(place: str, values: object) -> None:
    if not isinstance(values, dict) or not all(isinstance(text, str) for text in values.values()):
        raise RtcRefused(f'{place} takes lines like name = "value", not {values!r}')


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
    for name, text in values.items():
        yield f"{_quoted(name)} = {_quoted(text)}"
    yield ""


def _quoted(text: str) -> str:
    """Quote a text: TOML's rules are JSON's, but for DEL."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


TOML: Final = ".toml"
XML: Final = ".xml"


def read_system(path: Path) -> System:
    """Read a system file; Refused if that cannot be done."""
    parse = parse_rts_profile if file_format(path) == "xml" else parse_toml
    try:
        return parse(path.read_text("utf-8"))
    except UnicodeDecodeError as error:
        raise Refused(f"system {path}: byte {error.start} is not UTF-8") from None
    except OSError as error:
        refuse_path("system", error)
    except RtcRefused as error:
        raise Refused(f"system {path}: {error}") from None


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
