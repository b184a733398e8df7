"""A joystick as an RT component."""

from __future__ import annotations

from typing import ClassVar, Final

from tickrig.host.rtc import ExecutionContext, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.host.rtc.motion.geometry import clip
from tickrig.wire.rtc_types.basic import Time
from tickrig.wire.rtc_types.extended_2d import TimedVelocity2D, Velocity2D

FULL_PCT: Final = 100.0


class Joystick(RtComponent):
    """Writes the velocity that its stick asks for, in each period.

    Attributes:
        velocity: OutPort; forward in m/s, to the left in rad/s.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("Joystick", "A stick as a velocity")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        bind = self.configuration.bind
        self.full_v = bind("full_v", 0.5, "x>0", unit="m/s")
        self.full_w = bind("full_w", 1.0, "x>0", unit="rad/s")
        self.velocity = self.add_port(OutPort("velocity", TimedVelocity2D))
        self._forward_pct = self._left_pct = 0.0

    def tilt(self, forward_pct: float, left_pct: float = 0.0) -> None:
        """Hold the stick; -100..100 % each, what is beyond counts as full."""
        self._forward_pct = clip(forward_pct, FULL_PCT)
        self._left_pct = clip(left_pct, FULL_PCT)

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Write where the stick is."""
        v = self._forward_pct / FULL_PCT * self.full_v.value
        w = self._left_pct / FULL_PCT * self.full_w.value
        self.velocity.write(TimedVelocity2D(Time.from_us(ec.now_us), Velocity2D(v, 0.0, w)))
        return ReturnCode.RTC_OK
