"""The common interfaces of mobile robots (IIS), with their rules, and adapters of their phases."""

from __future__ import annotations

from enum import Enum, auto
from math import copysign, cos, pi, sin, sqrt
from typing import ClassVar, Final, Generic, NamedTuple, TypeVar, get_args

from tickrig.host.rtc import ExecutionContext, InPort, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.host.rtc.motion import ports
from tickrig.host.rtc.motion.geometry import Pose, positive, wrap
from tickrig.host.text.log import log_of
from tickrig.wire.rtc_types import iis, rtc
from tickrig.wire.rtc_types.idl import Struct
from tickrig.wire.rtc_types.rtc import Path, Time, Velocity2D

# Components that convert between the phases of the common interfaces, and their heading ranges.
#
# Data that a phase cannot represent are left out: sideways speed, `id` and `error` in phase 1.
# Headings are in 0..2 pi on IIS interfaces, as IIS recommends, and in -pi..pi on those of RH3.

S = TypeVar("S", bound=Struct)
T = TypeVar("T", bound=Struct)


class _Adapter(RtComponent, Generic[S, T]):
    """A component that converts each value at its port `in` and writes the result to `out`.

    A value that cannot be converted is dropped. A subclass names the types of both ports in
    brackets, and overrides `convert`.
    """

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        source, target = get_args(type(self).__orig_bases__[0])  # type: ignore[attr-defined]  # of the subclass
        self.arriving = self.add_port(InPort[S]("in", source))
        self.leaving = self.add_port(OutPort[T]("out", target))

    def convert(self, value: S) -> T | None:
        """Return the converted value, or None if it cannot be converted."""
        raise NotImplementedError

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Convert the values that arrived."""
        for value in ports.read_all(self.arriving):
            if (converted := self.convert(value)) is not None:
                self.leaving.write(converted)
        return ReturnCode.RTC_OK


class Velocity1To2(_Adapter[rtc.TimedVelocity, iis.TimedVelocity]):
    """Component that converts velocity commands from phase 1 to phase 2 of the IIS interfaces.

    IIS is a set of interfaces that the components of different mobile robots have in common. There
    are three versions of IIS, called phase 1, 2 and 3. Each of them has its own data types.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("Velocity1To2", "IIS velocity, phase 1 to 2")

    def convert(self, value: rtc.TimedVelocity) -> iis.TimedVelocity:
        """Return a velocity straight ahead."""
        return iis.TimedVelocity(value.tm, vx=value.v, w=value.w)


class Velocity2To1(_Adapter[iis.TimedVelocity, rtc.TimedVelocity]):
    """Component that converts velocity commands from phase 2 to phase 1 of the IIS interfaces.

    The sideways velocity is dropped, because phase 1 cannot represent it.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("Velocity2To1", "IIS velocity, phase 2 to 1")

    def convert(self, value: iis.TimedVelocity) -> rtc.TimedVelocity:
        """Return a velocity without its sideways part."""
        return rtc.TimedVelocity(value.tm, value.vx, value.w)


class Velocity2To3(_Adapter[iis.TimedVelocity, iis.TimedVelocity2D]):
    """Component that converts velocity commands from phase 2 to phase 3 of the IIS interfaces."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("Velocity2To3", "IIS velocity, phase 2 to 3")

    def convert(self, value: iis.TimedVelocity) -> iis.TimedVelocity2D:
        """Return the same velocity."""
        data = Velocity2D(value.vx, value.vy, value.w)
        return iis.TimedVelocity2D(value.tm, value.id, data, value.error)


class Velocity3To2(_Adapter[iis.TimedVelocity2D, iis.TimedVelocity]):
    """Component that converts velocity commands from phase 3 to phase 2 of the IIS interfaces."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("Velocity3To2", "IIS velocity, phase 3 to 2")

    def convert(self, value: iis.TimedVelocity2D) -> iis.TimedVelocity:
        """Return the same velocity."""
        data = value.data
        return iis.TimedVelocity(value.tm, value.id, data.vx, data.vy, data.va, value.error)


class Position2To3(_Adapter[iis.TimedPosition, iis.TimedPose2D]):
    """Component that converts the position of a robot from IIS phase 2 to IIS phase 3.

    IIS is a set of common interfaces for mobile robots. Phase 2 and phase 3 are two versions of IIS
    with different data types.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("Position2To3", "IIS self-position, phase 2 to 3")

    def convert(self, value: iis.TimedPosition) -> iis.TimedPose2D | None:
        """Return the position as `iis.TimedPose2D`, or None if a number is invalid.

        The heading of the result is in 0..2 pi.
        """
        if not ports.plausible(value.x, value.y, value.theta):
            return None
        pose = Pose(value.x, value.y, positive(value.theta))
        return iis.TimedPose2D(value.tm, value.id, ports.to_pose_2d(pose), value.error)


