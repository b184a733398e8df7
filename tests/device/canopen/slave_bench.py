"""A slave alone with the test: frames in, frames out, one call a tick."""

from __future__ import annotations

from tickrig.device.canopen.slave import TICK_US, CanopenSlave
from tickrig.wire.can import CanFrame, Frames


def frames(*texts: str) -> Frames:
    """Read frames in candump's notation."""
    return tuple(CanFrame.parse(text) for text in texts)


class Bus:
    """Steps one slave, tick by tick.

    Attributes:
        now_us: time of the latest tick.
    """

    def __init__(self, slave: CanopenSlave) -> None:
        self.slave, self.now_us = slave, 0

    def step(self, *texts: str) -> list[str]:
        """Run one tick with these frames; return what was sent."""
        self.now_us += TICK_US
        return [str(frame) for frame in self.slave.tick(self.now_us, frames(*texts))]

    def run(self, ticks: int) -> list[str]:
        """Run ticks without traffic to the slave."""
        return [text for _ in range(ticks) for text in self.step()]
