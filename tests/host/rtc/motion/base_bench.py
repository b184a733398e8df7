"""RefHardRh3 on the line of an emulated base, in virtual time."""

from __future__ import annotations

from math import pi

from tests.host.rtc.motion.port_bench import PERIOD_US, PortBench
from tests.host.spy_link import SpyLink
from tickrig.device.rh3.base import Rh3Base
from tickrig.emulators.rig.faults import FaultyPort
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.byte_faults import BYTE_FAULTS
from tickrig.emulators.serial.rs485_line import Rs485Line
from tickrig.host.links.link import Link
from tickrig.host.rtc.motion.components.ref_hard import RefHardRh3
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.rtc import Velocity2D

COUNTS_PER_TURN = 149_820
"""Gear 74.91, 2000 counts (RH3 functional specification)."""
COUNTS_PER_RAD = COUNTS_PER_TURN / (2 * pi)


class BaseBench(PortBench[RefHardRh3]):
    """The component with a base; each period has a new velocity, as in the chain.

    Attributes:
        base: the emulated base.
        port: its port, for faults.
        link: the component's end of the line, of the latest activation.
    """

    def __init__(self, seed: int = 0, **settings: str) -> None:
        self.base, self.line, self.twist = Rh3Base(), Rs485Line(115_200), (0.0, 0.0)
        self.port = FaultyPort(self.line.a, BYTE_FAULTS, seed)
        self.rig = Rig(Station(self.base, self.port))
        super().__init__(RefHardRh3("RefHardRh3", self._open), **settings)

    def _open(self, url: str) -> Link[bytes]:
        self.link = SpyLink(SimLink(self.rig, self.line.b))
        return self.link

    def period(self, count: int = 1) -> None:
        for _ in range(count):
            v, w = self.twist
            self.feed("InTargetVelocity", iis.TimedVelocity2D(data=Velocity2D(v, 0.0, w)))
            self.rig.run_to(self.manager.now_us + PERIOD_US)
            self.manager.run_to(self.rig.now_us)

    def drive(self, v: float, w: float = 0.0, periods: int = 1) -> None:
        self.twist = (v, w)
        self.period(periods)

    def angles(self) -> tuple[float, float]:
        """Return the wheel angles that were told last."""
        left, right = self.taken("OutWheelAngle")[-1].data
        return left, right

    def restart(self) -> None:
        """Reset, as somebody does who has seen it in Error, and activate."""
        self.manager.reset("RefHardRh3")
        self.period()
        self.activate()
        self.period(7)

    def speeds(self) -> tuple[int, int]:
        """Return the wheel speeds that were ordered last, counts/s."""
        frame = next(data for _, data in reversed(self.link.sent) if data[1] == 0x17)
        left, right = (
            int.from_bytes(frame[place : place + 4], "big", signed=True) for place in (11, 15)
        )
        return left, right
