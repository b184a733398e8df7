"""ObstacleMonitor: how far it is to the nearest thing in the way."""

from __future__ import annotations

from typing import ClassVar

from tickrig.host.motion.ports import newest
from tickrig.host.rtc import ExecutionContext, InPort, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.basic import TimedDouble


class ObstacleMonitor(RtComponent):
    """Looks along the lane that the robot is about to drive through, straight ahead.

    `distance` is counted from its front; `range` stands for nothing in the way. The
    specification only names it; ports and parameters are ours.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("ObstacleMonitor", "Distance to what is in the way")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        bind = self.configuration.bind
        self.front = bind("front", 0.25, "x>=0", unit="m")
        self.half_width = bind("half_width", 0.35, "x>0", unit="m")
        self.range = bind("range", 5.0, "x>0", unit="m")
        self.obstacles = self.add_port(InPort("obstacles", iis.TimedPose2DSeq))
        self.distance = self.add_port(OutPort("distance", TimedDouble))

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Measure the newest points."""
        if (seen := newest(self.obstacles)) is not None:
            self.distance.write(TimedDouble(seen.tm, self._nearest(seen)))
        return ReturnCode.RTC_OK

    def _nearest(self, seen: iis.TimedPose2DSeq) -> float:
        half, front = self.half_width.value, self.front.value
        places = [pose.position for pose in seen.data]
        ways = [place.x - front for place in places if place.x > 0 and abs(place.y) <= half]
        return max(0.0, min([self.range.value, *ways]))
