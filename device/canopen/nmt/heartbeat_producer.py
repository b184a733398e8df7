"""Heartbeat producer (CiA 301, error control services; object 1017h)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tickrig.device.canopen.core.service import Service
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID, NmtState
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.device.canopen.core.entry import Entry
    from tickrig.device.canopen.core.slave import CanopenSlave


class HeartbeatProducer(Service):
    """Sends the NMT state each producer heartbeat time.

    The boot-up message counts as the first heartbeat. A time that is written,
    over the bus or from the inside, begins anew, so the first one comes after
    one period.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self._period = node.dictionary.find(0x1017)
        self._due_us = NEVER
        self._begins = False
        if self._period is not None:
            self._period.watch(self._changed)
            self._period.written = self._changed  # the same value, too, begins anew

    def booted(self) -> None:
        """Count from the boot-up message."""
        self._begin()

    def tick(self, now_us: int) -> None:
        """Begin to count, or send one heartbeat."""
        node = self.node
        period_us = 1_000 * self._period.number if self._period is not None else 0
        if self._begins:
            self._due_us = now_us
        else:
            node.send(ERROR_CONTROL_COB_ID + node.node_id, bytes([node.state]))
        self._begins = False
        self._due_us += period_us
        self.schedule(self._due_us if period_us else NEVER)

    def _changed(self, entry: Entry) -> None:
        self._begin()

    def _begin(self) -> None:
        """Count from the next tick on, or from this one; not before the boot-up message."""
        if self.node.state is not NmtState.INITIALISING:
            self._begins = True
            self.schedule(0)
