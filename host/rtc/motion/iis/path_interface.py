"""The path and running-state interfaces of IIS in front of RH3's follower."""

from __future__ import annotations

from enum import Enum, auto
from math import copysign, pi, sqrt
from typing import ClassVar, Final, NamedTuple

from tickrig.host.rtc import ExecutionContext, InPort, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.host.rtc.motion.geometry import Pose, positive, wrap
from tickrig.host.rtc.motion.ports import (
    RunMode,
    plausible,
    read_newest,
    read_newest_pose,
    to_pose,
    to_pose_2d,
)
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.rtc import Path, Time

PASSED: Final = 0
STOPPED: Final = 1
"""`id[0]` of a running state; IIS leaves open how the flag is carried."""

_LEAST_WAY_M: Final = 1e-3
"""Metres between way points that are no way."""


class PathStage(Enum):
    """What the cart does on its path."""

    IDLE = auto()
    TURN = auto()  # on the spot, to where the next line goes
    LINE = auto()  # to the next way point
    LAST_TURN = auto()  # to the heading of the last way point


class WayPoint(NamedTuple):
    """A way point, and the speed on the line that leads there, negative backward."""

    pose: Pose
    speed: float


class PathInterface(RtComponent):
    """Tracks paths as IIS has them, and reports which way points were passed.

    | rule | here |
    |---|---|
    | a new list takes the place of the old one | without a stop, from where the cart is |
    | no way point | the cart stops on the spot |
    | the first is the start | one alone does not move: the cart stops |
    | speeds | vx holds on the line to its way point; `max_vel` at most, and for none or 0 |
    | backing up | a negative vx |
    | running state | each way point when it is passed, the last once more with `STOPPED` |

    Lines are straight, with turns on the spot between them. The headings of all but the last,
    vy and va are not obeyed; IIS allows that. A list with a number that is none is passed
    over. It stands in the place of OmniTo2WD and Navigation: join `target_path` with
    PathFollower.target_path, whose set should be `tuned`.
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
        self._points: list[WayPoint] = []
        self._line, self._at, self._speed = Pose(), 0, 0.0
        self._stage, self._fresh = PathStage.IDLE, False
        self._order: Path | None = None

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Begin without a path."""
        self._forget()
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Take the newest list, and judge a new pose."""
        now = Time.from_us(ec.now_us)
        if (path := read_newest(self.path)) is not None:
            self._take(now, path)
        if (pose := read_newest_pose(self.position)) is not None:
            self._judge(now, pose)
        if self._order is not None:
            self.target_path.write(self._order)
            self._order = None
        return ReturnCode.RTC_OK

    def _take(self, now: Time, path: iis.TimedPath2DSeq) -> None:
        poses = [pose for data in path.pose if (pose := to_pose(data)) is not None]
        speeds = [velocity.vx for velocity in path.velocity][: len(poses)]
        if len(poses) < len(path.pose) or not plausible(*speeds):
            return
        speeds += [0.0] * (len(poses) - len(speeds))
        self._forget()
        self._points = [WayPoint(*pair) for pair in zip(poses, speeds, strict=True)]
        self._fresh = len(poses) > 1
        if not self._fresh:
            self._command(now, RunMode.STOP, Pose())
        for pose in poses[:1]:
            self._report(now, pose, PASSED if self._fresh else STOPPED)

    def _judge(self, now: Time, pose: Pose) -> None:
        if self._fresh:
            self._fresh = False
            self._next(now, pose)
        match self._stage:
            case PathStage.TURN:
                if _off(self._line, pose) < self.turn_angle.value:
                    self._stage = PathStage.LINE
                    self._drive(now, pose)
            case PathStage.LINE:
                self._drive(now, pose)
            case PathStage.LAST_TURN:
                if _off(self._line, pose) < self.goal_angle.value:
                    self._finish(now)
            case PathStage.IDLE:
                pass

    def _next(self, now: Time, pose: Pose) -> None:
        """Turn to the next way point that is away; to the last heading when there is none."""
        self._at += 1
        while self._at < len(self._points):
            target, speed = self._points[self._at]
            if pose.distance(target) > max(_LEAST_WAY_M, self.goal_distance.value):
                heading = pose.bearing(target) + (pi if speed < 0 else 0.0)
                self._turn(now, PathStage.TURN, target._replace(heading=wrap(heading)))
                return
            self._report(now, target, PASSED)
            self._at += 1
        self._turn(now, PathStage.LAST_TURN, self._points[-1].pose)

    def _turn(self, now: Time, stage: PathStage, line: Pose) -> None:
        self._stage, self._line, self._speed = stage, line, 0.0
        self._command(now, RunMode.SPIN, line, w=1.0)

    def _drive(self, now: Time, pose: Pose) -> None:
        """Drive on, no faster than the cart can brake before the way point."""
        wanted = self._points[self._at].speed
        most = min(abs(wanted) or self.max_vel.value, self.max_vel.value)
        way = copysign(1.0, wanted) if wanted else 1.0
        left = -way * self._line.along(pose) - self.goal_distance.value
        if left < 0:
            self._command(now, RunMode.STOP, Pose())
            self._report(now, self._points[self._at].pose, PASSED)
            self._next(now, pose)
            return
        can = sqrt(2 * self.braking.value * max(0.0, left - self._speed * self.latency.value))
        self._speed = min(most, max(can, self.creep_vel.value))
        self._command(now, RunMode.LINEFOLLOW, self._line, v=way * self._speed)

    def _finish(self, now: Time) -> None:
        self._stage = PathStage.IDLE
        self._command(now, RunMode.STOP, Pose())
        self._report(now, self._points[-1].pose, STOPPED)

    def _command(
        self, now: Time, mode: RunMode, line: Pose, v: float = 0.0, w: float = 0.0
    ) -> None:
        """Command the follower; it takes one message a period, so the last one counts."""
        self._order = Path(mode, 0, line.x, line.y, line.heading, v, w, tm=now)

    def _report(self, now: Time, point: Pose, flag: int) -> None:
        data = to_pose_2d(point._replace(heading=positive(point.heading)))
        self.running_state.write(iis.TimedPose2D(now, (flag,), data))


def _off(line: Pose, pose: Pose) -> float:
    return abs(wrap(line.heading - pose.heading))
