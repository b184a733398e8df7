"""What traffic costs the RRC, and how much of it a host may send (DECISION R27).

Costs are in per cent of the RRC's period of 10 ms. Above 100 % it falls behind, and 300 % behind
stops VR2. At exactly 100 % nothing drains: a host whose clock is 0.1 % fast stops VR2 after 60 s,
so a host takes at most `SAFE_PCT`.
"""

from __future__ import annotations

from typing import Final

BASE_PCT: Final = 30
STATUS_PCT: Final = 20
LINE_FEED_PCT: Final = 25
REPLY_PCT: Final = 15
OVERFLOW_PCT: Final = 150
PERIOD_PCT: Final = 100
TOO_FAR_BEHIND_PCT: Final = 300
SAFE_PCT: Final = 90

PERIOD_US: Final = 10_000
PERIODS_A_SECOND: Final = 100

LINES_A_PERIOD: Final = 2
"""Lines worked on in a period while VR2 runs; elsewhere one in two periods."""

PACE_WITHOUT_VR2: Final = PERIODS_A_SECOND // 2 * SAFE_PCT // PERIOD_PCT
"""Lines a second that a host may send while VR2 does not run."""


def pace_lines_s(*, stable: bool, status: bool, extra_pct: int = 0) -> int:
    """Return how many lines a second a host may send while VR2 runs.

    Args:
        stable: whether OK lines are left out (stablemode).
        status: whether a status line is sent in each period.
        extra_pct: other work of the RRC, in per cent of a period.

    >>> pace_lines_s(stable=True, status=True), pace_lines_s(stable=False, status=True)
    (160, 100)
    """
    left_pct = SAFE_PCT - BASE_PCT - extra_pct - (STATUS_PCT if status else 0)
    line_pct = LINE_FEED_PCT + (0 if stable else REPLY_PCT)
    most = LINES_A_PERIOD * PERIODS_A_SECOND * SAFE_PCT // PERIOD_PCT
    return max(0, min(most, left_pct * PERIODS_A_SECOND // line_pct))
