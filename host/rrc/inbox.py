"""What came from the RRC: cut into lines, read, sorted and kept."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Generic, TypeVar

from tickrig.host.text.log import log_of
from tickrig.wire.errors import WireError
from tickrig.wire.rrc.replies import Event, Ok, Refusal, Reply, StatusA, Text, parse_reply
from tickrig.wire.serial.lines import LineSplitter

EVENTS_KEPT: Final = 1_000
STATUSES_KEPT: Final = 1_000  # 10 s
UNKNOWN_KEPT: Final = 100

_ANSWER: Final = re.compile(r"(?![A-Z]{2}:)[ -~]+")
"""A bare line of text; `XX:...` is a newer firmware's message and answers nothing."""

T = TypeVar("T")
Answer = Ok | Refusal | Text
_log = log_of(__name__)


@dataclass(frozen=True, slots=True)
class Arrival(Generic[T]):
    """Something received, and when.

    Attributes:
        at_us: time on the link's clock.
        value: an `Event`, a `StatusA`, or the text of an unknown line.
    """

    at_us: int
    value: T


class Inbox:
    """Reads lines, keeps events and status, and hands on what somebody waits for.

    Lines that the manual does not list, and SA lines that do not match their
    CHECK, are kept in `unknown` and reported, never an error: newer firmware
    sends some, and so does a noisy line.

    Args:
        on_unknown: called with each of them.

    Attributes:
        events: events that nobody has taken yet.
        statuses: status lines that nobody has taken yet.
        latest_status: the newest one, taken or not.
        unknown: the latest unknown lines.
    """

    def __init__(self, on_unknown: Callable[[Arrival[str]], None] | None = None) -> None:
        self.events: deque[Arrival[Event]] = deque(maxlen=EVENTS_KEPT)
        self.statuses: deque[Arrival[StatusA]] = deque(maxlen=STATUSES_KEPT)
        self.latest_status: Arrival[StatusA] | None = None
        self.unknown: deque[Arrival[str]] = deque(maxlen=UNKNOWN_KEPT)
        self._on_unknown = on_unknown
        self._lines = LineSplitter()

    def push(self, now_us: int, data: bytes) -> list[Reply]:
        """Take bytes in; return what the manual lists, in order."""
        replies = [self._read(now_us, line) for line in self._lines.push(data)]
        return [reply for reply in replies if reply is not None]

    def report(self, now_us: int, line: str) -> None:
        """Keep a line that means nothing here, and tell whoever wants to know."""
        _log.info("unknown line %r", line)
        arrival = Arrival(now_us, line)
        self.unknown.append(arrival)
        if self._on_unknown is not None:
            self._on_unknown(arrival)

    def clear(self) -> None:
        """Forget all that was received, and a line that has only begun."""
        self._lines.clear()
        self.events.clear()
        self.statuses.clear()
        self.unknown.clear()
        self.latest_status = None

    def _read(self, now_us: int, line: bytes) -> Reply | None:
        _log.debug("received %r", line)
        try:
            reply = parse_reply(line)
        except WireError as error:
            _log.warning("%s", error)
            self.report(now_us, line.decode("latin-1"))
            return None
        match reply:
            case StatusA():
                self.latest_status = Arrival(now_us, reply)
                self.statuses.append(self.latest_status)
            case Event(name):
                self.events.append(Arrival(now_us, reply))
                if reply.kind is None:
                    self.report(now_us, f"EV:{name}")
            case Text(text) if not _ANSWER.fullmatch(text):
                self.report(now_us, text)
                return None
        return reply
