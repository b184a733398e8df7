"""A timer for periods, based on regular polling."""

from __future__ import annotations

from tickrig.wire.instant import NEVER


class PeriodicTimer:
    """Says when a period is over; after a pause once, not for all that were missed.

    >>> timer = PeriodicTimer(100)
    >>> timer.start(0)
    >>> [timer.advance(now_us) for now_us in (99, 100, 101, 450, 460, 500)]
    [False, True, False, True, False, True]

    Args:
        period_us: the period, 0 for none.

    Attributes:
        due_us: when the next is over; `NEVER` before it was started, and if there is none.
    """

    def __init__(self, period_us: int) -> None:
        self._period_us, self.due_us = period_us, NEVER

    def start(self, now_us: int) -> None:
        """Begin the first period."""
        if self._period_us:
            self.due_us = now_us + self._period_us

    def advance(self, now_us: int) -> bool:
        """Begin the next period if one is over; return whether one was.

        The next is over where it would be without a pause.
        """
        if now_us < self.due_us:
            return False
        self.due_us = now_us - (now_us - self.due_us) % self._period_us + self._period_us
        return True
