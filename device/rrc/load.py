"""How much work the RRC has, and when it is too much (DECISION R27)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from tickrig.wire.rrc.load import (
    BASE_PCT,
    LINE_FEED_PCT,
    OVERFLOW_PCT,
    PERIOD_PCT,
    REPLY_PCT,
    STATUS_PCT,
    TOO_FAR_BEHIND_PCT,
)

SHOWN_PERIODS: Final = 10
"""`load_pct` is the mean of so many periods."""


@dataclass(slots=True)
class LoadAccount:
    """Work left over from past periods, in per cent of a period.

    Each line feed that arrives costs, whatever becomes of its line, and so does what an overflow
    throws away. Two commands and a status line fit exactly, and then nothing drains; with two OK
    lines they run 30 over, and VR2 stops in the tenth such tick.

    Attributes:
        backlog_pct: work that is left over.
        extra_pct: work that the world adds, in per cent of a period.
        settled: whether a period without traffic changes nothing here.
    """

    backlog_pct: int = 0
    extra_pct: int = 0
    settled: bool = True
    _costs_pct: tuple[int, ...] = (0,) * SHOWN_PERIODS  # of the latest periods

    @property
    def load_pct(self) -> int:
        """Mean work of the latest 100 ms; what is above 100 becomes backlog."""
        costs_pct: int = sum(self._costs_pct)
        return costs_pct // SHOWN_PERIODS

    @property
    def too_far_behind(self) -> bool:
        """Whether the work has piled up so far that the RRC gives up."""
        return self.backlog_pct >= TOO_FAR_BEHIND_PCT

    def spend(
        self, line_feeds: int, overflows: int, replies: int, *, status: bool, extra_pct: int
    ) -> None:
        """Account for one period in which VR2 runs.

        Args:
            line_feeds: that arrived.
            overflows: of the receive buffer, and each 256 bytes more that one threw away.
            replies: lines sent, without those that tell of an overflow and the status line.
            status: whether a status line was sent.
            extra_pct: work that the world adds, in per cent of a period.
        """
        self.extra_pct = extra_pct
        idle_pct = BASE_PCT + extra_pct + (STATUS_PCT if status else 0)
        cost_pct = idle_pct + LINE_FEED_PCT * line_feeds + OVERFLOW_PCT * overflows
        cost_pct += REPLY_PCT * replies
        self.backlog_pct = max(0, self.backlog_pct + cost_pct - PERIOD_PCT)
        self._costs_pct = (*self._costs_pct[1:], cost_pct)
        self.settled = not self.backlog_pct and self._costs_pct == (idle_pct,) * SHOWN_PERIODS