class Position3To2(_Adapter[iis.TimedPose2D, iis.TimedPosition]):
    """Component that converts the position of a robot from IIS phase 3 (or RH3) to IIS phase 2."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("Position3To2", "IIS self-position, phase 3 to 2")

    def convert(self, value: iis.TimedPose2D) -> iis.TimedPosition | None:
        """Return the position as `iis.TimedPosition`, or None if a number is invalid.

        The heading of the result is in 0..2 pi.
        """
        if (pose := ports.to_pose(value.data)) is None:
            return None
        numbers = (pose.x, pose.y, positive(pose.heading))
        return iis.TimedPosition(value.tm, value.id, *numbers, value.error)


class PositiveHeading(_Adapter[iis.TimedPose2D, iis.TimedPose2D]):
    """Component that converts headings from -pi..pi (RH3) to 0..2 pi (IIS interfaces)."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("PositiveHeading", "Heading in 0..2 pi")

    def convert(self, value: iis.TimedPose2D) -> iis.TimedPose2D | None:
        """Return the pose with its heading in 0..2 pi, or None if a number is invalid."""
        if (pose := ports.to_pose(value.data)) is None:
            return None
        data = ports.to_pose_2d(pose._replace(heading=positive(pose.heading)))
        return iis.TimedPose2D(value.tm, value.id, data, value.error)


class WrappedHeading(_Adapter[iis.TimedPose2D, iis.TimedPose2D]):
    """Component that converts headings from 0..2 pi (IIS interfaces) to -pi..pi (RH3)."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("WrappedHeading", "Heading in -pi..pi")

    def convert(self, value: iis.TimedPose2D) -> iis.TimedPose2D | None:
        """Return the pose with its heading in -pi..pi, or None if a number is invalid."""
        return _with_wrapped_heading(value)


def _with_wrapped_heading(value: iis.TimedPose2D) -> iis.TimedPose2D | None:
    """Return a pose with its heading in -pi..pi, or None if a number is invalid."""
    pose = ports.to_pose(value.data)
    return pose and iis.TimedPose2D(value.tm, value.id, ports.to_pose_2d(pose), value.error)


# The goal interface of IIS in front of the planner of RH3, and its running information.

_PERIOD_US: Final = 10_000
"""Longest period that IIS recommends."""

_LOG: Final = log_of(__name__)


class RunningInformation(RtComponent):
    """Component that calculates the velocity of a robot from its poses, and writes it each period.

    The velocity is given in the coordinates of the robot. It is calculated from the latest two
    poses, and its time `tm` is the time of the later one. If the latest pose is older than
    `timeout`, the velocity is 0. Use an execution context with a rate of at least 100 Hz.
    A slower context is reported in the log.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("RunningInformation", "IIS running information")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.timeout = self.configuration.bind("timeout", 0.1, "x>0", unit="s")
        self.position = self.add_port(InPort("position", iis.TimedPose2D))
        self.velocity = self.add_port(OutPort("velocity", iis.TimedVelocity2D))
        self._forget()

    def _forget(self) -> None:
        self._pose: Pose | None = None
        self._taken_us = self._received_us = 0
        self._velocity = iis.TimedVelocity2D()

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Begin at standstill."""
        self._forget()
        if ec.period_us > _PERIOD_US:
            _LOG.warning(
                "%s: period %d us, IIS recommends %d us at most",
                *(self.instance_name, ec.period_us, _PERIOD_US),
            )
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Take new poses, and write the velocity."""
        for sample in ports.read_all(self.position):
            if (pose := ports.to_pose(sample.data)) is not None:
                self._take(sample.tm, pose)
                self._received_us = ec.now_us
        if ec.now_us - self._received_us > self.timeout.value * 1e6:
            self._velocity = iis.TimedVelocity2D(Time.from_us(ec.now_us))
        self.velocity.write(self._velocity)
        return ReturnCode.RTC_OK

    def _take(self, tm: Time, pose: Pose) -> None:
        before, taken_us = self._pose, tm.us
        elapsed_s = (taken_us - self._taken_us) / 1e6
        self._pose, self._taken_us = pose, taken_us
        if before is None or elapsed_s <= 0:
            return
        turn = wrap(pose.heading - before.heading)
        middle = before.heading + turn / 2
        dx, dy = (pose.x - before.x) / elapsed_s, (pose.y - before.y) / elapsed_s
        vx, vy = dx * cos(middle) + dy * sin(middle), dy * cos(middle) - dx * sin(middle)
        self._velocity = iis.TimedVelocity2D(tm, data=Velocity2D(vx, vy, turn / elapsed_s))


