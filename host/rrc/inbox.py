r"""Received lines of the RRC, which are split, read, sorted and stored.

The module also contains exchanges. An exchange is one command and the proof that the RRC processed
it.

Without stablemode, the proof is `OK:name`. With stablemode, the RRC sends no OK. Therefore the
client sends a `device` query after the command. The RRC processes one line after the other, so the
answer to the query proves that the command was processed. An ER before this answer is the refusal
of the command.

>>> exchange = Exchange(Watchdog(100), stable=True)
>>> exchange.lines
(b'watchdog64B\n', b'device0\n')
>>> exchange.take(Text("RRC")), exchange.done
(True, True)
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Generic, TypeVar

from tickrig.host.text.log import log_of
from tickrig.wire.errors import WireError
from tickrig.wire.lines import LineSplitter
from tickrig.wire.rrc.commands import Command, Date, DeviceName, StableMode, Version, Watchdog
from tickrig.wire.rrc.replies import (
    COMMAND_CHECKSUM,
    COMMAND_UNKNOWN,
    RECEIVE_BUFFER_OVERFLOW,
    Event,
    Ok,
    Refusal,
    Reply,
    StatusA,
    Text,
    parse_reply,
)

_EVENTS_KEPT: Final = 1_000
_STATUSES_KEPT: Final = 1_000  # 10 s
UNKNOWN_KEPT: Final = 100

_ANSWER: Final = re.compile(r"(?![A-Z]{2}:)[ -~]+")
"""Pattern of a line of text as an answer. A line `XX:...` is a message of newer firmware."""

_T = TypeVar("_T")
Answer = Ok | Refusal | Text
_log = log_of(__name__)


@dataclass(frozen=True, slots=True)
class Arrival(Generic[_T]):
    """A line received from the RRC, with the time at which it arrived.

    Attributes:
        at_us: time of arrival in us, on the link's clock.
        value: content of the line: an `Event`, a `StatusA`, or the text of an unknown line.
    """

    at_us: int
    value: _T


class Inbox:
    """Store of the received events and status lines that the program has not read yet.

    Replies to commands are not stored, but returned to the caller. Some lines are kept in `unknown`
    and passed to `on_unknown`: lines that the manual does not list, and status lines (SA) with a
    wrong checksum (CHECK). They raise no exception, because newer firmware or noise on the line can
    cause them.

    Args:
        on_unknown: function that is called with each unknown line.

    Attributes:
        events: events that were not read yet.
        statuses: status lines that were not read yet.
        latest_status: newest status line, whether it was read or not.
        unknown: latest unknown lines.
    """

    def __init__(self, on_unknown: Callable[[Arrival[str]], None] | None = None) -> None:
        self.events: deque[Arrival[Event]] = deque(maxlen=_EVENTS_KEPT)
        self.statuses: deque[Arrival[StatusA]] = deque(maxlen=_STATUSES_KEPT)
        self.latest_status: Arrival[StatusA] | None = None
        self.unknown: deque[Arrival[str]] = deque(maxlen=UNKNOWN_KEPT)
        self._on_unknown = on_unknown
        self._lines = LineSplitter()

    def push(self, now_us: int, data: bytes) -> list[Reply]:
        """Add received bytes. Return the lines that the manual lists, in order."""
        replies = [self._read(now_us, line) for line in self._lines.push(data)]
        return [reply for reply in replies if reply is not None]

    def report(self, now_us: int, line: str) -> None:
        """Store and report an unknown line."""
        _log.info("unknown line %r", line)
        arrival = Arrival(now_us, line)
        self.unknown.append(arrival)
        if self._on_unknown is not None:
            self._on_unknown(arrival)

    def clear(self) -> None:
        """Discard all received items, and an incomplete line."""
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


NAMELESS: Final = (COMMAND_CHECKSUM, COMMAND_UNKNOWN, RECEIVE_BUFFER_OVERFLOW)
"""Reasons that do not name the refused command."""

_QUERIES: Final = (DeviceName, Version, Date)
"""Commands that are answered with a line of text, also in stablemode."""


class Exchange:
    """A command that was sent to the RRC, together with the replies received for it so far.

    Args:
        command: command that is sent.
        stable: whether stablemode is on when the command is sent.

    Attributes:
        lines: lines to send, as bytes. In stablemode, some commands get no answer, so a query is
            sent after such a command.
        text: answer to a query, empty for other commands.
        refusal: reason of the RRC's refusal, or None without a refusal.
        done: whether the last expected line has arrived.
    """

    def __init__(self, command: Command, *, stable: bool) -> None:
        self.command, self.name = command, command.name.decode()
        self._stable = stable
        self.lines: tuple[bytes, ...] = (command.encode(check=stable),)
        self.text, self.done = "", False
        self.refusal: str | None = None
        self._last = self.name  # the command whose answer is awaited
        if stable and not isinstance(command, _QUERIES):
            still_stable = not isinstance(command, StableMode) or bool(command.on)
            self.lines += (DeviceName().encode(check=still_stable),)
            self._last = DeviceName.name.decode()
        self._wants_text = stable or isinstance(command, _QUERIES)

    @property
    def sent(self) -> str:
        """The line of the command as text, without LF."""
        return self.lines[0].decode().removesuffix("\n")

    @property
    def awaited(self) -> str:
        """The expected end of the exchange, as text for the user."""
        if self._wants_text:
            return f"the answer of {self._last}"
        return f"OK:{self.name}"

    @property
    def replies(self) -> int:
        """Number of lines that the RRC sends on success."""
        return (not self._stable) + self._wants_text

    @property
    def has_barrier(self) -> bool:
        """Whether a query follows the command, because the command itself has no answer."""
        return len(self.lines) > 1

    @property
    def changes_protocol(self) -> bool:
        """Whether other commands must wait until this command is settled."""
        return isinstance(self.command, StableMode | Watchdog)

    def refuses_barrier_too(self, reason: str) -> bool:
        """Whether an ER refuses the query that follows a command which was itself refused."""
        return self.refusal is not None and self.has_barrier and reason == self._last

    def take(self, answer: Answer) -> bool:
        """Process a reply of the RRC.

        Return False if the reply does not belong to this exchange.
        """
        match answer:
            case Refusal(reason):
                return self._take_refusal(reason)
            case Ok(name):
                self.done = self.done or (name == self.name and not self._wants_text)
                return name in (self.name, self._last)
            case Text(text):
                if self._wants_text and not self.done:
                    self.text = "" if self.has_barrier else text
                    self.done = True
                    return True
                return False

    def _take_refusal(self, reason: str) -> bool:
        if reason not in (self.name, self._last, *NAMELESS):
            return False
        self.refusal = self.refusal or reason
        # Behind a refused command the barrier's answer still comes.
        self.done = self.done or not self.has_barrier or reason == self._last
        return True
