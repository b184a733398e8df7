"""The evidence of a check: what was on the bus, and when."""

from __future__ import annotations

from collections import deque
from typing import Final

from tickrig.host.canopen.conform.verdict import Direction, Line

FIRST_LINES: Final = 40
LAST_LINES: Final = 160
"""So many lines are kept of a long check."""
LEFT_OUT: Final = "lines left out"
"""Ends the remark in place of the others."""


class Evidence:
    """The lines of one go at a check: the first and the last of many."""

    def __init__(self) -> None:
        self._first: list[Line] = []
        self._last: deque[Line] = deque(maxlen=LAST_LINES)
        self._left_out = 0

    def add(self, at_us: int, direction: Direction, text: str) -> None:
        """Add a line."""
        line = Line(at_us, direction, text)
        if len(self._first) < FIRST_LINES:
            self._first.append(line)
            return
        self._left_out += len(self._last) == LAST_LINES
        self._last.append(line)

    def lines(self) -> tuple[Line, ...]:
        """Return them, with a remark where some were left out."""
        if not self._left_out:
            return (*self._first, *self._last)
        remark = Line(self._last[0].at_us, Direction.REMARK, f"{self._left_out} {LEFT_OUT}")
        return (*self._first, remark, *self._last)
