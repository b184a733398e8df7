"""Commands that were sent and that nobody waits for."""

from __future__ import annotations

from collections import deque
from typing import Final, NamedTuple

from tickrig.host.rrc.exchange import NAMELESS
from tickrig.wire.rrc.commands import Command

SETTLED_US: Final = 100_000
"""An ER would have come by then: 10 periods of the RRC."""

MOTION: Final = ("output", "limit")


class _Entry(NamedTuple):
    sent_us: int
    command: Command

    @property
    def name(self) -> str:
        return self.command.name.decode()


class Outbox:
    """Remembers unconfirmed commands until a reply or time tells their fate.

    Replies come in the order of the commands, so a reply belongs to the oldest
    command of its name. An ER without a name goes to the account of a motion
    command if there is one: the safe side, where it cannot be known.
    """

    def __init__(self) -> None:
        self._sent: deque[_Entry] = deque()
        self._doubted_us = -1  # what was sent up to then may be carried out, or lost

    @property
    def doubt_ends_us(self) -> int:
        """When the fate of all that was sent before a restart will be known; 0 if it is."""
        in_doubt = self._sent and self._sent[0].sent_us <= self._doubted_us
        return self._doubted_us + SETTLED_US if in_doubt else 0

    def doubt(self) -> None:
        """Note that the RRC was initialized: what waits in its buffer is still to come."""
        if self._sent:
            self._doubted_us = self._sent[-1].sent_us

    def add(self, now_us: int, command: Command) -> None:
        """Note a command that was just sent."""
        self._sent.append(_Entry(now_us, command))

    def carried_out(self, name: str) -> Command | None:
        """Take out the command that an OK belongs to; return the newest of its name.

        That one counts: it was carried out or will be, if the older ones were not lost with
        the RRC's power, and this OK is its own.
        """
        same = [entry for entry in self._sent if entry.name == name]
        if not same:
            return None
        self._sent.remove(same[0])
        return same[-1].command

    def refused(self, reason: str) -> str | None:
        """Take out the command that an ER belongs to, and return its name."""
        wanted = (*MOTION, None) if reason in NAMELESS else (reason,)
        for name in wanted:
            for entry in self._sent:
                if name in (None, entry.name):
                    self._sent.remove(entry)
                    return entry.name
        return None

    def settle(self, now_us: int) -> list[str]:
        """Take out those that no reply came for in time; return their names."""
        settled = []
        while self._sent and self._sent[0].sent_us + SETTLED_US <= now_us:
            settled.append(self._sent.popleft().name)
        return settled

    def clear(self) -> None:
        """Forget all."""
        self._sent.clear()
