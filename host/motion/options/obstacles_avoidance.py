"""ObstaclesAvoidance: stop before what is in the way, go on when it has gone."""

from __future__ import annotations

from typing import ClassVar, Final

from tickrig.host.motion.geometry import Twist
from tickrig.host.motion.limiter import Limits
from tickrig.host.motion.options.watched_distance import WatchedDistance
from tickrig.host.motion.ports import newest, sound
from tickrig.host.rtc import ExecutionContext, InPort, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.basic import Time, TimedDouble
from tickrig.wire.rtc_types.extended_2d import Velocity2D

ANY: Final = 1e9
"""A limit that limits nothing."""


class ObstaclesAvoidance(RtComponent):
    """Stands between PathFollower and base: stop and go, no way around.

    Forward motion ends while something is nearer than `stop_distance`, and goes on when it
    is farther than `go_distance`; both with `max_acc_v`. Turning on the spot and going back
    always pass, and without a velocity for `timeout` it says nothing, so that the base's own
    watchdog acts. The specification only names it; ports and parameters are ours.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("ObstaclesAvoidance", "Stop and go")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        bind = self.configuration.bind
        self.stop_distance = bind("stop_distance", 0.5, "x>=0", unit="m")
        self.go_distance = bind("go_distance", 0.7, "x>=0", unit="m")
        self.timeout = bind("timeout", 0.5, "x>0", unit="s")
        self.max_acc_v = bind("max_acc_v", 0.3, "x>0", unit="m/s2")
        self.arriving = self.add_port(InPort("InTargetVelocity", iis.TimedVelocity2D))
        self.distance = self.add_port(InPort("distance", TimedDouble))
        self.leaving = self.add_port(OutPort("OutTargetVelocity", iis.TimedVelocity2D))
        self._watched = WatchedDistance(self.distance)
        self._before = Twist()

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Begin at standstill, with the way blocked."""
        self._watched.forget()
        self._before = Twist()
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Pass the velocity on, as far as the way is free."""
        free = self._watched.look(
            ec, self.stop_distance.value, self.go_distance.value, self.timeout.value
        )
        if (latest := newest(self.arriving)) is not None:
            data = latest.data
            self._pass(ec, Twist(data.vx, data.va) if sound(data.vx, data.va) else Twist(), free)
        return ReturnCode.RTC_OK

    def _pass(self, ec: ExecutionContext, wanted: Twist, free: bool) -> None:
        if not free and wanted.v > 0:
            wanted = Twist()
        step = self.max_acc_v.value * ec.period_us / 1e6
        self._before = Limits(ANY, ANY, step, ANY).smooth(wanted, self._before)
        data = Velocity2D(self._before.v, 0.0, self._before.w)
        self.leaving.write(iis.TimedVelocity2D(Time.from_us(ec.now_us), data=data))
