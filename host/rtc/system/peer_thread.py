"""Threads that call peers for many connectors, with one thread until a peer hangs."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from heapq import heappop, heappush
from itertools import count
from queue import Empty
from typing import Final, Protocol

from tickrig.host.links.ready import WaitingQueue
from tickrig.host.text.log import log_of

# A thread for the calls into one peer: a peer that hangs delays no other.

_PeerCall = Callable[[], float | None]
"""Function that returns the seconds after which it must be called again, or None."""

_RETRY_US: Final = 1_000_000

_LOG: Final = log_of(__name__)


class _CallingThread(threading.Thread):
    """The thread of a `PeerThread`. It does not keep the process alive.

    Attributes:
        ending: whether the thread ends after its current call.
    """

    ending = False


def calls_run() -> bool:
    """Return whether a `PeerThread` that was closed still executes a call into another process.

    If this process ends during such a call, it may abort or hang, because the call is in C++ code.
    """
    threads = threading.enumerate()
    return any(isinstance(thread, _CallingThread) and thread.ending for thread in threads)


class PeerThread:
    """Thread that makes all calls to one component in another process (the peer), one by one.

    If a call hangs, the later calls wait until the hanging call ends by a time-out (1 s for a CORBA
    call). The thread is a daemon thread, so it does not keep the process alive.

    Args:
        name: name of the peer, for the log.
        retry_us: time in us after which connectors repeat a call that had no answer.

    Attributes:
        retry_s: time `retry_us` in seconds.
    """

    def __init__(self, name: str, retry_us: int = _RETRY_US) -> None:
        self.retry_s, self._order = retry_us / 1e6, count()
        self._calls: WaitingQueue[_PeerCall | None] = WaitingQueue()
        self._repeated: list[tuple[float, int, _PeerCall]] = []
        self._thread = _CallingThread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def submit(self, call: _PeerCall) -> None:
        """Schedule a call after the waiting calls. The caller does not wait."""
        self._calls.put(call)

    def close(self, wait_us: int = 0) -> None:
        """End the thread after the present call. Wait for the end, at most `wait_us`."""
        self._thread.ending = True
        self._calls.put(None)
        self._thread.join(wait_us / 1e6)

    def _run(self) -> None:
        while (call := self._next()) is not None:
            try:
                again_s = call()
            except Exception:
                _LOG.exception("%s: a call raised", self._thread.name)
            else:
                self._plan(call, again_s)

    def _plan(self, call: _PeerCall, again_s: float | None) -> None:
        if again_s == 0:
            self._calls.put(call)
        elif again_s is not None:
            heappush(self._repeated, (time.monotonic() + again_s, next(self._order), call))

    def _next(self) -> _PeerCall | None:
        """Wait for the next call. Repeated calls come at their time."""
        wait_s = None
        if self._repeated:
            wait_s = self._repeated[0][0] - time.monotonic()
            if wait_s <= 0:
                return heappop(self._repeated)[2]
        try:
            return self._calls.get(wait_s)
        except Empty:
            return heappop(self._repeated)[2]


_PATIENCE_S: Final = 0.005
"""The longest wait for the call of another connector. After this, a further thread starts."""

_LANES: Final = 2
"""Number of threads for calls that are answered. Two threads hide the wake-up time of each answer,
and more than two wait for each other.
"""

_IDLE_S: Final = 5.0
"""Idle time after which a thread ends. A peer that hangs is called again each second."""

_MOST: Final = 256


class PeerCaller(Protocol):
    """An object that makes calls to peers in its own threads, `PeerThread` or `PeerThreads`."""

    retry_s: float

    def submit(self, call: _PeerCall) -> None:
        """Schedule a call. The caller does not wait."""
        ...


class PeerThreads:
    """A pool of threads that make the calls of many connectors to components in other processes.

    Each connector makes one call at a time. As long as every call is answered quickly, a single
    thread makes all calls. This saves processor time. If calls have to wait too long, a second
    thread is started. A thread whose call gets no answer is blocked. Such a thread is not counted,
    so that another thread can be started in its place.

    Args:
        name: name of the threads, for the log.
        retry_us: time in us after which connectors repeat a call that had no answer.

    Attributes:
        retry_s: time `retry_us` in seconds.
        running: number of running threads.
    """

    def __init__(self, name: str, retry_us: int = _RETRY_US) -> None:
        self.retry_s, self._name, self._order = retry_us / 1e6, name, count()
        self._changed = threading.Condition()
        self._calls: deque[tuple[float, _PeerCall]] = deque()
        self._repeated: list[tuple[float, int, _PeerCall]] = []
        self.running, self._idle, self._helped_s, self._closed = 0, 0, 0.0, False
        self._made: dict[int, float] = {}  # since when a thread is in its call

    def submit(self, call: _PeerCall) -> None:
        """Schedule a call. The caller does not wait."""
        with self._changed:
            self._append(call, wake=not self._calls)

    def close(self) -> None:
        """End the threads after their present calls."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def _append(self, call: _PeerCall, *, wake: bool) -> None:
        """Add a call. If calls wait too long, start one more thread."""
        now_s = time.monotonic()
        self._calls.append((now_s, call))
        if late := self._is_late(now_s):
            self._helped_s = now_s
        if self._idle:
            if late or wake:  # who is awake takes those that follow
                self._changed.notify()
        elif late and self.running < _MOST and not self._closed:
            self.running += 1
            threading.Thread(target=self._run, name=self._name, daemon=True).start()

    def _is_late(self, now_s: float) -> bool:
        """Return whether a call waits too long, and one more thread would help."""
        if not self.running:
            return True
        if now_s - max(self._calls[0][0], self._helped_s) <= _PATIENCE_S:
            return False
        hanging = sum(now_s - since_s > _PATIENCE_S for since_s in self._made.values())
        return self.running - self._idle - hanging < _LANES

    def _run(self) -> None:
        while (call := self._next()) is not None:
            try:
                again_s = call()
            except Exception:
                _LOG.exception("%s: a call raised", self._name)
            else:
                self._plan(call, again_s)

    def _plan(self, call: _PeerCall, again_s: float | None) -> None:
        if again_s is None:
            return
        with self._changed:
            if again_s == 0:
                self._append(call, wake=False)  # this thread is awake
            else:
                due_s = time.monotonic() + again_s
                heappush(self._repeated, (due_s, next(self._order), call))

    def _next(self) -> _PeerCall | None:
        """Wait for the next call. None ends the thread."""
        me = threading.get_ident()
        with self._changed:
            self._made.pop(me, None)
            end_s = time.monotonic() + _IDLE_S
            while not self._closed:
                now_s = time.monotonic()
                if self._calls or (self._repeated and self._repeated[0][0] <= now_s):
                    self._made[me] = now_s
                    return self._take(now_s)
                if now_s >= end_s and not (self._repeated and not self._idle):
                    break
                due_s = self._repeated[0][0] if self._repeated else end_s
                self._idle += 1
                self._changed.wait(max(0.0, due_s - now_s))
                self._idle -= 1
            self.running -= 1
        return None

    def _take(self, now_s: float) -> _PeerCall:
        """Take a call that is due for repetition, or else the oldest call."""
        if self._repeated and self._repeated[0][0] <= now_s:
            return heappop(self._repeated)[2]
        return self._calls.popleft()[1]
