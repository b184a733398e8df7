"""A timer of a device as execution context: RTC-Lite type 22h, DeviceRTC."""

from __future__ import annotations

from dataclasses import dataclass, field

from tickrig.wire.instant import NEVER


@dataclass(slots=True)
class Timer:
    """Counts periods from its start; it does not drift, and a period that is missed is left out.

    Attributes:
        rate_hz: periods a second; a new rate holds from the next start.
        due_us: when the next period ends, `NEVER` while it stands still.
    """

    rate_hz: int
    due_us: int = field(default=NEVER, init=False)
    _start_us: int = field(default=0, init=False)

    def start(self, now_us: int) -> None:
        """Begin the first period."""
        self._start_us = now_us
        self._note_due(now_us)

    def stop(self) -> None:
        """Stand still."""
        self.due_us = NEVER

    def run(self, now_us: int) -> None:
        """Run or go on running."""
        if self.due_us == NEVER:
            self.start(now_us)

    def elapsed(self, now_us: int) -> bool:
        """Whether a period has ended; the next one is that which ends after `now_us`."""
        if now_us < self.due_us:
            return False
        self._note_due(now_us)
        return True

    def _note_due(self, now_us: int) -> None:
        """Look for the first end of a period after `now_us`."""
        periods = (now_us - self._start_us) * self.rate_hz // 1_000_000 + 1
        self.due_us = self._start_us - -periods * 1_000_000 // self.rate_hz
