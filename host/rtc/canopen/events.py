"""The events of the nodes of a server, by name."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Protocol

from tickrig.host.text.page_text import json_text

KEPT: Final = 10_000
"""Number of events that a log keeps. Older events are dropped."""


class ServerEventType(StrEnum):
    """The name of an event of the server."""

    BOOT_UP = "BootUp"
    PROXY_MADE = "ProxyMade"
    PROXY_REMOVED = "ProxyRemoved"
    PROXY_REFUSED = "ProxyRefused"
    STATE_CHANGED = "StateChanged"
    HEARTBEAT_LOST = "HeartbeatLost"
    SERVER_LATE = "ServerLate"
    RESTARTED = "Restarted"
    NOT_RESTARTED = "NotRestarted"
    FOREIGN_TRANSITION = "ForeignTransition"
    FOREIGN_COMMAND = "ForeignCommand"
    FOREIGN_MASTER = "ForeignMaster"
    WRONG_IDENTITY = "WrongIdentity"
    DUPLICATE_NODE = "DuplicateNode"
    DUPLICATE_SUSPECTED = "DuplicateSuspected"
    SDO_ABORTED = "SdoAborted"
    SDO_TIMEOUT = "SdoTimeout"
    NOT_CONFIRMED = "NotConfirmed"
    EMERGENCY = "Emergency"
    BUS_OFF = "BusOff"
    BUS_ON = "BusOn"
    PDO_LINKED = "PdoLinked"
    PDO_UNLINKED = "PdoUnlinked"
    LINK_REFUSED = "LinkRefused"
    CONNECTED = "Connected"
    CONNECTION_REFUSED = "ConnectionRefused"
    PORT_REFUSED = "PortRefused"
    VALUE_REFUSED = "ValueRefused"
    PDO_TOO_SHORT = "PdoTooShort"


@dataclass(frozen=True, slots=True)
class ServerEvent:
    """Event of a CANopen server, such as a lost node, which is logged and shown to the user.

    Attributes:
        at_us: time of the event in us, on the clock of the server.
        kind: kind of the event.
        node: node-ID, or 0 if the event belongs to no node.
        text: additional text for the user.
    """

    at_us: int
    kind: ServerEventType
    node: int = 0
    text: str = ""

    def __str__(self) -> str:
        """Return the event as text for the user."""
        node = f" node {self.node}" if self.node else ""
        more = f": {self.text}" if self.text else ""
        return f"{self.at_us / 1e6:.6f} {self.kind}{node}{more}"

    def to_json(self) -> str:
        """Return the event as one line of JSON."""
        return json_text(
            {"at_us": self.at_us, "event": self.kind, "node": self.node, "text": self.text}
        )


EventListener = Callable[[ServerEvent], None]


class Notify(Protocol):
    """A function that records an event at the present time."""

    def __call__(self, kind: ServerEventType, node: int, text: str = "", /) -> None:
        """Take an event. Node 0 stands for no node."""


class EventLog:
    """Latest events of a CANopen server, oldest first. It calls listeners with new events.

    Attributes:
        listeners: functions that are called with each event as it happens.
    """

    def __init__(self) -> None:
        self._events: deque[ServerEvent] = deque(maxlen=KEPT)
        self.listeners: list[EventListener] = []

    @property
    def events(self) -> tuple[ServerEvent, ...]:
        """The events that are kept."""
        return tuple(self._events)

    def notify(self, at_us: int, kind: ServerEventType, node: int = 0, text: str = "") -> None:
        """Add an event."""
        event = ServerEvent(at_us, kind, node, text)
        self._events.append(event)
        for listener in self.listeners:
            listener(event)
