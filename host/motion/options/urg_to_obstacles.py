"""Urg_to_Obstacles: range data become points around the robot."""

from __future__ import annotations

from math import cos, sin
from typing import ClassVar

from tickrig.host.motion.ports import MOST, newest, sound
from tickrig.host.rtc import ExecutionContext, InPort, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.extended_2d import Point2D, Pose2D
from tickrig.wire.rtc_types.sensors import RangeData


class UrgToObstacles(RtComponent):
    """Writes where things are, in the frame of the robot: x ahead of the axle, y to the left.

    The specification only names it (Urg_to_Obstacles); ports and parameters are ours.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("Urg_to_Obstacles", "Points out of range data")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.sensor_x = self.configuration.bind("sensor_x", 0.2, unit="m")
        self.ranges = self.add_port(InPort("ranges", RangeData))
        self.obstacles = self.add_port(OutPort("obstacles", iis.TimedPose2DSeq))

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Take the newest scan."""
        if (scan := newest(self.ranges)) is not None:
            points = tuple(self._points(scan))
            self.obstacles.write(iis.TimedPose2DSeq(scan.tm, data=points))
        return ReturnCode.RTC_OK

    def _points(self, scan: RangeData) -> list[Pose2D]:
        first, step, ahead = scan.config.minAngle, scan.config.angularRes, self.sensor_x.value
        if not sound(first, step):
            return []
        seen = [(first + n * step, d) for n, d in enumerate(scan.ranges) if 0 < d <= MOST]
        return [Pose2D(Point2D(ahead + d * cos(angle), d * sin(angle))) for angle, d in seen]
