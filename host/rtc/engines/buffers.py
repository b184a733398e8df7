"""Buffers between the thread of a manager and those of an engine."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import TypeVar

from tickrig.host.rtc.ports.ring_buffer import BufferOptions, FullPolicy, RingBuffer
from tickrig.host.rtc.states import PortStatus

P = TypeVar("P")


class LockedBuffer(RingBuffer[P]):
    """A ring buffer that one thread fills and another one reads."""

    __slots__ = ("_lock",)

    def __init__(self, options: BufferOptions) -> None:
        super().__init__(options)
        self._lock = threading.Lock()

    def write(self, value: P) -> PortStatus:
        """Put a value behind the others; see `RingBuffer.write`."""
        with self._lock:
            return super().write(value)

    def read(self) -> P | None:
        """Take a value; see `RingBuffer.read`."""
        with self._lock:
            return super().read()


class ArrivalBuffer(RingBuffer[P]):
    """A ring buffer whose values come from other threads: they wait until they are let in.

    What waits counts as if it were in the buffer; so the status of a value is known at once.
    """

    __slots__ = ("_arrived", "_lock")

    def __init__(self, options: BufferOptions) -> None:
        super().__init__(options)
        self._lock, self._arrived = threading.Lock(), deque[P](maxlen=options.length)

    def arrive(self, value: P) -> tuple[PortStatus, bool]:
        """Take a value, in any thread.

        Returns:
            What `write` would return, and whether it is the first that waits.
        """
        options = self._options
        with self._lock:
            waiting = len(self._arrived) + len(self._values)
            if waiting >= options.length and options.full is not FullPolicy.OVERWRITE:
                blocks = options.full is FullPolicy.BLOCK
                return (PortStatus.BUFFER_TIMEOUT if blocks else PortStatus.BUFFER_FULL), False
            self._arrived.append(value)
            return PortStatus.PORT_OK, len(self._arrived) == 1

    def let_in(self) -> None:
        """Put what waits into the buffer, in the thread of the manager."""
        with self._lock:
            for value in self._arrived:
                self.write(value)
            self._arrived.clear()


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
