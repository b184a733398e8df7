"""Values on their way to a peer."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TypeVar

from tickrig.host.rtc.ports.ring_buffer import BufferOptions, FullPolicy, RingBuffer
from tickrig.host.rtc.states import PortStatus

P = TypeVar("P")


class SendBuffer(RingBuffer[P]):
    """A ring buffer that one thread fills and another one empties.

    Args:
        options: its length, and what is lost when it is full.
        wake: called when there is something to take; `take` is called until it gives nothing.

    Attributes:
        dropped: how many values were lost because it was full.
    """

    __slots__ = ("_lock", "_wake", "_woken", "dropped")

    def __init__(self, options: BufferOptions, wake: Callable[[], object]) -> None:
        super().__init__(options)
        self._lock, self._wake, self._woken, self.dropped = threading.Lock(), wake, False, 0

    def write(self, value: P) -> PortStatus:
        """Put a value behind the others; see `RingBuffer.write`."""
        with self._lock:
            self.dropped += len(self._values) == self._options.length
            status = super().write(value)
            wakes, self._woken = not self._woken, True
        if wakes:
            self._wake()
        return status

    def take(self) -> tuple[P, ...]:
        """Take the oldest value, if there is one."""
        with self._lock:
            taken = self.pop()
            self._woken = bool(taken)
        return taken

    def put_back(self, value: P) -> None:
        """Put a value that was taken before the others again; if it is full, one is lost."""
        with self._lock:
            full = len(self._values) == self._options.length
            self.dropped += full
            if full and self._options.full is FullPolicy.OVERWRITE:
                return
            if full:
                self._values.pop()
            self._values.appendleft(value)
