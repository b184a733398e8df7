"""How much work the RRC has, and when it is too much (DECISION R27)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

BASE_PCT: Final = 30
STATUS_PCT: Final = 20
LINE_FEED_PCT: Final = 25
REPLY_PCT: Final = 15
OVERFLOW_PCT: Final = 150
PERIOD_PCT: Final = 100
TOO_FAR_BEHIND_PCT: Final = 300


@dataclass(slots=True)
class LoadAccount:
    """Work left over from past periods, in per cent of a period.

    Each line feed that arrives costs, whatever becomes of its line, and so does what an overflow
    throws away. Two commands and a status line fit exactly, and then nothing drains; with two OK
    lines they run 30 over, and VR2 stops in the tenth such tick.
    """

    backlog_pct: int = 0

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
        cost = BASE_PCT + LINE_FEED_PCT * line_feeds + OVERFLOW_PCT * overflows
        cost += REPLY_PCT * replies + extra_pct + (STATUS_PCT if status else 0)
        self.backlog_pct = max(0, self.backlog_pct + cost - PERIOD_PCT)
