"""When to send a PING, and when a device is lost (DECISION L14)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from tickrig.wire.instant import NEVER

SEQUENCE: Final = range(1, 256)
"""Numbers of PINGs; 0 is skipped."""


@dataclass(slots=True)
class PingMonitor:
    """Counts PINGs. It sends nothing, and is told the time.

    Args:
        period_us: from the last correct frame to a PING.
        wait_us: how long an answer may take.
        most: so many unanswered ones in a row, and the device is lost.
        received_us: when the last correct frame came.

    Attributes:
        awaiting: a PING waits for its answer.
        doubted: a reply is missing, and no PING was answered since.
        lost: the device does not answer any more; it stays so.
    """

    period_us: int
    wait_us: int
    most: int
    received_us: int
    awaiting: bool = field(default=False, init=False)
    doubted: bool = field(default=False, init=False)
    lost: bool = field(default=False, init=False)
    _number: int = field(default=0, init=False)
    _unanswered: int = field(default=0, init=False)
    _pinged_us: int = field(default=0, init=False)

    @property
    def due_us(self) -> int:
        """When `tick` has something to do; `NEVER` for a device that is lost."""
        if self.lost:
            return NEVER
        return (
            self._pinged_us + self.wait_us if self.awaiting else self.received_us + self.period_us
        )

    @property
    def pending(self) -> bool:
        """Whether an answer is out to a PING that was sent as a matter of routine."""
        return self.awaiting and not self.doubted

    def tick(self, now_us: int) -> int | None:
        """Return the number of a PING that is to be sent now, if one is."""
        if now_us < self.due_us:
            return None
        self.doubted = self.doubted or self.awaiting
        self.lost = self._unanswered == self.most
        return None if self.lost else self.ping(now_us)

    def doubt(self, now_us: int) -> int:
        """Begin a burst, as a reply is missing; return the number of its first PING."""
        self.doubted, self._unanswered = True, 0
        return self.ping(now_us)

    def ping(self, now_us: int) -> int:
        """Count a PING that is sent now, and return its number."""
        self._number = self._number % SEQUENCE[-1] + 1
        self._unanswered += 1
        self.awaiting, self._pinged_us = True, now_us
        return self._number

    def let_go(self) -> None:
        """Wait no more for a routine PING: a request follows, whose reply tells as much."""
        if self.pending:
            self.awaiting, self._unanswered = False, 0

    def answered(self, number: int) -> None:
        """Take an answer; that to an older PING is ignored."""
        if self.awaiting and number == self._number:
            self.awaiting = self.doubted = False
            self._unanswered = 0
