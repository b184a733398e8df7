"""Commands that were sent and that nobody waits for."""

from __future__ import annotations

from collections import deque
from typing import Final

from tickrig.host.rrc.exchange import NAMELESS

SETTLED_US: Final = 100_000
"""An ER would have come by then: 10 periods of the RRC."""

MOTION: Final = ("output", "limit")


class Outbox:
    """Remembers unconfirmed commands until a reply or time tells their fate.

    Replies come in the order of the commands, so a reply belongs to the oldest
    command of its name. An ER without a name goes to the account of a motion
    command if there is one: the safe side, where it cannot be known.
    """

    def __init__(self) -> None:
        self._sent: deque[tuple[int, str]] = deque()

    def add(self, now_us: int, name: str) -> None:
        """Note a command that was just sent."""
        self._sent.append((now_us, name))

    def claim(self, reason: str) -> str | None:
        """Take out the command that an OK or ER belongs to; return its name."""
        wanted = (*MOTION, None) if reason in NAMELESS else (reason,)
        for name in wanted:
            for entry in self._sent:
                if name in (None, entry[1]):
                    self._sent.remove(entry)
                    return entry[1]
        return None

    def settle(self, now_us: int) -> list[str]:
        """Take out those that no reply came for in time; return their names."""
        settled = []
        while self._sent and self._sent[0][0] + SETTLED_US <= now_us:
            settled.append(self._sent.popleft()[1])
        return settled

    def clear(self) -> None:
        """Forget all: the RRC was restarted."""
        self._sent.clear()
