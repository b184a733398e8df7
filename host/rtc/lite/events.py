"""What a proxy tells beside its state."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

from tickrig.host.rtc.component import guarded
from tickrig.host.rtc.states import ReturnCode
from tickrig.host.text.log import log_of
from tickrig.wire.instant import NEVER

# When to send a PING, when a device is lost (DECISION L14), and how PINGs went.

_SEQUENCE: Final = range(1, 256)
"""Numbers of PINGs; 0 is skipped."""


@dataclass(frozen=True, slots=True)
class PingStatistics:
    """Statistics of the PINGs of a proxy.

    Attributes:
        sent: number of PINGs sent.
        answered: number of these that were answered in time.
        lost: number of these that were not answered in time; the others are still under way.
        shortest_us: shortest round trip; 0 without a round trip.
        longest_us: longest round trip; 0 without a round trip.
        total_us: sum of all round trips.
    """

    sent: int = 0
    answered: int = 0
    lost: int = 0
    shortest_us: int = 0
    longest_us: int = 0
    total_us: int = 0

    @property
    def mean_us(self) -> int:
        """Mean round trip, 0 without one."""
        return self.total_us // self.answered if self.answered else 0

    def __str__(self) -> str:
        """Write it for people.

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
    """Schedules and counts PINGs. It sends nothing, and has no clock.

    From `start` on a PING is due each `period_us`, regardless of other traffic. A PING delayed by a
    busy line does not shift the next one, and a burst does not shift it either. PINGs that fall due
    during a burst are part of the burst.

    Args:
        period_us: from one PING to the next.
        wait_us: how long an answer may take.
        most: number of unanswered PINGs in a row after which the device is lost.

    Attributes:
        awaiting: whether a PING waits for its answer.
        doubted: whether a reply is missing and no PING has been answered since then.
        lost: whether the device no longer answers; this is final.
    """

    period_us: int
    wait_us: int
    most: int
    awaiting: bool = field(default=False, init=False)
    doubted: bool = field(default=False, init=False)
    lost: bool = field(default=False, init=False)
    _next_us: int = field(default=NEVER, init=False)
    _number: int = field(default=0, init=False)
    _unanswered: int = field(default=0, init=False)
    _pinged_us: int = field(default=0, init=False)
    _sent: int = field(default=0, init=False)
    _missed: int = field(default=0, init=False)
    _answered: int = field(default=0, init=False)
    _total_us: int = field(default=0, init=False)
    _shortest_us: int = field(default=0, init=False)
    _longest_us: int = field(default=0, init=False)

    @property
    def statistics(self) -> PingStatistics:
        """How the PINGs went up to now."""
        return PingStatistics(
            self._sent,
            self._answered,
            self._missed,
            self._shortest_us,
            self._longest_us,
            self._total_us,
        )

    @property
    def due_us(self) -> int:
        """When `tick` has something to do; `NEVER` for a device that is lost."""
        if self.lost:
            return NEVER
        return self._pinged_us + self.wait_us if self.awaiting else self._next_us

    @property
    def pending(self) -> bool:
        """Whether an answer is out to a PING that was sent as a matter of routine."""
        return self.awaiting and not self.doubted

    def start(self, now_us: int) -> None:
        """Let the first PING be due a period from now."""
        self._next_us = now_us + self.period_us

    def tick(self, now_us: int) -> int | None:
        """Return the number of a PING that is to be sent now, if one is."""
        if now_us < self.due_us:
            return None
        if self.awaiting:
            self.doubted, self.awaiting = True, False
            self._missed += 1
        self.lost = self._unanswered >= self.most
        return None if self.lost else self._ping(now_us)

    def doubt(self, now_us: int) -> int:
        """Begin a burst, as a reply is missing; return the number of its first PING."""
        self.doubted = True
        return self._ping(now_us)

    def let_go(self) -> None:
        """Wait no more for a routine PING: a request follows, whose reply tells as much."""
        if self.pending:
            self.awaiting = False
            self._missed += 1

    def replied(self) -> None:
        """Note that the device has replied to a request: it is there."""
        if not self.awaiting:
            self._unanswered = 0

    def answered(self, number: int, now_us: int) -> None:
        """Take an answer; that to an older PING is ignored."""
        if self.awaiting and number == self._number:
            round_trip_us = now_us - self._pinged_us
            first = not self._answered
            self._shortest_us = round_trip_us if first else min(self._shortest_us, round_trip_us)
            self._longest_us = max(self._longest_us, round_trip_us)
            self._total_us += round_trip_us
            self._answered += 1
            if self.doubted:
                self._advance(now_us)
            self.awaiting = self.doubted = False
            self._unanswered = 0

    def _ping(self, now_us: int) -> int:
        """Count a PING that is sent now, and return its number."""
        self._advance(now_us)
        self._number = self._number % _SEQUENCE[-1] + 1
        self._unanswered += 1
        self._sent += 1
        self.awaiting, self._pinged_us = True, now_us
        return self._number

    def _advance(self, now_us: int) -> None:
        """Pass over what has fallen due."""
        if self._next_us <= now_us:
            self._next_us += (now_us - self._next_us) // self.period_us * self.period_us
            self._next_us += self.period_us


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
        at_us: time of the event on the clock of the proxy's link.
        kind: kind of the event.
        instance_name: name of the proxy.
        reason: why the proxy went to Error, for people; empty for other events.
        frames: the last frames before the event, with their times on the clock of the link.
        pings: statistics of its PINGs; None unless the proxy was removed.
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
"""Called with events; an exception in it is logged and has no other effect."""


def notify(listener: ProxyListener | None, event: ProxyEvent) -> None:
    """Log an event, and call the listener."""
    _LOG.info("%s", event)

    def listen() -> ReturnCode:
        if listener is not None:
            listener(event)
        return ReturnCode.RTC_OK

    guarded(event.instance_name, listen)