class GoalInterface(RtComponent):
    """Component that accepts goals in the form of the IIS interface, for the planner of RH3.

    The goal arrives as a list of poses, of which the component uses the first. A new goal replaces
    the old one. An empty list clears the goal: the component then writes an empty path, so that the
    cart stops on the spot, as IIS recommends. A goal with an invalid number is ignored. Connect
    `position` with OmniTo2WD.goal and `min_path` with Navigation.min_path.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("GoalInterface", "IIS goals for RH3")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.goal = self.add_port(InPort("goal", iis.TimedPose2DSeq))
        self.position = self.add_port(OutPort("position", iis.TimedPose2D))
        self.min_path = self.add_port(OutPort("min_path", iis.TimedPath2DSeq))

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Pass on the newest goal."""
        if (goal := ports.read_newest(self.goal)) is None:
            return ReturnCode.RTC_OK
        now = Time.from_us(ec.now_us)
        if not goal.data:
            self.min_path.write(iis.TimedPath2DSeq(now))
        elif (pose := _with_wrapped_heading(iis.TimedPose2D(now, data=goal.data[0]))) is not None:
            self.position.write(pose)
        return ReturnCode.RTC_OK


# The path and running-state interfaces of IIS in front of the follower of RH3.

PASSED: Final = 0
STOPPED: Final = 1
"""Values of `id[0]` in a running state. IIS does not define how the flag is carried."""

_LEAST_WAY_M: Final = 1e-3
"""Distance in m between way points below which there is no line."""


class _PathStage(Enum):
    """Stage of the cart on its path."""

    IDLE = auto()
    TURN = auto()  # on the spot, to where the next line goes
    LINE = auto()  # to the next way point
    LAST_TURN = auto()  # to the heading of the last way point


class _WayPoint(NamedTuple):
    """A way point, and the speed on the line to it, which is negative for backward motion."""

    pose: Pose
    speed: float


