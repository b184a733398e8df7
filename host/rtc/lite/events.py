"""What a proxy tells beside its state."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from tickrig.host.rtc.component_action import guarded
from tickrig.host.rtc.lite.ping_monitor import PingStatistics
from tickrig.host.rtc.states import ReturnCode
from tickrig.host.text.log import log_of

_LOG: Final = log_of(__name__)


class ProxyEventType(StrEnum):
    """What happened."""

    PASSIVE_ERROR = "PassiveError"  # the device reported an error, or one reply was lost
    FATAL_ERROR = "FatalError"  # no answer to any PING: power cut, dead link
    REMOVED = "Removed"  # the proxy was taken out of the system
    REDISCOVERED = "Rediscovered"  # the device is back, with a new proxy


@dataclass(frozen=True, slots=True)
class ProxyEvent:
    """Something that happened to a proxy.

    Attributes:
        at_us: when, on the clock of its link.
        kind: what.
        instance_name: to which proxy.
        reason: why it went to Error, for people; empty for other events.
        frames: the last ones before that, with their times on the clock of its link.
        pings: how its PINGs went; None unless it was removed.
    """

    at_us: int
    kind: ProxyEventType
    instance_name: str
    reason: str = ""
    frames: tuple[str, ...] = ()
    pings: PingStatistics | None = None

    def __str__(self) -> str:
        """Write it in a line for people."""
        why = f": {self.reason}" if self.reason else ""
        frames = f"; last frames: {', '.join(self.frames)}" if self.frames else ""
        pings = f"; {self.pings}" if self.pings else ""
        return f"{self.at_us / 1e6:.3f} s: {self.instance_name}: {self.kind}{why}{frames}{pings}"


ProxyListener = Callable[[ProxyEvent], None]
"""Told of events; what it raises is logged, and nothing else comes of it."""


def notify(listener: ProxyListener | None, event: ProxyEvent) -> None:
    """Log an event, and tell whoever listens."""
    _LOG.info("%s", event)

    def listen() -> ReturnCode:
        if listener is not None:
            listener(event)
        return ReturnCode.RTC_OK

    guarded(event.instance_name, listen)
