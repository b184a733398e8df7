r"""One command and what proves that the RRC processed it.

Without stablemode that is `OK:name`. With stablemode there is no OK: a `device`
query goes behind the command, and as the RRC takes one line after the other,
its answer proves that the command was processed; an ER before it is the refusal.

>>> exchange = Exchange(Watchdog(100), stable=True)
>>> exchange.lines
(b'watchdog64B\n', b'device0\n')
>>> exchange.take(Text("RRC")), exchange.done
(True, True)
"""

from __future__ import annotations

from typing import Final

from tickrig.host.rrc.inbox import Answer
from tickrig.wire.rrc.commands import Command, Date, DeviceName, StableMode, Version, Watchdog
from tickrig.wire.rrc.replies import (
    COMMAND_CHECKSUM,
    COMMAND_UNKNOWN,
    RECEIVE_BUFFER_OVERFLOW,
    Ok,
    Refusal,
    Text,
)

NAMELESS: Final = (COMMAND_CHECKSUM, COMMAND_UNKNOWN, RECEIVE_BUFFER_OVERFLOW)
"""Reasons that do not say which command was refused."""

QUERIES: Final = (DeviceName, Version, Date)
"""Commands that are answered with a line of text, in stablemode too."""


class Exchange:
    """A command on its way.

    Args:
        command: what is sent.
        stable: whether stablemode is on when it is sent.

    Attributes:
        lines: the bytes to send, line by line.
        text: the answer to a query, empty for other commands.
        refusal: the RRC's reason, None if it gave none.
        done: whether the last awaited line has come.
    """

    def __init__(self, command: Command, *, stable: bool) -> None:
        self.command, self.name = command, command.name.decode()
        self._stable = stable
        self.lines: tuple[bytes, ...] = (command.encode(check=stable),)
        self.text, self.done = "", False
        self.refusal: str | None = None
        self._last = self.name  # the command whose answer is awaited
        if stable and not isinstance(command, QUERIES):
            still_stable = not isinstance(command, StableMode) or bool(command.on)
            self.lines += (DeviceName().encode(check=still_stable),)
            self._last = DeviceName.name.decode()
        self._wants_text = stable or isinstance(command, QUERIES)

    @property
    def sent(self) -> str:
        """The command's line as text, without LF."""
        return self.lines[0].decode().removesuffix("\n")

    @property
    def awaited(self) -> str:
        """What would have ended the exchange, for people."""
        if self._wants_text:
            return f"the answer of {self._last}"
        return f"OK:{self.name}"

    @property
    def replies(self) -> int:
        """How many lines the RRC sends if it does what was asked."""
        return (not self._stable) + self._wants_text

    @property
    def has_barrier(self) -> bool:
        """Whether the command has no answer of its own."""
        return len(self.lines) > 1

    @property
    def changes_protocol(self) -> bool:
        """Whether nothing else may be sent before this is settled."""
        return isinstance(self.command, StableMode | Watchdog)

    def refuses_barrier_too(self, reason: str) -> bool:
        """Whether this is the refusal of the query behind a command that was refused itself."""
        return self.refusal is not None and self.has_barrier and reason == self._last

    def take(self, answer: Answer) -> bool:
        """Take a line if it belongs here; True if it does."""
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
