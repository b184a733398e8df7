"""Refusals in a row, and when they are too many."""

from __future__ import annotations

from collections import Counter
from enum import Enum


class OnRefusals(Enum):
    """What the client does after too many refusals in a row (RRC manual, notes)."""

    POWER_OFF = "poweroff"  # send poweroff; renew the watchdog no more
    WATCHDOG = "watchdog"  # send nothing, so that the watchdog trips; poweroff if none is set


class Refusals:
    """Counts for each command how many times in a row it was refused.

    Each command has a row of its own: a `beep` that works in between must not
    hide that every `output` is refused.

    Args:
        limit: how many in a row are too many.

    Attributes:
        stopped: reason of the last refusal once there were too many, else None.
    """

    def __init__(self, limit: int) -> None:
        if limit < 1:
            raise ValueError(f"{limit} refusals: at least 1 must be allowed to come")
        self.limit = limit
        self.stopped: str | None = None
        self._rows: Counter[str] = Counter()

    def accepted(self, name: str) -> None:
        """Note a command that was carried out: its row ends."""
        del self._rows[name]

    def refused(self, name: str, reason: str) -> bool:
        """Note a refusal; True if with this one there are too many."""
        self._rows[name] += 1
        if self.stopped is not None or self._rows[name] < self.limit:
            return False
        self.stopped = reason
        return True

    def clear(self) -> None:
        """Begin again."""
        self._rows.clear()
        self.stopped = None
