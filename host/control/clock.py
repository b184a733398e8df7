"""Clocks of this machine, for real time."""

from __future__ import annotations

import time
from collections.abc import Callable


class RealClock:
    """This machine's monotonic clock, counted from the first wait."""

    def __init__(self) -> None:
        self._start_ns: int | None = None

    @property
    def now_us(self) -> int:
        """Time since the first wait, or 0 before it."""
        if self._start_ns is None:
            return 0
        return (time.monotonic_ns() - self._start_ns) // 1_000

    def wait_until(self, t_us: int, /) -> int:
        """Sleep until a time.

        If the time has passed already, the method returns at once. Thus a late rig catches up
        without skipping ticks.

        Args:
            t_us: time in microseconds since the first wait.

        Returns:
            The delay in microseconds with which the wait has ended.
        """
        if self._start_ns is None:
            self._start_ns = time.monotonic_ns()
        early_us = t_us - self.now_us
        if early_us > 0:
            time.sleep(early_us / 1e6)
            return max(0, self.now_us - t_us)
        return -early_us


class ServingClock(RealClock):
    """Real-time clock that calls a function while it waits, for example to serve a control socket.

    Attributes:
        serve: function that is called in each wait. Its argument is the time in microseconds that
            it may take. It is called at least once per wait, even if the run is behind real time.
            So a request to stop the run is still served.
    """

    serve: Callable[[int], None] | None = None

    def wait_until(self, t_us: int, /) -> int:
        """Serve requests, then sleep until `t_us`."""
        if self.serve is not None:
            self.serve(0)
            while (early_us := t_us - self.now_us) > 0 and self.now_us:
                self.serve(early_us)
        return super().wait_until(t_us)
