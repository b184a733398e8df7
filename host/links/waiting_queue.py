"""A queue whose waits end in their time."""

from __future__ import annotations

from collections import deque
from contextlib import suppress
from queue import Empty
from threading import TIMEOUT_MAX, Lock
from time import monotonic
from typing import Generic, TypeVar

T = TypeVar("T")


class WaitingQueue(Generic[T]):
    """A queue for one thread that reads and any that write.

    `queue.SimpleQueue` waits for good (CPython 3.11) where its time is over before it looks
    again: after a signal, or where its lock happens to be free. Ctrl-C in the midst of
    `queue.Queue` and `threading.Event` can leave their lock taken.
    """

    def __init__(self) -> None:
        self._items: deque[T] = deque()
        self._nothing_new = Lock()
        self._nothing_new.acquire()

    def put(self, item: T) -> None:
        """Put an item at the end; never waits."""
        self._items.append(item)
        with suppress(RuntimeError):  # something else is new, too
            self._nothing_new.release()

    def get(self, wait_s: float | None = None) -> T:
        """Take the first item.

        Args:
            wait_s: for how long to wait for one; None for as long as it takes.

        Raises:
            Empty: nothing came in time.
        """
        deadline_s = None if wait_s is None else monotonic() + wait_s
        while True:
            with suppress(IndexError):
                return self._items.popleft()
            left_s = (
                -1 if deadline_s is None else min(max(0, deadline_s - monotonic()), TIMEOUT_MAX)
            )
            if not self._nothing_new.acquire(timeout=left_s):
                raise Empty

    def clear(self) -> None:
        """Forget all items."""
        self._items.clear()
