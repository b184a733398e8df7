"""What of a log is sent where and when."""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from tickrig.host.canmon.model.frames.record import Record
from tickrig.host.canmon.model.traffic.gaps import bucket_of, middle_us
from tickrig.wire.can import CanFrame
from tickrig.wire.can_error import ErrorFrame
from tickrig.wire.can_fd import FdFrame

FOREVER: Final = 0
"""As `loops`."""

LEAST_LOOP_US: Final = 1_000


class Due(NamedTuple):
    """A frame that is to be sent.

    Attributes:
        at_us: when, counted from the start of the replay.
        channel: on which bus.
        frame: what.
    """

    at_us: int
    channel: str
    frame: CanFrame | FdFrame


@dataclass(slots=True)
class ReplayPlan:
    """Frames of a log in the order of the log; time in it never goes back.

    Args:
        log: the frames; read again for each loop.
        route: tells where the frames of a bus of the log go, None if nowhere.
        speed: how many times faster, 0 without any pause.
        from_us: what is earlier than this after the first frame is left out,
        to_us: what is later likewise; None for the end.
        loops: how often, `FOREVER` until it is stopped. A loop begins where the one before
            ends: at `to_us`, else with the last frame, and at least 1 ms after it began.

    Attributes:
        left_out: frames of other buses, and error frames, that were in the span.

    Raises:
        ValueError: a span that is empty, or a speed below 0.
    """

    log: Iterable[Record]
    route: Callable[[str], str | None]
    speed: float = 1.0
    from_us: int = 0
    to_us: int | None = None
    loops: int = 1
    left_out: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        """Check the arguments."""
        if self.speed < 0:
            raise ValueError(f"speed {self.speed:g}; 0 is as fast as can be, 1 as recorded")
        if self.to_us is not None and self.to_us <= self.from_us:
            raise ValueError(f"from {self.from_us} us to {self.to_us} us there is nothing")

    def __iter__(self) -> Iterator[Due]:
        """Yield the frames; a log without any ends also an endless replay."""
        begin_us, loop = 0, 0
        while self.loops == FOREVER or loop < self.loops:
            end_us, sent = begin_us, False
            for at_us, record in self._span():
                end_us = begin_us + at_us
                channel = self.route(record.channel)
                if channel is None or isinstance(record.frame, ErrorFrame):
                    self.left_out += 1
                    continue
                sent = True
                yield Due(self._scaled(end_us), channel, record.frame)
            if not sent:
                return
            loop += 1
            end_us = end_us if self.to_us is None else begin_us + self.to_us - self.from_us
            begin_us = max(end_us, begin_us + LEAST_LOOP_US)

    def _span(self) -> Iterator[tuple[int, Record]]:
        """Yield what is in the span, with its time after the beginning of the span."""
        first_us: int | None = None
        latest_us = 0
        for record in self.log:
            first_us = record.at_us if first_us is None else first_us
            latest_us = max(latest_us, record.at_us - first_us)
            if self.to_us is not None and latest_us > self.to_us:
                return
            if latest_us >= self.from_us:
                yield latest_us - self.from_us, record

    def _scaled(self, at_us: int) -> int:
        return round(at_us / self.speed) if self.speed else 0


EXACT_US: Final = 100_000


class Lateness:
    """Counts latenesses.

    Attributes:
        count: how many.
        max_us: the greatest.
        last_us: the latest one: at the end of a replay, its drift.
    """

    def __init__(self) -> None:
        self._exact = array("q", bytes(8 * (EXACT_US + 1)))
        self._above: Counter[int] = Counter()
        self.count = self.max_us = self.last_us = 0

    def add(self, late_us: int) -> None:
        """Count one; what is early counts as on time."""
        self.last_us = late_us = max(0, late_us)
        self.count += 1
        self.max_us = max(self.max_us, late_us)
        if late_us <= EXACT_US:
            self._exact[late_us] += 1
        else:
            self._above[bucket_of(late_us)] += 1

    def percentile_us(self, percent: float) -> int:
        """Return what so many percent, 0 to 100, are not later than; 0 if none were counted."""
        left = self.count * percent / 100
        for late_us, count in self._counts():
            left -= count
            if left <= 0:
                return min(late_us, self.max_us)
        return self.max_us

    def _counts(self) -> Iterator[tuple[int, int]]:
        """Give each lateness, the least first, and how many there are."""
        yield from enumerate(self._exact)
        for bucket in sorted(self._above):
            yield middle_us(bucket), self._above[bucket]

    def __str__(self) -> str:
        """Say it to people."""
        p50, p99 = self.percentile_us(50), self.percentile_us(99)
        return f"late p50 {p50} us, p99 {p99} us, max {self.max_us} us; last {self.last_us} us"
