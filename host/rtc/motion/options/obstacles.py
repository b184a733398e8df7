"""Components from range data to a stopping base: points, the nearest obstacle, two reactions."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import cos, sin
from typing import ClassVar, Final

from tickrig.host.rtc import (
    Consumer,
    ExecutionContext,
    InPort,
    Manager,
    ModuleSpec,
    OutPort,
    ReturnCode,
    RtComponent,
    ServicePort,
)
from tickrig.host.rtc.motion.chain import MotionChain
from tickrig.host.rtc.motion.components.ref_hard import Opener, RefHard
from tickrig.host.rtc.motion.control_laws import VelocityLimits
from tickrig.host.rtc.motion.geometry import Twist
from tickrig.host.rtc.motion.options.lrf_capture_urg import LrfCaptureUrg
from tickrig.host.rtc.motion.ports import MOST, plausible, read_newest, write_velocity
from tickrig.host.text.log import log_of
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.rtc import Point2D, Pose2D, RangeData, TimedDouble

_ANY: Final = 1e9
"""Value of a limit that has no effect."""

_LOG: Final = log_of(__name__)


class UrgToObstacles(RtComponent):
    """Component that converts laser scans to obstacle positions in the coordinates of a robot.

    The x axis points ahead from the axle, and the y axis points to the left. The RH3 specification
    gives only the name of this component (Urg_to_Obstacles), so its ports and parameters are
    additions of Tickrig.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("Urg_to_Obstacles", "Points out of range data")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.sensor_x = self.configuration.bind("sensor_x", 0.2, unit="m")
        self.ranges = self.add_port(InPort("ranges", RangeData))
        self.obstacles = self.add_port(OutPort("obstacles", iis.TimedPose2DSeq))

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Convert the newest scan."""
        if (scan := read_newest(self.ranges)) is not None:
            points = tuple(self._points(scan))
            self.obstacles.write(iis.TimedPose2DSeq(scan.tm, data=points))
        return ReturnCode.RTC_OK

    def _points(self, scan: RangeData) -> list[Pose2D]:
        first, step, ahead = scan.config.minAngle, scan.config.angularRes, self.sensor_x.value
        if not plausible(first, step):
            return []
        ways = zip(_directions(first, step, len(scan.ranges)), scan.ranges, strict=True)
        return [Pose2D(Point2D(ahead + d * x, d * y)) for (x, y), d in ways if 0 < d <= MOST]


@lru_cache(maxsize=8)  # each scan has the same: a third of the time of its points
def _directions(first: float, step: float, count: int) -> Sequence[tuple[float, float]]:
    """Return the directions of the beams of a scan as unit vectors."""
    angles = [first + n * step for n in range(count)]
    return tuple((cos(angle), sin(angle)) for angle in angles)


class ObstacleMonitor(RtComponent):
    """Component that measures the distance to the nearest obstacle straight ahead of a robot.

    It considers obstacles within `half_width` of the middle line. The port `distance` has the
    distance from the front of the robot, or the value of the parameter `range` if the lane is free.
    The RH3 specification gives only the name of this component, so its ports and parameters are
    additions of Tickrig.
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
        """Evaluate the newest points."""
        if (seen := read_newest(self.obstacles)) is not None:
            self.distance.write(TimedDouble(seen.tm, self._nearest(seen)))
        return ReturnCode.RTC_OK

    def _nearest(self, seen: iis.TimedPose2DSeq) -> float:
        half, front = self.half_width.value, self.front.value
        places = [pose.position for pose in seen.data]
        ways = [place.x - front for place in places if -half <= place.y <= half and place.x > 0]
        return max(0.0, min([self.range.value, *ways]))


class _WatchedDistance:
    """A distance with hysteresis. The lane is blocked below one value, and free above another.

    Args:
        component: component that gets the port `distance` and the parameters.
        stop_m: default of `stop_distance`.
        go_m: default of `go_distance`.

    Attributes:
        free: whether the lane is free, or False before the first distance.
    """

    def __init__(self, component: RtComponent, stop_m: float, go_m: float) -> None:
        bind = component.configuration.bind
        self._stop = bind("stop_distance", stop_m, "x>=0", unit="m")
        self._go = bind("go_distance", go_m, "x>=0", unit="m")
        self._timeout = bind("timeout", 0.5, "x>0", unit="s")
        self._port = component.add_port(InPort("distance", TimedDouble))
        self.free, self._received_us = False, 0

    def forget(self) -> None:
        """Forget the last distance. The lane then counts as blocked."""
        self._port.clear()
        self.free, self._received_us = False, 0

    def update(self, ec: ExecutionContext) -> bool:
        """Read the newest distance. Return whether the lane is free."""
        latest = read_newest(self._port)
        if latest is not None and plausible(latest.data):
            self._received_us = ec.now_us
            self.free = latest.data > (self._stop if self.free else self._go).value
        elif ec.now_us - self._received_us > self._timeout.value * 1e6:
            self.free = False
        return self.free


