"""When the RRC's watchdog has to be renewed."""

from __future__ import annotations

from typing import Final

from tickrig.wire.instant import NEVER

PERIOD_US: Final = 10_000
"""The RRC's internal period; renewing more often gains nothing."""

RENEWALS: Final = 3
"""The watchdog is renewed this many times in its time: one renewal may be lost."""


class KeepAlive:
    """The deadline of the next renewal.

    Every command that is not refused renews the watchdog, so a renewal of its
    own is due only when nothing else was sent for a third of the time.
    """

    def __init__(self) -> None:
        self._sent_us = 0

    def note_sent(self, now_us: int) -> None:
        """Note a command: the time begins again."""
        self._sent_us = now_us

    def note_refused(self) -> None:
        """Note a refusal: that command renewed nothing, so a renewal is due at once."""
        self._sent_us = -NEVER

    def due_us(self, watchdog_10ms: int) -> int:
        """Return when to renew a watchdog of this time; `NEVER` if it is off."""
        if not watchdog_10ms:
            return NEVER
        return self._sent_us + max(PERIOD_US, watchdog_10ms * 10_000 // RENEWALS)
