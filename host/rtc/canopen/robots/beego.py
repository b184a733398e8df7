"""beego: a differential drive on two EPOS (NEDO report, 3.4.43.3; ours: K21)."""

from __future__ import annotations

from math import tau
from typing import ClassVar, Final

from tickrig.host.rtc import ExecutionContext, InPort, ModuleSpec, OutPort, ReturnCode
from tickrig.host.rtc.canopen.robots.wheeled_base import WheeledBase
from tickrig.host.rtc.motion.ports import read_newest
from tickrig.wire.rtc_types.basic import Time, TimedLong

TURN: Final = 2**32
"""Counts after which a position begins again (6064h is INTEGER32)."""

FASTEST_RPM: Final = 8_000


class Beego(WheeledBase):
    """Tells two drives their velocity in rpm of the motor, and reads their positions in counts.

    The sizes of its makers are not at hand: those in the configuration are ours, as in
    `examples/rigs/beego.toml`.

    Attributes:
        speeds: OutPorts `left_speed`, `right_speed`, for 60FFh.
        positions: InPorts `left_position`, `right_position`, of 6064h.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("Beego", "Base on two EPOS", category="RTC-CANopen")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name, radius_m=0.078, tread_m=0.33)
        self.gear = self.configuration.bind("gear", 51.0, "x>0")
        self.counts = self.configuration.bind("counts", 2_000, "x>0")  # a turn of the motor
        self.speeds = tuple(
            self.add_port(OutPort(f"{side}_speed", TimedLong)) for side in ("left", "right")
        )
        self.positions = tuple(
            self.add_port(InPort(f"{side}_position", TimedLong)) for side in ("left", "right")
        )
        self._counts: list[int | None] = [None, None]

    @property
    def fastest(self) -> float:
        """The speed that a wheel can be told, rad/s."""
        return FASTEST_RPM / 60 * tau / self.gear.value

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Begin at zero, wherever the drives are."""
        self._counts = [None, None]
        for port in self.positions:
            port.clear()
        return super().on_activated(ec)

    def command(self, tm: Time, left: float, right: float) -> None:
        """Write the speeds in rpm."""
        for port, speed in zip(self.speeds, (left, right), strict=True):
            port.write(TimedLong(tm, round(speed * self.gear.value * 60 / tau)))

    def turned(self, since_s: float) -> tuple[float, float]:
        """Return how far the positions have moved."""
        left, right = (self._moved(side) for side in (0, 1))
        return left, right

    def _moved(self, side: int) -> float:
        if (position := read_newest(self.positions[side])) is None:
            return 0.0
        before, self._counts[side] = self._counts[side], position.data
        if before is None:
            return 0.0
        counts = (position.data - before + TURN // 2) % TURN - TURN // 2
        return counts / (self.counts.value * self.gear.value) * tau
