"""Experiment 1 of the paper: ConsoleIn, LiteA, LiteB, ConsoleOut, joined and Active."""

from __future__ import annotations

from tests.host.rtc.lite.bench import Bench
from tickrig.device.rtc_lite.component import LiteA, LiteB
from tickrig.host.rtc.components import ConsoleIn, ConsoleOut
from tickrig.host.rtc.lite import ProxySettings

JOINTS = (
    ("ConsoleIn0.out", "LiteA0.in"),
    ("LiteA0.out", "LiteB0.in"),
    ("LiteB0.out", "ConsoleOut0.in"),
)
ALL = ("ConsoleIn0", "LiteA0", "LiteB0", "ConsoleOut0")


class Experiment(Bench):
    """The chain in virtual time, at 10 ticks per period."""

    def __init__(self, *, rediscover: bool = False) -> None:
        super().__init__(LiteA, LiteB)
        settings = ProxySettings(rediscover=rediscover)
        self.source = self.manager.add(ConsoleIn("ConsoleIn0"), context=self.context)
        self.lite_a = self.attach(0, "LiteA", settings)
        self.lite_b = self.attach(1, "LiteB", settings)
        self.sink = self.manager.add(ConsoleOut("ConsoleOut0"), context=self.context)
        self.context.start()
        for joint in JOINTS:
            self.manager.connect(*joint)

    def activate(self) -> None:
        """Activate all, and run the period in which that happens."""
        self.manager.activate(*ALL)
        self.run_for(PERIOD_AND_MORE_US)

    @property
    def numbers(self) -> list[int]:
        """What came out of the chain."""
        return [value.data for value in self.sink.received]


PERIOD_AND_MORE_US = 150_000
