"""The two clocks that a rig can run on."""

from __future__ import annotations

import time
from typing import Protocol


class Clock(Protocol):
    """Time since the rig was started, in microseconds."""

    def wait_until(self, t_us: int, /) -> int:
        """Return when it is `t_us`; the answer is how late in microseconds, 0 if on time."""
        ...


class VirtualClock:
    """Time that passes as fast as the rig can compute: never late."""

    def wait_until(self, t_us: int, /) -> int:
        """Return at once: in virtual time it is already `t_us`."""
        return 0


class RealClock:
    """The monotonic clock of this machine; it starts when it is first waited for."""

    def __init__(self) -> None:
        self._start_ns: int | None = None

    @property
    def now_us(self) -> int:
        """Time since the first wait, 0 before it."""
        if self._start_ns is None:
            return 0
        return (time.monotonic_ns() - self._start_ns) // 1_000

    def wait_until(self, t_us: int, /) -> int:
        """Sleep until `t_us`; a late rig catches up, it never skips a tick."""
        if self._start_ns is None:
            self._start_ns = time.monotonic_ns()
        early_us = t_us - self.now_us
        if early_us > 0:
            time.sleep(early_us / 1e6)
            return max(0, self.now_us - t_us)
        return -early_us
