"""Waiting at a `SimpleQueue` for a time that is surely over then."""

from __future__ import annotations

from queue import Empty, SimpleQueue
from typing import TypeVar

T = TypeVar("T")


def get_within(queue: SimpleQueue[T], wait_s: float | None) -> T:
    """Return the next item of a queue that nobody else reads.

    The queue's own `get` with a time-out waits for good (CPython 3.11) where its lock is free and
    the time is over before it looks again: one call in some ten thousand of a microsecond, and of
    any length where the process is stopped just then. A look that does not wait takes the lock.

    Args:
        queue: what is read.
        wait_s: for how long to wait; None for as long as it takes.

    Raises:
        Empty: nothing came in time.
    """
    try:
        return queue.get_nowait()
    except Empty:
        if wait_s is not None and wait_s <= 0:
            raise
        return queue.get(timeout=wait_s)
