"""A condition that has to hold for a time: windows and thresholds (CiA 402-2)."""

from __future__ import annotations


class Window:
    """Says whether something has been inside for long enough.

    Attributes:
        waiting: it is inside, and the time runs.
    """

    __slots__ = ("_since_us", "waiting")

    def __init__(self) -> None:
        self.waiting = False
        self._since_us: int | None = None

    def holds(self, now_us: int, inside: bool, for_us: int) -> bool:
        """Take what is so now; say whether it has been inside for `for_us`."""
        if not inside:
            self._since_us, self.waiting = None, False
            return False
        if self._since_us is None:
            self._since_us = now_us
        self.waiting = now_us - self._since_us < for_us
        return not self.waiting
