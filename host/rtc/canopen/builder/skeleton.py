"""The skeleton of a DeviceRTC in Python, with its ports and with empty callbacks."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

from tickrig.host.rtc.canopen.builder.profile_file import Project, python_name, snake_name
from tickrig.wire import rtc_canopen

SKELETON_SUFFIX: Final = ".py"

CALLBACKS: Final = (
    ("on_initialize", "Result", "Begin; after an error the node stays silent."),
    ("on_activated", "Result", "Become Active; an error leads to Error."),
    ("on_execute", "Result", "Work, once a period while Active; an error leads to Error."),
    ("on_deactivated", "Result", "Leave Active; an error leads to Error."),
    ("error_check", "Result", "Look after the device, once a period while Inactive."),
    ("on_aborting", "None", "Come from Active to Error."),
    ("on_error", "None", "Work, once a period while in Error."),
    ("on_reset", "Result", "Leave Error; after an error it stays there."),
    ("on_finalize", "Result", "End, before Reset Node or when the device is shut down."),
)

_LONGEST: Final = 88
"""Maximum number of characters of a line, as formatters use it."""


def write_skeleton(project: Project) -> str:
    """Return the text of a Python file with the skeleton of a DeviceRTC's component."""
    return "\n".join([*_head(project), *_attributes(project), *_callbacks(), ""])


def _head(project: Project) -> Iterator[str]:
    profile = project.profile
    file = f"{snake_name(profile.type_name)}.py"
    yield f'"""{profile.type_name}, a DeviceRTC.'
    yield ""
    yield f"Run it: canopen-slave-emu --rtc {file}:{profile.type_name} --node-id {project.node_id}"
    yield '"""'
    yield ""
    yield "from __future__ import annotations"
    yield ""
    yield from _imports(profile)
    yield ""
    yield ""
    yield f"class {profile.type_name}(CanopenComponent):"
    yield '    """Returns ERROR from what failed; all else went well."""'
    yield ""


def _imports(profile: rtc_canopen.RtcProfile) -> Iterator[str]:
    ports = sorted({_port_class(port) for port in profile.ports})
    told = any(port.transport for port in profile.ports)
    types = sorted({_constant(port.port_type) for port in profile.ports})
    yield _import("tickrig.device.canopen.device_rtc", "CanopenComponent", *ports)
    yield "from tickrig.device.component import Result"
    names = [*types, "PortTransport"] if told else types
    if names:
        yield _import("tickrig.wire.rtc_canopen", *names)


def _import(module: str, *names: str) -> str:
    line = f"from {module} import {', '.join(names)}"
    if len(line) <= _LONGEST:
        return line
    return "\n".join([f"from {module} import (", *(f"    {name}," for name in names), ")"])


def _attributes(project: Project) -> Iterator[str]:
    profile = project.profile
    for name in ("type_name", "version", "vendor", "category"):
        yield f"    {name} = {_quoted(getattr(profile, name))}"
    yield f"    rate_hz = {profile.rate_hz}"
    yield f"    product_code = 0x{profile.code:08X}"
    if project.strict_cia301:
        yield "    strict_cia301 = True"
    for port in profile.ports:
        words = [_quoted(port.name), _type(port.port_type)]
        if port.cob_id is not None:
            words.append(f"cob_id=0x{port.cob_id:03X}")
        if port.transport is not None:
            words.append(f"transport=PortTransport.{port.transport.name}")
        made = f"{_port_class(port)}({', '.join(words)})"
        yield f"    {python_name(port.name)} = {made}"


def _callbacks() -> Iterator[str]:
    for name, result, text in CALLBACKS:
        yield ""
        yield f"    def {name}(self) -> {result}:"
        yield f'        """{text}"""'


def _port_class(port: rtc_canopen.CanopenPortProfile) -> str:
    return "CanopenInPort" if port.direction is rtc_canopen.PortDirection.IN else "CanopenOutPort"


def _constant(kind: rtc_canopen.CanopenPortType[Any]) -> str:
    return "integer" if kind.name == rtc_canopen.INTEGER else snake_name(kind.name).upper()


def _type(kind: rtc_canopen.CanopenPortType[Any]) -> str:
    element = _constant(kind)
    if kind.name == rtc_canopen.INTEGER:
        element = f"integer({kind.data_type.bits})"
    return element if kind.length == 1 else f"{element}.sequence({kind.length})"


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
