"""The seconds of a bus, block after block, as `Load` opens them; needs numpy."""

from __future__ import annotations

import numpy as np

from tickrig.host.canmon.model.columns.columns import Ints
from tickrig.host.canmon.model.traffic.traffic import WINDOW_US, Load, Window


class ColumnLoad:
    """Adds up the bits of each second, counted from the first frame.

    Args:
        first_us: when that came.

    Attributes:
        load: what was added up.
    """

    def __init__(self, first_us: int) -> None:
        self._first_us, self.load = first_us, Load(first_us)

    def take(self, at_us: Ints, bits: Ints) -> list[tuple[Window, int]]:
        """Count frames; return the seconds that are over, each with the row that ended it."""
        if not len(at_us):
            return []
        opened = (self.load.end().at_us - self._first_us) // WINDOW_US
        latest_us = np.maximum.accumulate(at_us - self._first_us)
        seconds = np.maximum(latest_us // WINDOW_US, opened)
        begins = np.flatnonzero(np.diff(seconds, prepend=-1))
        starts_us = (seconds[begins] * WINDOW_US + self._first_us).tolist()
        sums = np.add.reduceat(bits, begins).tolist()
        ended = [self.load.take(*one) for one in zip(starts_us, sums, strict=True)]
        rows = zip(ended, begins.tolist(), strict=True)
        return [(window, row) for window, row in rows if window is not None]
