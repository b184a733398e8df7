"""A thread for the calls into one peer: whoever hangs there delays nobody else."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from heapq import heappop, heappush
from itertools import count
from queue import Empty
from typing import Final

from tickrig.host.links.waiting_queue import WaitingQueue
from tickrig.host.text.log import log_of

PeerCall = Callable[[], float | None]
"""Returns after how many seconds it wants to be made again, None if it does not."""

RETRY_US: Final = 1_000_000

_LOG: Final = log_of(__name__)


class CallingThread(threading.Thread):
    """The thread of a `PeerThread`; it does not keep the process alive.

    Attributes:
        ending: it was told to end, and does after its present call.
    """

    ending = False


def calls_run() -> bool:
    """Return whether a thread that was told to end still makes a call.

    A process that ends in the middle of one may abort, or never end: the call is in code of C++.
    """
    threads = threading.enumerate()
    return any(isinstance(thread, CallingThread) and thread.ending for thread in threads)


class PeerThread:
    """Makes calls into a peer, one after the other, in a thread of its own.

    A call that hangs holds up those that follow it here; its time-out is the engine's (1 s for
    a CORBA call). The thread does not keep the process alive.

    Args:
        name: of the peer, for people.
        retry_us: so long after a call that had no answer connectors call again.

    Attributes:
        retry_s: the same, in seconds.
    """

    def __init__(self, name: str, retry_us: int = RETRY_US) -> None:
        self.retry_s, self._order = retry_us / 1e6, count()
        self._calls: WaitingQueue[PeerCall | None] = WaitingQueue()
        self._repeated: list[tuple[float, int, PeerCall]] = []
        self._thread = CallingThread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def submit(self, call: PeerCall) -> None:
        """Have a call made after those that wait; nothing waits for it here."""
        self._calls.put(call)

    def close(self, wait_us: int = 0) -> None:
        """End after the present call; wait for that, but not longer than `wait_us`."""
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

    def _plan(self, call: PeerCall, again_s: float | None) -> None:
        if again_s == 0:
            self._calls.put(call)
        elif again_s is not None:
            heappush(self._repeated, (time.monotonic() + again_s, next(self._order), call))

    def _next(self) -> PeerCall | None:
        """Wait for the next call; those that are repeated come at their time."""
        wait_s = None
        if self._repeated:
            wait_s = self._repeated[0][0] - time.monotonic()
            if wait_s <= 0:
                return heappop(self._repeated)[2]
        try:
            return self._calls.get(wait_s)
        except Empty:
            return heappop(self._repeated)[2]
