"""The path and running-state interfaces of IIS in front of RH3's navigation."""

from __future__ import annotations

from typing import ClassVar, Final

from tickrig.host.motion.components.omni_to_2wd import plan
from tickrig.host.motion.geometry import Pose, positive
from tickrig.host.motion.ports import arrived, newest, to_pose, to_pose_2d
from tickrig.host.rtc import ExecutionContext, InPort, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.basic import Time
from tickrig.wire.rtc_types.rh2 import NavigationState, TimedState

PASSED: Final = 0
STOPPED: Final = 1
"""`id[0]` of a running state; IIS leaves open how the flag is carried."""


class PathInterface(RtComponent):
    """Takes paths as IIS has them, and tells which way points were passed.

    | rule | here |
    |---|---|
    | a new list takes the place of the old one | without a stop, from where the cart is |
    | no way point | the cart stops on the spot |
    | the first is the start | one alone does not move: the cart stops |
    | running state | each way point when it is passed, the last once more with `STOPPED` |

    The headings of all but the last, and the speeds, are not obeyed; IIS allows that. A
    list with a number that is none is passed over.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("PathInterface", "IIS paths for RH3")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        bind = self.configuration.bind
        self.pass_distance = bind("pass_distance", 0.06, "x>=0", unit="m")
        self.path = self.add_port(InPort("path", iis.TimedPath2DSeq))
        self.position = self.add_port(InPort("position", iis.TimedPose2D))
        self.status = self.add_port(InPort("status", TimedState))
        self.min_path = self.add_port(OutPort("min_path", iis.TimedPath2DSeq))
        self.running_state = self.add_port(OutPort("running_state", iis.TimedPose2D))
        self._forget()

    def _forget(self) -> None:
        self._pose: Pose | None = None
        self._points: list[Pose] = []
        self._passed, self._waiting, self._ran = 0, False, False

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Begin without a path."""
        self._forget()
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Take the newest list, and look how far the cart has come."""
        now = Time.from_us(ec.now_us)
        if (latest := newest(self.position)) is not None:
            self._pose = to_pose(latest.data) or self._pose
        if (path := newest(self.path)) is not None:
            self._take(path)
        if self._pose is not None:
            if self._waiting:
                self._start(now, self._pose)
            self._watch(now, self._pose)
        for status in arrived(self.status):
            self._follow(now, status)
        return ReturnCode.RTC_OK

    def _take(self, path: iis.TimedPath2DSeq) -> None:
        points = [to_pose(data) for data in path.pose]
        sound = [point for point in points if point is not None]
        if len(sound) == len(points):
            self._points, self._passed, self._waiting = sound, 0, True

    def _start(self, now: Time, pose: Pose) -> None:
        self._waiting = self._ran = False
        way = plan(pose, self._points[1:]) if len(self._points) > 1 else []
        self.min_path.write(iis.TimedPath2DSeq(now, pose=tuple(to_pose_2d(p) for p in way)))
        for _ in arrived(self.status):  # of the path before
            continue
        if not way:
            if self._points:
                self._tell(now, self._points[0], STOPPED)
            self._points = []

    def _watch(self, now: Time, pose: Pose) -> None:
        """Tell the way points that are behind the cart; the last one is told when it stops."""
        while self._passed < len(self._points) - 1 and self._is_behind(pose):
            self._tell(now, self._points[self._passed], PASSED)
            self._passed += 1

    def _is_behind(self, pose: Pose) -> bool:
        points, at = self._points, self._passed
        if at == 0:
            return True
        heading = points[at - 1].bearing(points[at])
        line = points[at]._replace(heading=heading)
        return line.along(pose) > -self.pass_distance.value

    def _follow(self, now: Time, status: TimedState) -> None:
        if status.data != NavigationState.FINISH:
            self._ran = True
        elif self._ran and self._points:
            for point in self._points[self._passed :]:
                self._tell(now, point, PASSED)
            self._tell(now, self._points[-1], STOPPED)
            self._points = []

    def _tell(self, now: Time, point: Pose, flag: int) -> None:
        data = to_pose_2d(point._replace(heading=positive(point.heading)))
        self.running_state.write(iis.TimedPose2D(now, (flag,), data))