class ObstaclesAvoidance(RtComponent):
    """Component that stops a cart before obstacles. Connect it between PathFollower and the base.

    The component stops the cart, but does not plan a way around. Forward motion ends when an
    obstacle is nearer than `stop_distance`, and continues when it is farther than `go_distance`.
    The speed changes with the acceleration `max_acc_v`. Commands to turn on the spot and to go back
    are not affected. If no velocity has arrived for the time `timeout`, the component writes
    nothing, so that the watchdog of the base stops the cart. The RH3 specification gives only the
    name of this component, so its ports and parameters are additions of Tickrig.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("ObstaclesAvoidance", "Stop and go")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.arriving = self.add_port(InPort("InTargetVelocity", iis.TimedVelocity2D))
        self._watched = _WatchedDistance(self, 0.5, 0.7)
        self.max_acc_v = self.configuration.bind("max_acc_v", 0.3, "x>0", unit="m/s2")
        self.leaving = self.add_port(OutPort("OutTargetVelocity", iis.TimedVelocity2D))
        self._before = Twist()

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Begin at standstill with the lane blocked."""
        self._watched.forget()
        self._before = Twist()
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Write the received velocity, or standstill for forward motion in a blocked lane."""
        free = self._watched.update(ec)
        if (latest := read_newest(self.arriving)) is not None:
            v, w = latest.data.vx, latest.data.va
            self._pass(ec, Twist(v, w) if plausible(v, w) else Twist(), free)
        return ReturnCode.RTC_OK

    def _pass(self, ec: ExecutionContext, wanted: Twist, free: bool) -> None:
        if not free and wanted.v > 0:
            wanted = Twist()
        step = self.max_acc_v.value * ec.period_us / 1e6
        self._before = VelocityLimits(_ANY, _ANY, step, _ANY).smooth(wanted, self._before)
        write_velocity(self.leaving, ec, self._before.v, 0.0, self._before.w)


class CollisionDetection(RtComponent):
    """Component that stops the base of a cart while an obstacle is nearer than `stop_distance`.

    The component calls the operation Stop of the base, and later the operation Go when the lane is
    free again. If no distance has arrived for the time `timeout`, the component also calls Stop,
    because there may be an obstacle. If the component is deactivated after Stop, it calls Go.

    Connect the port `BumpRefHard` with the port RefHardRh3.BumpRefHard of the base. The RH3
    specification gives only the name of this component, so its ports and parameters are additions
    of Tickrig.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("CollisionDetection", "Stops the base at once")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self._watched = _WatchedDistance(self, 0.15, 0.25)
        port = self.add_port(ServicePort("BumpRefHard"))
        self.ref_hard = port.require(Consumer[RefHard]("service", "RefHard"))
        self._stopped = False

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Begin with the lane blocked."""
        self._watched.forget()
        return ReturnCode.RTC_OK

    def on_deactivated(self, ec: ExecutionContext) -> ReturnCode:
        """Let the base run."""
        if self._stopped:
            self._call(stop=False)
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Evaluate the distance, and call Stop or Go."""
        free = self._watched.update(ec)
        if free == self._stopped:
            self._call(stop=not free)
        return ReturnCode.RTC_OK

    def _call(self, *, stop: bool) -> None:
        if not self.ref_hard.connected:
            return
        if stop:
            self.ref_hard.service.Stop()
        else:
            self.ref_hard.service.Go()
        self._stopped = stop
        _LOG.info("%s: %s", self.instance_name, "Stop" if stop else "Go")


# A motion chain that stops before obstacles, and goes on when they have gone.

_LATEST: Final = {"dataport.buffer.length": "8"}


class CollisionGuard:
    """Makes a cart stop before obstacles, by additional components in its motion chain.

    The new components find obstacles in the data of the range finder, and run in the execution
    context of the chain. PathFollower then sends its velocities to ObstaclesAvoidance.
    ObstaclesAvoidance sends them to the base (RefHardRh3).

    Args:
        manager: manager that runs the chain.
        chain: motion chain of the cart.
        open_urg: function that opens the line to the range finder of the cart.

    Attributes:
        monitor: component whose `distance` the other components use.
    """

    def __init__(self, manager: Manager, chain: MotionChain, open_urg: Opener) -> None:
        self._manager = manager
        number = chain.ref_hard.instance_name.removeprefix("RefHardRh3")
        capture = LrfCaptureUrg(f"LRFCapture_URG{number}", open_urg)
        points = UrgToObstacles(f"Urg_to_Obstacles{number}")
        self.monitor = ObstacleMonitor(f"ObstacleMonitor{number}")
        detection = CollisionDetection(f"CollisionDetection{number}")
        avoidance = ObstaclesAvoidance(f"ObstaclesAvoidance{number}")
        self.components = (capture, points, self.monitor, detection, avoidance)
        for component in self.components:
            manager.add(component, context=chain.context)
        velocity = f"{chain.path_follower.instance_name}.velocity"
        base = chain.ref_hard.instance_name
        manager.disconnect(velocity, f"{base}.InTargetVelocity")
        for first, second in (
            (f"{capture.instance_name}.ranges", f"{points.instance_name}.ranges"),
            (f"{points.instance_name}.obstacles", f"{self.monitor.instance_name}.obstacles"),
            (f"{self.monitor.instance_name}.distance", f"{detection.instance_name}.distance"),
            (f"{self.monitor.instance_name}.distance", f"{avoidance.instance_name}.distance"),
            (velocity, f"{avoidance.instance_name}.InTargetVelocity"),
            (f"{avoidance.instance_name}.OutTargetVelocity", f"{base}.InTargetVelocity"),
        ):
            manager.connect(first, second, _LATEST)
        manager.connect(f"{detection.instance_name}.BumpRefHard", f"{base}.BumpRefHard")

    def activate(self) -> None:
        """Request Active of all components."""
        self._manager.activate(*(component.instance_name for component in self.components))
