"""FourX: four driven wheels, a motor core unit each (NEDO report, 3.4.43.3; ours: K20)."""

from __future__ import annotations

from math import radians
from typing import ClassVar, Final

from tickrig.host.rtc import ExecutionContext, InPort, ModuleSpec, OutPort, ReturnCode
from tickrig.host.rtc.canopen.robots.wheeled_base import WheeledBase
from tickrig.host.rtc.motion.ports import read_newest
from tickrig.wire.rtc_types.basic import Time, TimedShort

WHEELS: Final = ("fl", "rl", "fr", "rr")
"""Front and rear left, front and rear right."""

FULL: Final = 32_767
"""What stands for the full scale, 2010h:02."""


class FourX(WheeledBase):
    """Steers as a tank does, in velocity mode; the pose is added up from measured speeds.

    Where no speed arrives, the last one is thought to last.

    Attributes:
        references: OutPorts `fl_reference` and so on, for 6411h:01.
        speeds: InPorts `fl_speed` and so on, of 6401h:02.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("FourX", "Base on four wheels", category="RTC-CANopen")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name, radius_m=0.1, tread_m=0.4)
        self.full_scale = self.configuration.bind("full_scale", 360.0, "x>0", unit="deg/s")
        self.references = tuple(
            self.add_port(OutPort(f"{wheel}_reference", TimedShort)) for wheel in WHEELS
        )
        self.speeds = tuple(self.add_port(InPort(f"{wheel}_speed", TimedShort)) for wheel in WHEELS)
        self._latest = [0.0] * len(WHEELS)

    @property
    def fastest(self) -> float:
        """The speed that a wheel can be told, rad/s."""
        return radians(self.full_scale.value)

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Begin at zero, standing."""
        self._latest = [0.0] * len(WHEELS)
        for port in self.speeds:
            port.clear()
        return super().on_activated(ec)

    def command(self, tm: Time, left: float, right: float) -> None:
        """Write the references."""
        for port, speed in zip(self.references, (left, left, right, right), strict=True):
            port.write(TimedShort(tm, round(speed / self.fastest * FULL)))

    def turned(self, since_s: float) -> tuple[float, float]:
        """Return how far the wheels turned at the speeds that were measured last, in the mean."""
        for place, port in enumerate(self.speeds):
            if (speed := read_newest(port)) is not None:
                self._latest[place] = speed.data / FULL * self.fastest
        front_left, rear_left, front_right, rear_right = self._latest
        return (front_left + rear_left) / 2 * since_s, (front_right + rear_right) / 2 * since_s
