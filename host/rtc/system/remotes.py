"""What a system has to do with components that run elsewhere: an engine looks after it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


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
    """A connector of a port of ours with one of a component that runs elsewhere.

    Attributes:
        port: full name of ours.
        remote: the component that runs elsewhere.
        remote_port: its port, without the name of the component.
        ports: both full names, in the order in which they were given.
        name: for people.
        properties: what is to hold for it.
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
