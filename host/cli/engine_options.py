"""Options that connect a system with other middleware, which are the same for all commands."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import click

from tickrig.host.cli.messages import Refused, refused_at
from tickrig.host.cli.options import PATH, Decorator, add_options

# OpenRTM options of a command line: addresses and names of components.

FORMAT: Final = "%h.host_cxt/%n.rtc"
"""Default of OpenRTM's `naming.formats`."""

_LETTERS: Final = "ntmvVchMp"
"""Letters of a format: instance name, type (twice), version, vendor, category, host, manager,
process."""

_PORT: Final = 2809


@dataclass(frozen=True, slots=True)
class Endpoint:
    """TCP address of an OpenRTM name server, or of this process for incoming connections.

    OpenRTM communicates by CORBA, which has no access control. Anyone who can connect to the
    address can do everything that rtshell, a tool of OpenRTM, can do.

    Attributes:
        host: IP address or host name.
        port: TCP port. 0 selects a free port.
    """

    host: str = "127.0.0.1"
    port: int = 0

    def __str__(self) -> str:
        """Return the endpoint in the usual notation."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{host}:{self.port}" if self.port else host

    @property
    def uri(self) -> str:
        """The endpoint in omniORB's notation."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"giop:tcp:{host}:{self.port or ''}"


@dataclass(frozen=True, slots=True)
class OpenRtmOptions:
    """Settings with which a process takes part in an OpenRTM system.

    Attributes:
        name_server: address of the name server.
        endpoint: address at which this process accepts connections of other components.
        names: format of the names under which components are registered in the name server.
    """

    name_server: Endpoint
    endpoint: Endpoint = field(default_factory=Endpoint)
    names: str = FORMAT


def format_name(pattern: str, values: Mapping[str, str]) -> str:
    """Return the path of a component in the name server, from a format of `naming.formats`.

    Args:
        pattern: format of OpenRTM such as `%h.host_cxt/%n.rtc`. `%%` is a percent sign.
        values: text for each letter. The text for `n` replaces `%n`.

    >>> format_name("%h.host_cxt/%n.rtc", {"h": "robot", "n": "ConsoleIn0"})
    'robot.host_cxt/ConsoleIn0.rtc'

    Raises:
        KeyError: a letter has no value.
    """
    filled = {letter: value.replace("/", "_") for letter, value in values.items()} | {"%": "%"}
    return re.sub(r"%(.?)", lambda match: filled[match[1]], pattern)


def parse_endpoint(text: str, port: int = _PORT) -> Endpoint:
    """Read `HOST:PORT`, `HOST` or `[ADDRESS]:PORT`. Without a port, use the default port.

    >>> parse_endpoint("robot"), parse_endpoint("[::1]:2810")
    (Endpoint(host='robot', port=2809), Endpoint(host='::1', port=2810))

    Raises:
        ValueError: the text has another form.
    """
    match = re.fullmatch(r"(?:\[([0-9a-fA-F:.]+)\]|([\w.-]+))(?::(\d{1,5}))?", text, re.ASCII)
    if match is None or int(match[3] or 1) not in range(1, 65_536):
        raise ValueError(f"{text!r} is not HOST:PORT with a port 1..65535")
    return Endpoint(match[1] or match[2], int(match[3] or port))


def _take_endpoint(option: str, text: str, port: int = _PORT) -> Endpoint:
    with refused_at(option):
        return parse_endpoint(text, port)


def _take_format(option: str, pattern: str) -> str:
    """Accept a format that gives each component a different path."""
    try:
        parts = format_name(pattern, dict.fromkeys(_LETTERS, "x")).split("/")
    except KeyError as error:
        known = " ".join(f"%{letter}" for letter in _LETTERS)
        raise Refused(f"{option}: %{error.args[0]} is not one of {known}") from None
    if "%n" not in pattern or not all(parts):
        raise Refused(f"{option}: {pattern!r} is not like {FORMAT}, with %n")
    return pattern


openrtm_options: Final[Decorator] = add_options(
    click.option(
        "--openrtm",
        metavar="HOST[:PORT]",
        help="Register the components as OpenRTM components at this name server (extra"
        " tickrig[openrtm]).",
    ),
    click.option(
        "--openrtm-address",
        metavar="HOST[:PORT]",
        help="Listen for peers at this address. [127.0.0.1] CORBA has no access control.",
    ),
    click.option(
        "--openrtm-names",
        metavar="FORMAT",
        help="Format of names, as in naming.formats. [%h.host_cxt/%n.rtc]",
    ),
)

