"""Find out by their heartbeats that two nodes have one node-ID."""

from __future__ import annotations

from typing import Final

from tickrig.host.link import NEVER
from tickrig.wire.canopen.nmt import NmtState

WINDOW: Final = 10
"""Producer heartbeat times in which heartbeats are counted."""

TOO_MANY: Final = 16
"""So many are of two nodes: one sends 10, and some that came late are read at once."""

PAUSE: Final = 3
"""Producer heartbeat times of silence, after which late ones may come."""


class TwinWatch:
    """Listens to the error control messages of a node-ID.

    Two nodes at once show by too many heartbeats; their times say little, as a host
    that was busy reads several at once. A node that boots while another of its
    node-ID is there shows by a heartbeat of the other: it comes too soon after the
    boot-up, or tells another state than Pre-operational.

    Not seen: nodes that send the very same frames at the very same time.

    Args:
        period_us: producer heartbeat time.

    Attributes:
        sure_us: when a node that has booted has no twin, if there was no sign of one.
    """

    def __init__(self, period_us: int) -> None:
        self._period_us, self._count = period_us, 0
        self._booted_us = self._begin_us = self._heard_us = 0
        self.sure_us = NEVER

    def forget(self, now_us: int) -> None:
        """Begin anew, behind what is heard at once after a pause of the node or of ours."""
        self._begin_us, self._count = now_us + self._period_us, 0

    def hear(self, now_us: int, state: NmtState, *, listening: bool) -> bool:
        """Take a boot-up or heartbeat; True if it shows that there are two nodes.

        Args:
            now_us: when it came.
            state: what it says.
            listening: whether nothing was said to the node since it booted.
        """
        if now_us - self._heard_us > PAUSE * self._period_us:
            self.forget(now_us)
        self._heard_us = now_us
        if state is NmtState.INITIALISING:
            self._booted_us = now_us
            self.sure_us = now_us + self._period_us * 5 // 4
            return False
        if listening:
            soon = now_us - self._booted_us < self._period_us * 3 // 4
            return soon or state is not NmtState.PRE_OPERATIONAL
        return self._too_many(now_us)

    def _too_many(self, now_us: int) -> bool:
        if now_us - self._begin_us >= WINDOW * self._period_us:
            self._begin_us, self._count = now_us, 0
        self._count += now_us >= self._begin_us
        return self._count >= TOO_MANY
