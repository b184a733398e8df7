"""Replacements for the waits of libraries, which advance the virtual time."""

from __future__ import annotations

import queue
from collections import deque
from collections.abc import Callable
from threading import get_ident
from typing import Final, Generic, Protocol, TypeVar

from tickrig.device.twin import Copyable, restore
from tickrig.host.text.log import log_of
from tickrig.wire.instant import NEVER

_LOG = log_of(__name__)

EPOCH_S: Final = 946_684_800
"""Time on the clock of hosts at the start of a rig: 2000-01-01."""

LOOK_US: Final = 100
"""Time added by each read of the clock, so that a loop that only reads the clock ends."""

MOST_LOOKS: Final = 10_000
"""Largest number of polls at one instant. After more polls the host gets an error, because it would
wait endlessly."""

_T = TypeVar("_T")


class OneThread(Copyable):
    """Restricts hosts in virtual time to one thread, which may advance the time.

    If two threads advanced the time, runs would not be reproducible. The allowed thread is the one
    that makes this object. For a copy, it is the thread that makes the copy.

    Attributes:
        ident: identifier of the allowed thread.
        refused: error message, once a second thread has tried to advance the time, or empty.
    """

    def __init__(self) -> None:
        self.ident, self.refused = get_ident(), ""

    def __setstate__(self, state: object) -> None:
        """Continue in the thread that makes the copy."""
        restore(self, state)
        self.ident = get_ident()

    def refusal(self, name: str, instead: str) -> str:
        """Return an error message if a second thread uses an object or has used it, otherwise "".

        Args:
            name: name of the object that is used, such as a port or a bus.
            instead: text that suggests what hosts with a second thread can do.
        """
        if get_ident() != self.ident and not self.refused:
            self.refused = (
                f"{name}: a second thread cannot make virtual time pass; {instead}, or run in real"
                " time"
            )
            _LOG.error(self.refused)
        return self.refused


class Looks(Copyable):
    """Counts polls without result at one instant of virtual time, to detect an endless loop."""

    def __init__(self) -> None:
        self._count, self._at_us = 0, NEVER

    def refusal(self, now_us: int, instead: str) -> str:
        """Count a poll that has found no data, and return an error message after too many.

        While there were at most `MOST_LOOKS` such polls at `now_us`, the result is an empty text.

        Args:
            now_us: present time in microseconds.
            instead: text that suggests calls that advance the time.
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


class HostLimit(Copyable):
    """Base class for a limit on the waits of hosts, so that no host waits endlessly.

    This class itself sets no limit. If a host begins a wait at `due_us` or later, the port of the
    host calls `count`.

    Attributes:
        due_us: time in microseconds. A wait that begins before this time is not counted.
    """

    due_us: int = NEVER

    def restart(self, now_us: int) -> None:
        """Count waits from zero again, because the test itself has advanced the time."""

    def look(self, now_us: int) -> None:
        """Count a read of the clock."""

    def count(self, now_us: int, where: Callable[[], str] | None = None) -> None:
        """Count a wait of a host. A subclass can limit the waits.

        Args:
            now_us: present time in microseconds.
            where: function that returns file and line number of the waiting code, for the message.
                If it is None, this code is found in the call stack.

        Raises:
            AssertionError: the limit is reached.
        """


class Passing(Protocol):
    """An object whose time can be advanced."""

    @property
    def time_s(self) -> float:
        """Seconds since 1970 on the clock of the object."""
        ...

    def wait(self, done: Callable[[], bool], timeout_s: float | None) -> bool:
        """Advance the time until `done()` is true; return False after the timeout."""
        ...


class SimQueue(Generic[_T]):
    """A `queue.Queue` for one thread: waiting advances the time."""

    def __init__(self, passing: Passing) -> None:
        self._passing = passing
        self._items: deque[_T] = deque()

    def put(self, item: _T) -> None:
        """Append an item."""
        self._items.append(item)

    def get(self, block: bool = True, timeout: float | None = None) -> _T:
        """Return the first item; raise queue.Empty after the timeout."""
        self._passing.wait(lambda: bool(self._items), timeout if block else 0)
        if not self._items:
            raise queue.Empty
        return self._items.popleft()

    def empty(self) -> bool:
        """Return whether the queue is empty."""
        return not self._items


class SimCondition:
    """A `threading.Condition` for one thread: waiting advances the time."""

    def __init__(self, passing: Passing) -> None:
        self._passing, self._notified = passing, 0

    def __enter__(self) -> bool:
        """Do nothing; one thread needs no lock."""
        return True

    def __exit__(self, *exception: object) -> None:
        """Do nothing; one thread needs no lock."""

    def wait(self, timeout: float | None = None) -> bool:
        """Wait for the next notification; return False after the timeout."""
        before = self._notified
        return self._passing.wait(lambda: self._notified != before, timeout)

    def notify_all(self) -> None:
        """Wake the waiting callers."""
        self._notified += 1


class SimTime:
    """The functions of `time` that libraries use, on the clock of a rig."""

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
        """Return a time in seconds for computing differences."""
        return self.time()

    perf_counter = monotonic
    monotonic_ns = perf_counter_ns = time_ns

    def sleep(self, seconds: float) -> None:
        """Advance the time."""
        self._passing.wait(lambda: False, seconds)


class SimQueues:
    """The names of `queue` that libraries use."""

    Empty = queue.Empty

    def __init__(self, passing: Passing) -> None:
        self._passing = passing

    def Queue(self) -> SimQueue[bytes]:  # noqa: N802 - the library calls it so
        """Return a new queue."""
        return SimQueue(self._passing)
