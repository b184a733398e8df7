"""How much work the RRC has, and when it is too much (DECISION R27)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

BASE_PCT: Final = 30
STATUS_PCT: Final = 20
COMMAND_PCT: Final = 25
REPLY_PCT: Final = 15
PERIOD_PCT: Final = 100
TOO_FAR_BEHIND_PCT: Final = 300


@dataclass(slots=True)
class LoadAccount:
    """Work left over from past periods, in per cent of a period.

    Two commands and a status line fit exactly; with two OK lines they run 30
    over, and VR2 stops in the tenth such tick.
    """

    backlog_pct: int = 0

    @property
    def too_far_behind(self) -> bool:
        """Whether the work has piled up so far that the RRC gives up."""
        return self.backlog_pct >= TOO_FAR_BEHIND_PCT

    def spend(self, commands: int, replies: int, *, status: bool, extra_pct: int) -> None:
        """Account for one period."""
        cost = BASE_PCT + COMMAND_PCT * commands + REPLY_PCT * replies + extra_pct
        cost += STATUS_PCT if status else 0
        self.backlog_pct = max(0, self.backlog_pct + cost - PERIOD_PCT)