class PathInterface(RtComponent):
    """A component that follows paths of IIS, and reports passed way points.

    | rule | here |
    |---|---|
    | a new list replaces the old one | without a stop, from where the cart is |
    | no way point | the cart stops on the spot |
    | the first is the start | with a single way point the cart stops |
    | speeds | vx applies on the line to its way point, up to `max_vel`; 0 or none means that |
    | backing up | a negative vx |
    | running state | each way point when it is passed, the last once more with `STOPPED` |

    Lines are straight, with turns on the spot between them. The component ignores vy, va, and the
    headings of all way points but the last. IIS allows this. A list with an invalid number is
    ignored. The component replaces OmniTo2WD and Navigation, so join `target_path` with
    PathFollower.target_path. The configuration set of PathFollower should be `tuned`.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("PathInterface", "IIS paths for RH3")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        bind = self.configuration.bind
        self.max_vel = bind("max_vel", 0.3, "x>0", unit="m/s")
        self.turn_angle = bind("turn_angle", 0.01, "x>0", unit="rad")
        self.goal_distance = bind("goal_distance", 0.002, "x>=0", unit="m")
        self.goal_angle = bind("goal_angle", 0.003, "x>0", unit="rad")
        self.braking = bind("braking", 0.24, "x>0", unit="m/s2")
        self.latency = bind("latency", 0.08, "x>=0", unit="s")
        self.creep_vel = bind("creep_vel", 0.01, "x>0", unit="m/s")
        self.path = self.add_port(InPort("path", iis.TimedPath2DSeq))
        self.position = self.add_port(InPort("position", iis.TimedPose2D))
        self.target_path = self.add_port(OutPort("target_path", Path))
        self.running_state = self.add_port(OutPort("running_state", iis.TimedPose2D))
        self._forget()

    def _forget(self) -> None:
        self._points: list[_WayPoint] = []
        self._line, self._at, self._speed = Pose(), 0, 0.0
        self._stage, self._fresh = _PathStage.IDLE, False
        self._order: Path | None = None

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Begin without a path."""
        self._forget()
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Read a new path, check which way points were passed, and send the next command."""
        now = Time.from_us(ec.now_us)
        if (path := ports.read_newest(self.path)) is not None:
            self._take(now, path)
        if (pose := ports.read_newest_pose(self.position)) is not None:
            self._judge(now, pose)
        if self._order is not None:
            self.target_path.write(self._order)
            self._order = None
        return ReturnCode.RTC_OK

    def _take(self, now: Time, path: iis.TimedPath2DSeq) -> None:
        poses = [pose for data in path.pose if (pose := ports.to_pose(data)) is not None]
        speeds = [velocity.vx for velocity in path.velocity][: len(poses)]
        if len(poses) < len(path.pose) or not ports.plausible(*speeds):
            return
        speeds += [0.0] * (len(poses) - len(speeds))
        self._forget()
        self._points = [_WayPoint(*pair) for pair in zip(poses, speeds, strict=True)]
        self._fresh = len(poses) > 1
        if not self._fresh:
            self._command(now, ports.RunMode.STOP, Pose())
        for pose in poses[:1]:
            self._report(now, pose, PASSED if self._fresh else STOPPED)

    def _judge(self, now: Time, pose: Pose) -> None:
        if self._fresh:
            self._fresh = False
            self._next(now, pose)
        match self._stage:
            case _PathStage.TURN:
                if pose.turn_to(self._line) < self.turn_angle.value:
                    self._stage = _PathStage.LINE
                    self._drive(now, pose)
            case _PathStage.LINE:
                self._drive(now, pose)
            case _PathStage.LAST_TURN:
                if pose.turn_to(self._line) < self.goal_angle.value:
                    self._finish(now)
            case _PathStage.IDLE:
                pass

    def _next(self, now: Time, pose: Pose) -> None:
        """Turn to the next way point at a distance, or to the last heading when there is none."""
        self._at += 1
        while self._at < len(self._points):
            target, speed = self._points[self._at]
            if pose.distance(target) > max(_LEAST_WAY_M, self.goal_distance.value):
                heading = pose.bearing(target) + (pi if speed < 0 else 0.0)
                self._turn(now, _PathStage.TURN, target._replace(heading=wrap(heading)))
                return
            self._report(now, target, PASSED)
            self._at += 1
        self._turn(now, _PathStage.LAST_TURN, self._points[-1].pose)

    def _turn(self, now: Time, stage: _PathStage, line: Pose) -> None:
        self._stage, self._line, self._speed = stage, line, 0.0
        self._command(now, ports.RunMode.SPIN, line, w=1.0)

    def _drive(self, now: Time, pose: Pose) -> None:
        """Drive with at most the speed from which the cart can brake before the way point."""
        wanted = self._points[self._at].speed
        most = min(abs(wanted) or self.max_vel.value, self.max_vel.value)
        way = copysign(1.0, wanted) if wanted else 1.0
        left = -way * self._line.along(pose) - self.goal_distance.value
        if left < 0:
            self._command(now, ports.RunMode.STOP, Pose())
            self._report(now, self._points[self._at].pose, PASSED)
            self._next(now, pose)
            return
        can = sqrt(2 * self.braking.value * max(0.0, left - self._speed * self.latency.value))
        self._speed = min(most, max(can, self.creep_vel.value))
        self._command(now, ports.RunMode.LINEFOLLOW, self._line, v=way * self._speed)

    def _finish(self, now: Time) -> None:
        self._stage = _PathStage.IDLE
        self._command(now, ports.RunMode.STOP, Pose())
        self._report(now, self._points[-1].pose, STOPPED)

    def _command(
        self, now: Time, mode: ports.RunMode, line: Pose, v: float = 0.0, w: float = 0.0
    ) -> None:
        """Command the follower.

        The follower takes one message per period, so the last one counts.
        """
        self._order = Path(mode, 0, line.x, line.y, line.heading, v, w, tm=now)

    def _report(self, now: Time, point: Pose, flag: int) -> None:
        data = ports.to_pose_2d(point._replace(heading=positive(point.heading)))
        self.running_state.write(iis.TimedPose2D(now, (flag,), data))