ros2_options: Final[Decorator] = add_options(
    click.option(
        "--ros2", is_flag=True, help="Connect ports to ROS 2 topics (extra tickrig[ros2])."
    ),
    click.option(
        "--ros2-table",
        type=PATH,
        metavar="FILE",
        help="Read ports, topics and types from a TOML file.",
    ),
    click.option(
        "--ros2-domain",
        type=click.IntRange(0, 232),
        metavar="ID",
        help="DDS domain; by default ROS_DOMAIN_ID, else 0.",
    ),
    click.option(
        "--ros2-interface",
        metavar="NAME",
        help="Network interface. [loopback] DDS has no access control here.",
    ),
)


@dataclass(frozen=True, slots=True)
class EngineOptions:
    """Other middleware to which the user connects a system on the command line.

    Attributes:
        openrtm: settings of OpenRTM, or None if it is not requested.
        ros2: settings of ROS 2, or None if it is not requested.
    """

    openrtm: OpenRtmOptions | None = None
    ros2: Ros2Options | None = None

    def __bool__(self) -> bool:
        """Return whether any engine is requested."""
        return self.openrtm is not None or self.ros2 is not None


def take_engines(options: dict[str, Any], topics: str = "") -> EngineOptions:
    """Return the settings of OpenRTM and ROS 2 that the options of a command contain.

    Args:
        options: options of the command line by name. The options of OpenRTM and ROS 2 are removed.
        topics: text of the default table. A table assigns ROS 2 topics to ports. If the user names
            no table, the default table applies. If the default is empty, each port has a topic.

    Raises:
        Refused: an option is invalid, or it belongs to OpenRTM or ROS 2 but the user did not
            request this middleware.
    """
    return EngineOptions(_take_openrtm(options), _take_ros2(options, topics))


def _take_openrtm(options: dict[str, Any]) -> OpenRtmOptions | None:
    server = options.pop("openrtm")
    given = {name: options.pop(f"openrtm_{name}") or None for name in ("address", "names")}
    if server is None:
        _refuse_without("openrtm", given)
        return None
    address, names = given.values()
    return OpenRtmOptions(
        _take_endpoint("--openrtm", server),
        _take_endpoint("--openrtm-address", address, 0) if address else Endpoint(),
        _take_format("--openrtm-names", names) if names else FORMAT,
    )


def _take_ros2(options: dict[str, Any], topics: str) -> Ros2Options | None:
    wanted = options.pop("ros2", False)
    given = {name: options.pop(f"ros2_{name}", None) for name in ("domain", "interface", "table")}
    if not wanted:
        _refuse_without("ros2", given)
        return None
    domain, interface, table = given.values()
    domain = _usual_domain() if domain is None else domain
    return Ros2Options(domain, interface or "", table, topics)


def _refuse_without(engine: str, given: Mapping[str, object]) -> None:
    """Refuse options of an engine that is not requested."""
    for name, word in given.items():
        if word is not None:
            raise Refused(f"--{engine}-{name} is for --{engine}")


# ROS 2 options of a command line.


_DOMAIN_VARIABLE: Final = "ROS_DOMAIN_ID"
_LAST_DOMAIN: Final = 232
"""Highest domain number that has ports (DDSI-RTPS, 9.6.2)."""


@dataclass(frozen=True, slots=True)
class Ros2Options:
    """Settings with which a system takes part in ROS 2.

    Attributes:
        domain: DDS domain, 0..232.
        interface: network interface of this machine, such as eth0. If it is empty, the loopback
            interface is used.
        table: file with the table of ports and topics, or None for the default table of the
            command.
        topics: text of the command's default table. If it is empty, each port has a topic.
    """

    domain: int = 0
    interface: str = ""
    table: Path | None = None
    topics: str = ""


def _usual_domain() -> int:
    """Return ROS_DOMAIN_ID, or 0."""
    text = os.environ.get(_DOMAIN_VARIABLE, "") or "0"
    if not re.fullmatch(r"\d{1,3}", text, re.ASCII) or int(text) > _LAST_DOMAIN:
        raise Refused(f"{_DOMAIN_VARIABLE} {text!r} is no domain 0..{_LAST_DOMAIN}")
    return int(text)
