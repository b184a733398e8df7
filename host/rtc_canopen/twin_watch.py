"""Find out by their heartbeats that two nodes have one node-ID."""

from __future__ import annotations

from typing import Final

from tickrig.host.link import NEVER
from tickrig.wire.canopen.nmt import NmtState

SURE: Final = 5
"""Sum of short intervals, each 2, and of others, each -1, at which there are two."""


class TwinWatch:
    """Listens to the error control messages of a node-ID.

    Two nodes at once show by intervals that are too short. A node that boots while
    another of its node-ID is there shows by a heartbeat of the other: it comes too
    soon after the boot-up, or tells another state than Pre-operational.

    Not seen: nodes that send the very same frames at the very same time.

    Args:
        period_us: producer heartbeat time.

    Attributes:
        sure_us: when a node that has booted has no twin, if there was no sign of one.
    """

    def __init__(self, period_us: int) -> None:
        self._period_us, self._count = period_us, 0
        self._booted_us = self._heard_us = -period_us
        self.sure_us = NEVER

    def forget(self) -> None:
        """Begin anew: a node that was away sends at once what it could not."""
        self._count = 0

    def hear(self, now_us: int, state: NmtState, *, listening: bool) -> bool:
        """Take a boot-up or heartbeat; True if it shows that there are two nodes.

        Args:
            now_us: when it came.
            state: what it says.
            listening: whether nothing was said to the node since it booted.
        """
        before_us, self._heard_us = self._heard_us, now_us
        if state is NmtState.INITIALISING:
            self._booted_us, self._count = now_us, 0
            self.sure_us = now_us + self._period_us * 5 // 4
            return False
        if listening:
            soon = now_us - self._booted_us < self._period_us * 3 // 4
            return soon or state is not NmtState.PRE_OPERATIONAL
        short = now_us - before_us < self._period_us // 2
        self._count = max(0, self._count + (2 if short else -1))
        return self._count >= SURE
