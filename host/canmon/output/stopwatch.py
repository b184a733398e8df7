"""The time of a source between its frames."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

from tickrig.host.monitor.frames.heard import Heard

if TYPE_CHECKING:
    from tickrig.host.monitor.decode.serial.heard_line import HeardLine


class Stopwatch:
    """Goes on from the latest frame's time by the clock of this machine.

    The stamps of a driver need not be those of our clock: only their differences count.

    Attributes:
        latest_us: when the latest frame came.
    """

    def __init__(self) -> None:
        self.latest_us, self._since_us = 0, _now_us()

    def take(self, heards: Sequence[Heard | HeardLine]) -> None:
        """Go on from the last of these frames."""
        if heards:
            self.latest_us, self._since_us = heards[-1].at_us, _now_us()

    @property
    def now_us(self) -> int:
        """The time at the source."""
        return self.latest_us + _now_us() - self._since_us


def _now_us() -> int:
    return time.monotonic_ns() // 1_000
