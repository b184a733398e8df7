"""A rotation shim and regulated pure pursuit, as a peer of the chain on the same base.

Written from the papers and the documented parameters of Nav2 (Macenski et al., Regulated
Pure Pursuit for Robot Path Tracking, 2023; rh3-control, what users expect), within the
limits of the chain: 0.3 m/s, 0.3 rad/s, 0.3 m/s2, 5 rad/s2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import copysign, cos, hypot, sin, sqrt
from typing import ClassVar, Final

from tickrig.host.rtc import ExecutionContext, InPort, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.host.rtc.motion.control_laws import VelocityLimits
from tickrig.host.rtc.motion.geometry import Pose, Twist, wrap
from tickrig.host.rtc.motion.ports import read_newest, to_pose
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.rtc import Velocity2D

LOOKAHEAD_M: Final = 0.6
MIN_RADIUS_M: Final = 0.9
APPROACH_M: Final = 0.6
APPROACH_MIN_M_S: Final = 0.05
ROTATE_RAD: Final = 0.785
ANGULAR_ACCELERATION: Final = 3.2
SPACING_M: Final = 0.05
LIMITS: Final = VelocityLimits(0.3, 0.3, 0.006, 0.1)


@dataclass(frozen=True)
class Tolerance:
    """When a goal is reached; Nav2 has 0.25 m and 0.25 rad."""

    place_m: float = 0.25
    heading_rad: float = 0.25


def dotted(points: Sequence[Pose]) -> list[Pose]:
    """Return points each 5 cm on the lines between points, with the headings of the lines."""
    dots = []
    for a, b in pairwise(points):
        count = max(1, round(a.distance(b) / SPACING_M))
        shares = (n / count for n in range(count + 1))
        dots += [Pose(a.x + (b.x - a.x) * s, a.y + (b.y - a.y) * s, a.bearing(b)) for s in shares]
    return dots


class Pursuit(RtComponent):
    """Follows a path by a carrot on it, and turns on the spot where that is far to the side."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("Pursuit")

    def __init__(self, points: Sequence[Pose], tolerance: Tolerance) -> None:
        super().__init__("Pursuit")
        self.position = self.add_port(InPort("position", iis.TimedPose2D))
        self.velocity = self.add_port(OutPort("velocity", iis.TimedVelocity2D))
        self._dots, self._goal, self._tolerance = dotted(points), points[-1], tolerance
        self.twist, self.reached, self._at_goal = Twist(), False, False

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Command the velocity of this period."""
        if (latest := read_newest(self.position)) is not None and (pose := to_pose(latest.data)):
            self.twist = LIMITS.smooth(self._wanted(pose), self.twist)
            data = Velocity2D(self.twist.v, 0.0, self.twist.w)
            self.velocity.write(iis.TimedVelocity2D(data=data))
        return ReturnCode.RTC_OK

    def _wanted(self, pose: Pose) -> Twist:
        self._at_goal |= len(self._dots) < 8 and pose.distance(self._goal) < self._tolerance.place_m
        if self._at_goal:
            off = wrap(self._goal.heading - pose.heading)
            self.reached |= abs(off) < self._tolerance.heading_rad
            return Twist() if self.reached else _turn(off)
        near = min(range(min(40, len(self._dots))), key=lambda n: pose.distance(self._dots[n]))
        del self._dots[:near]
        return self._pursue(pose)

    def _pursue(self, pose: Pose) -> Twist:
        ahead = (dot for dot in self._dots if pose.distance(dot) >= LOOKAHEAD_M)
        carrot = next(ahead, self._dots[-1])
        off = wrap(pose.bearing(carrot) - pose.heading)
        if abs(off) > ROTATE_RAD:
            return _turn(off)
        curvature = 2 * pose.left(carrot) / max(1e-6, pose.distance(carrot) ** 2)
        v = LIMITS.v * min(1.0, 1 / max(1e-6, abs(curvature)) / MIN_RADIUS_M)
        left_m = pose.distance(self._dots[0]) + SPACING_M * (len(self._dots) - 1)
        v = max(APPROACH_MIN_M_S, v * min(1.0, left_m / APPROACH_M))
        return Twist(v, v * curvature)


def _turn(off: float) -> Twist:
    return Twist(0.0, copysign(min(1.8, sqrt(2 * ANGULAR_ACCELERATION * abs(off))), off))


def beside(points: Sequence[Pose], pose: Pose) -> float:
    """Return the distance of a place from the nearest of the lines between points."""
    return min(_from_line(a, b, pose) for a, b in pairwise(points))


def _from_line(a: Pose, b: Pose, pose: Pose) -> float:
    line = Pose(a.x, a.y, a.bearing(b))
    along = min(max(line.along(pose), 0.0), a.distance(b))
    return hypot(pose.x - a.x - along * cos(line.heading), pose.y - a.y - along * sin(line.heading))
