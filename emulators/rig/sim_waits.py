"""What a library waits on, replaced by what makes virtual time pass."""

from __future__ import annotations

import logging
import queue
from collections import deque
from collections.abc import Callable
from threading import get_ident
from typing import Final, Generic, Protocol, TypeVar

from tickrig.device.twin import Copyable, restore
from tickrig.wire.instant import NEVER

_LOG = logging.getLogger(__name__)

EPOCH_S: Final = 946_684_800
"""The clock of hosts at the start of a rig: 2000-01-01."""

LOOK_US: Final = 100
"""What a look at the clock costs: a loop that does nothing else then ends some day."""

MOST_LOOKS: Final = 10_000
"""Looks that a host takes at one instant before it is told that it will wait for ever."""

T = TypeVar("T")


class OneThread(Copyable):
    """The thread in which hosts make virtual time pass: two would race, and no run be like another.

    It is the one that makes this; a twin's is the one in which it is made.
    """

    def __init__(self) -> None:
        self._thread, self._refusal = get_ident(), ""

    def __setstate__(self, state: object) -> None:
        """Go on in the thread in which it is copied."""
        restore(self, state)
        self._thread = get_ident()

    def refusal(self, name: str, instead: str) -> str:
        """Return why nothing can be done here, now and ever after a second thread has tried; or "".

        Args:
            name: what is used: a port, a bus.
            instead: what a host does that has one.
        """
        if get_ident() != self._thread and not self._refusal:
            self._refusal = (
                f"{name}: a second thread cannot make virtual time pass; {instead}, or run in real"
                " time"
            )
            _LOG.error(self._refusal)
        return self._refusal


class Looks(Copyable):
    """Looks that found nothing at one instant: they make no time pass, so a loop of them hangs."""

    def __init__(self) -> None:
        self._count, self._at_us = 0, NEVER

    def refusal(self, now_us: int, instead: str) -> str:
        """Count a look; return why the host would wait for ever, or "".

        Args:
            now_us: when it is.
            instead: what makes time pass.
        """
        if self._at_us != now_us:
            self._count, self._at_us = 0, now_us
        self._count += 1
        if self._count <= MOST_LOOKS:
            return ""
        return (
            f"looked {MOST_LOOKS} times at {now_us / 1e6:.6f} s: looking makes no time pass;"
            f" {instead}"
        )


class Passing(Protocol):
    """Something whose time can be made to pass."""

    @property
    def time_s(self) -> float:
        """Seconds since 1970, on its clock."""
        ...

    def wait(self, done: Callable[[], bool], timeout_s: float | None) -> bool:
        """Let time pass until `done()`; False if the timeout was first."""
        ...


class SimQueue(Generic[T]):
    """A `queue.Queue` as one thread needs it: waiting lets time pass."""

    def __init__(self, passing: Passing) -> None:
        self._passing = passing
        self._items: deque[T] = deque()

    def put(self, item: T) -> None:
        """Put something at the end."""
        self._items.append(item)

    def get(self, block: bool = True, timeout: float | None = None) -> T:
        """Take the first; raises queue.Empty if there is none in time."""
        self._passing.wait(lambda: bool(self._items), timeout if block else 0)
        if not self._items:
            raise queue.Empty
        return self._items.popleft()

    def empty(self) -> bool:
        """Say whether there is nothing in it."""
        return not self._items


class SimCondition:
    """A `threading.Condition` as one thread needs it: waiting lets time pass."""

    def __init__(self, passing: Passing) -> None:
        self._passing, self._notified = passing, 0

    def __enter__(self) -> bool:
        """Nothing to lock."""
        return True

    def __exit__(self, *exception: object) -> None:
        """Nothing to unlock."""

    def wait(self, timeout: float | None = None) -> bool:
        """Wait for the next notification; False if the timeout was first."""
        before = self._notified
        return self._passing.wait(lambda: self._notified != before, timeout)

    def notify_all(self) -> None:
        """Let those who wait go on."""
        self._notified += 1


class SimTime:
    """The functions of `time` that libraries use, on another clock."""

    def __init__(self, passing: Passing) -> None:
        self._passing = passing

    def time(self) -> float:
        """Return the time since 1970 in seconds."""
        self.sleep(LOOK_US / 1e6)
        return self._passing.time_s

    def time_ns(self) -> int:
        """Return the time since 1970 in nanoseconds, to the microsecond."""
        return round(self.time() * 1e6) * 1_000

    def monotonic(self) -> float:
        """Return a time in seconds of which only differences mean anything."""
        return self.time()

    perf_counter = monotonic
    monotonic_ns = perf_counter_ns = time_ns

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        self._passing.wait(lambda: False, seconds)


class SimQueues:
    """The names of `queue` that libraries use."""

    Empty = queue.Empty

    def __init__(self, passing: Passing) -> None:
        self._passing = passing

    def Queue(self) -> SimQueue[bytes]:  # noqa: N802 - the library calls it so
        """Return a new queue."""
        return SimQueue(self._passing)
