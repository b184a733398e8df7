"""Heartbeat producer (CiA 301, error control services; object 1017h)."""

from __future__ import annotations

from tickrig.device.canopen.service import Service
from tickrig.device.core import NEVER
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID


class HeartbeatProducer(Service):
    """Sends the NMT state each producer heartbeat time.

    The boot-up message counts as the first heartbeat. A time that is written
    begins anew, so the first one comes after one period.
    """

    def start(self) -> None:
        """Take the object into service."""
        self._due_us = NEVER
        self._period = self.node.dictionary.find(0x1017)
        if self._period is not None:
            self._period.written = self._begin

    def booted(self) -> None:
        """Count from the boot-up message."""
        self._begin()

    def _begin(self) -> None:
        period_us = self._period.number * 1_000 if self._period is not None else 0
        self._due_us = self.node.now_us + period_us if period_us else NEVER
        self.schedule(self._due_us)

    def tick(self, now_us: int) -> None:
        """Send one heartbeat."""
        node = self.node
        node.send(ERROR_CONTROL_COB_ID + node.node_id, bytes([node.state]))
        if self._period is not None:
            self._due_us += self._period.number * 1_000
            self.schedule(self._due_us)
