"""The clocks of verbs: of a source between its frames, and of what is sent."""

from __future__ import annotations

import ctypes
import sys
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from tickrig.host.canmon.model.frames.record import Record

if TYPE_CHECKING:
    from tickrig.host.canmon.model.frames.record import LineRecord


class Stopwatch:
    """Goes on from the latest frame's time by the clock of this machine.

    The stamps of a driver need not be those of our clock: only their differences count.

    Attributes:
        latest_us: when the latest frame came.
    """

    def __init__(self) -> None:
        self.latest_us, self._since_us = 0, _now_us()

    def take(self, records: Sequence[Record | LineRecord]) -> None:
        """Go on from the last of these frames."""
        if records:
            self.latest_us, self._since_us = records[-1].at_us, _now_us()

    @property
    def now_us(self) -> int:
        """The time at the source."""
        return self.latest_us + _now_us() - self._since_us


def _now_us() -> int:
    return time.monotonic_ns() // 1_000


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
