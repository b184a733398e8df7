"""The events and statistics of a proxy besides its state."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Final

from tickrig.host.rtc.listeners import call_listeners
from tickrig.host.text.log import log_of
from tickrig.wire.instant import NEVER

# Schedule of PINGs, loss of a device (DECISION L14), and statistics of PINGs.

_SEQUENCE: Final = range(1, 256)
"""Numbers of PINGs, in which 0 is skipped."""


@dataclass(frozen=True, slots=True)
class PingStatistics:
    """Statistics of the PINGs with which a proxy checks that its device is present.

    Attributes:
        sent: number of PINGs sent.
        answered: number of PINGs that were answered in time.
        lost: number of PINGs that were not answered in time. PINGs that are neither answered nor
            lost still wait for their answer.
        shortest_us: shortest round trip in us, or 0 without a round trip.
        longest_us: longest round trip in us, or 0 without a round trip.
        total_us: sum of all round trips in us.
    """

    sent: int = 0
    answered: int = 0
    lost: int = 0
    shortest_us: int = 0
    longest_us: int = 0
    total_us: int = 0

    @property
    def mean_us(self) -> int:
        """Mean round trip, or 0 without a round trip."""
        return self.total_us // self.answered if self.answered else 0

    def with_answer(self, round_trip_us: int) -> PingStatistics:
        """Return the statistics with one more answer."""
        return replace(
            self,
            answered=self.answered + 1,
            shortest_us=min(self.shortest_us if self.answered else NEVER, round_trip_us),
            longest_us=max(self.longest_us, round_trip_us),
            total_us=self.total_us + round_trip_us,
        )

    def __str__(self) -> str:
        """Return the statistics as text for the user.

        >>> str(PingStatistics(5, 4, 1, 3_900, 5_000, 17_000))
        'PINGs: 5 sent, 4 answered, 1 lost; round trip 3.9/4.2/5.0 ms (min/mean/max)'
        """
        counts = f"PINGs: {self.sent} sent, {self.answered} answered, {self.lost} lost"
        if not self.answered:
            return counts
        times = (self.shortest_us, self.mean_us, self.longest_us)
        trips = "/".join(f"{time_us / 1_000:.1f}" for time_us in times)
        return f"{counts}; round trip {trips} ms (min/mean/max)"


@dataclass(slots=True)
class PingMonitor:
    """A monitor that schedules and counts PINGs. It sends nothing, and has no clock.

    From `start` on, a PING is due each `period_us`, regardless of other traffic. Neither a PING
    delayed by a busy line nor a burst shifts the next PING. PINGs that fall due during a burst are
    part of the burst.

    Args:
        period_us: time from one PING to the next.
        wait_us: longest time until an answer.
        most: number of successive unanswered PINGs after which the device is lost.

    Attributes:
        awaiting: whether a PING waits for its answer.
        doubted: whether a reply is missing, and no PING has been answered since that reply was due.
        lost: whether the device no longer answers, which is final.
        statistics: statistics of the PINGs up to now.
    """

    period_us: int
    wait_us: int
    most: int
    awaiting: bool = field(default=False, init=False)
    doubted: bool = field(default=False, init=False)
    lost: bool = field(default=False, init=False)
    statistics: PingStatistics = field(default=PingStatistics(), init=False)
    _next_us: int = field(default=NEVER, init=False)
    _number: int = field(default=0, init=False)
    _unanswered: int = field(default=0, init=False)
    _pinged_us: int = field(default=0, init=False)

    @property
    def due_us(self) -> int:
        """Time in us at which `tick` has work to do, or `NEVER` if the device is lost."""
        if self.lost:
            return NEVER
        return self._pinged_us + self.wait_us if self.awaiting else self._next_us

    @property
    def pending(self) -> bool:
        """Whether a routine PING waits for its answer."""
        return self.awaiting and not self.doubted

    def start(self, now_us: int) -> None:
        """Schedule the first PING a period from now."""
        self._next_us = now_us + self.period_us

    def tick(self, now_us: int) -> int | None:
        """Return the number of a PING to send now, or nothing."""
        if now_us < self.due_us:
            return None
        if self.awaiting:
            self.doubted, self.awaiting = True, False
            self._count_missed()
        self.lost = self._unanswered >= self.most
        return None if self.lost else self._ping(now_us)

    def doubt(self, now_us: int) -> int:
        """Begin a burst of PINGs because a reply is missing.

        Return the number of the first PING to send.
        """
        self.doubted = True
        return self._ping(now_us)

    def let_go(self) -> None:
        """Stop waiting for the answer to a routine PING, so that a request can be sent.

        The reply to the request will also show that the device is present.
        """
        if self.pending:
            self.awaiting = False
            self._count_missed()

    def replied(self) -> None:
        """Record that the device has replied to a request, so that it is present."""
        if not self.awaiting:
            self._unanswered = 0

    def answered(self, number: int, now_us: int) -> None:
        """Process an answer. An answer to an older PING is ignored."""
        if self.awaiting and number == self._number:
            self.statistics = self.statistics.with_answer(now_us - self._pinged_us)
            if self.doubted:
                self._advance(now_us)
            self.awaiting = self.doubted = False
            self._unanswered = 0

    def _ping(self, now_us: int) -> int:
        """Count a PING that is sent now. Return its number."""
        self._advance(now_us)
        self._number = self._number % _SEQUENCE[-1] + 1
        self._unanswered += 1
        self.statistics = replace(self.statistics, sent=self.statistics.sent + 1)
        self.awaiting, self._pinged_us = True, now_us
        return self._number

    def _count_missed(self) -> None:
        self.statistics = replace(self.statistics, lost=self.statistics.lost + 1)

    def _advance(self, now_us: int) -> None:
        """Skip the PINGs that have fallen due."""
        if self._next_us <= now_us:
            self._next_us += (now_us - self._next_us) // self.period_us * self.period_us
            self._next_us += self.period_us


_LOG: Final = log_of(__name__)


class ProxyEventType(StrEnum):
    """Type of an event of a proxy."""

    PASSIVE_ERROR = "PassiveError"  # the device reported an error, or one reply was lost
    FATAL_ERROR = "FatalError"  # no answer to any PING: power cut, dead link
    REMOVED = "Removed"  # the proxy was taken out of the system
    REDISCOVERED = "Rediscovered"  # the device is back, with a new proxy


@dataclass(frozen=True, slots=True)
class ProxyEvent:
    """A notable event of a proxy and its device, such as the loss of the device.

    Attributes:
        at_us: time of the event in us, on the clock of the proxy's link.
        kind: kind of the event.
        instance_name: name of the proxy.
        reason: reason for the move to Error as text, empty for other events.
        frames: last frames before the event, with their times on the clock of the link.
        pings: statistics of the proxy's PINGs if the proxy was removed, otherwise None.
    """

    at_us: int
    kind: ProxyEventType
    instance_name: str
    reason: str = ""
    frames: tuple[str, ...] = ()
    pings: PingStatistics | None = None

    def __str__(self) -> str:
        """Return the event as one line for the user."""
        why = f": {self.reason}" if self.reason else ""
        frames = f"; last frames: {', '.join(self.frames)}" if self.frames else ""
        pings = f"; {self.pings}" if self.pings else ""
        return f"{self.at_us / 1e6:.3f} s: {self.instance_name}: {self.kind}{why}{frames}{pings}"


ProxyListener = Callable[[ProxyEvent], None]
"""Function that is called with events. Its exceptions are logged and have no other effect."""


def notify(listener: ProxyListener | None, event: ProxyEvent) -> None:
    """Log an event, and call the listener."""
    _LOG.info("%s", event)
    if listener is not None:
        call_listeners(event.instance_name, (listener,), event)
