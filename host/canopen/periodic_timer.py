"""A timer for periods that is polled regularly."""

from __future__ import annotations

from tickrig.wire.instant import NEVER


class PeriodicTimer:
    """Timer that must be polled, and reports when a period has ended.

    If the timer was not polled for several periods, it reports only once.

    >>> timer = PeriodicTimer(100)
    >>> timer.start(0)
    >>> [timer.advance(now_us) for now_us in (99, 100, 101, 450, 460, 500)]
    [False, True, False, True, False, True]

    Args:
        period_us: period in microseconds, or 0 for a timer that never ends.

    Attributes:
        due_us: end of the current period, or `NEVER` before the start and if the period is 0.
    """

    def __init__(self, period_us: int) -> None:
        self._period_us, self.due_us = period_us, NEVER

    def start(self, now_us: int) -> None:
        """Start the first period."""
        if self._period_us:
            self.due_us = now_us + self._period_us

    def advance(self, now_us: int) -> bool:
        """Return whether the current period has ended. If so, the next period starts.

        A late call does not shift the ends of later periods.
        """
        if now_us < self.due_us:
            return False
        self.due_us = now_us - (now_us - self.due_us) % self._period_us + self._period_us
        return True
