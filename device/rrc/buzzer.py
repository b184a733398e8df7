"""The RRC's buzzer: patterns of the host, and the automatic alarm below them."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Final

ALARM_TICKS: Final = 50
"""The automatic alarm sounds and rests this long by turns (DECISION R18)."""


@dataclass(slots=True)
class Buzzer:
    """What the buzzer does in each tick.

    Attributes:
        sounding: whether it sounded in the latest tick.
        changes_at: the next tick at which that may change without input.
    """

    sounding: bool = False
    changes_at: int | None = None
    _phases: deque[tuple[int, bool]] = field(default_factory=deque, init=False)  # (end, on)

    def play(self, tick: int, times: tuple[int, ...]) -> None:
        """Play on and off times in ticks, from the next tick on, instead of what plays now.

        A zero time skips its phase; all zero is silence (DECISION R24).
        """
        self._phases.clear()
        end = tick + 1
        self._phases.append((end, False))
        for number, ticks in enumerate(times):
            end += ticks
            if ticks:
                self._phases.append((end, number % 2 == 0))

    def silence(self) -> None:
        """Drop the host's pattern."""
        self._phases.clear()

    def tick(self, tick: int, alarm_since: int | None) -> None:
        """Sound or rest in this tick.

        Args:
            tick: number of the tick.
            alarm_since: tick at which the automatic alarm began, None without one.
        """
        while self._phases and tick >= self._phases[0][0]:
            self._phases.popleft()
        if self._phases:
            self.changes_at, self.sounding = self._phases[0]
        elif alarm_since is not None:
            periods, rest = divmod(tick - alarm_since, ALARM_TICKS)
            self.sounding, self.changes_at = periods % 2 == 0, tick - rest + ALARM_TICKS
        else:
            self.sounding, self.changes_at = False, None
