"""The clock of a verb that sends."""

from __future__ import annotations

import ctypes
import sys
import time
from typing import Final

PR_SET_TIMERSLACK: Final = 29
SLACK_NS: Final = 1_000


class Pace:
    """Time since it was made, in microseconds.

    It sleeps to absolute moments, so what is paced by it does not drift.
    """

    def __init__(self) -> None:
        self._start_ns = time.monotonic_ns()
        _wake_on_time()

    @property
    def now_us(self) -> int:
        """The time."""
        return (time.monotonic_ns() - self._start_ns) // 1_000

    def wait_until(self, at_us: int) -> int:
        """Return when it is `at_us`; the answer is how late, in microseconds."""
        early_us = at_us - self.now_us
        if early_us > 0:
            time.sleep(early_us / 1e6)
        return max(0, self.now_us - at_us)


def _wake_on_time() -> None:
    """Ask Linux not to let this thread sleep up to 50 us longer (prctl(2), PR_SET_TIMERSLACK)."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_TIMERSLACK, SLACK_NS, 0, 0, 0)
