"""The axes of one node, driven in its period."""

from __future__ import annotations

from typing import Final

from tickrig.host.canopen.dialogue import QueuedScript, Script
from tickrig.host.canopen.master.cia402.drive_driver import DriveDriver
from tickrig.host.canopen.master.cia402.drive_settings import DriveSettings
from tickrig.host.canopen.master.network_slave import NetworkSlave
from tickrig.host.canopen.master.process_image import ProcessImage
from tickrig.host.canopen.periodic_timer import PeriodicTimer
from tickrig.wire.instant import NEVER

AWAITED_US: Final = 3_000_000
"""How long a driver of ros2_canopen waits for the boot-up of its node: three times 1 s."""


class DriveNode:
    """Drives its axes, one after the other, in each period and while the node is booted.

    A period in which the last one's SDO transfers still last is left out.

    Args:
        slave: the node.
        image: what its PDOs carry.
        axes: how each is driven.
        period_us: 0 for once with each SYNC.

    Attributes:
        drivers: one for each axis.
    """

    def __init__(
        self,
        slave: NetworkSlave,
        image: ProcessImage,
        axes: tuple[DriveSettings, ...],
        period_us: int,
    ) -> None:
        self._slave, self._period_us = slave, period_us
        self._lost = slave.lost
        self.drivers = tuple(DriveDriver(axis, image, self._talk) for axis in axes)
        self._timer, self._busy, self._now_us = PeriodicTimer(period_us), False, 0

    @property
    def due_us(self) -> int:
        """When `tick` has something to do."""
        return self._timer.due_us if self._slave.good else NEVER

    @property
    def is_booted(self) -> bool:
        """Whether its node has booted."""
        return self._slave.good

    def is_awaited(self, now_us: int) -> bool:
        """Whether its node boots, and not for so long that nobody waits any more."""
        return self._slave.booting and now_us - self._slave.began_us < AWAITED_US

    def tick(self, now_us: int, *, sync: bool) -> None:
        """Begin a period, if one is due.

        Args:
            now_us: the time.
            sync: a SYNC was sent just now.
        """
        self._now_us = now_us
        if self._lost != self._slave.lost or not self._slave.good:
            self._lost = self._slave.lost
            for driver in self.drivers:
                driver.doubt()
        if not self._slave.good:
            self._timer = PeriodicTimer(self._period_us)
            return
        if self._period_us and self._timer.due_us == NEVER:
            self._timer.start(now_us)
        due = self._timer.advance(now_us) if self._period_us else sync
        if due and not self._busy:
            self._busy = True
            self._talk(QueuedScript("cycle", self._cycle(), self._end, self._end, self._end))

    def _cycle(self) -> Script[None]:
        for driver in self.drivers:
            yield from driver.cycle()

    def _talk(self, script: QueuedScript) -> None:
        self._slave.dialogue.start(self._now_us, script)

    def _end(self, _result: object = None) -> None:
        self._busy = False
