"""OmniTo2WD, which converts a goal or a path into turns on the spot and straight lines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Final

from tickrig.host.rtc import ExecutionContext, InPort, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.host.rtc.motion import ports
from tickrig.host.rtc.motion.components import position_input
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.host.text.log import log_of
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.rtc import Time, TimedState

_LEAST_WAY_M: Final = 1e-6
"""Distance in m below which a step has no meaningful heading."""

_LOG: Final = log_of(__name__)


class OmniTo2WD(RtComponent):
    """Component that plans turns and straight lines for a cart that cannot move sideways.

    The cart never goes backward. A step of zero length is left out. A goal or a path with an
    invalid number is ignored, and a line is logged. The status FINISH is written only once, when
    the goal is reached, so that it cannot be mistaken for the end of a later command.

    Attributes:
        refused: number of ignored goals and paths.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("OmniTo2WD", "Plans turns and lines to a goal")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.current_position = self.add_port(InPort("current_position", iis.TimedPose2D))
        self.goal = self.add_port(InPort("goal", iis.TimedPose2D))
        self.status_in = self.add_port(InPort("status", TimedState))
        self.min_path = self.add_port(OutPort("min_path", iis.TimedPath2DSeq))
        self.status_out = self.add_port(OutPort("status_out", TimedState))
        self.refused = 0
        self._forget()

    def _forget(self) -> None:
        self._pose: Pose | None = None
        self._points: list[Pose | None] = []
        self._waiting: list[Pose] = []
        self._began = self._ran = False

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Begin without a goal."""
        self._forget()
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Plan for new input, and write FINISH."""
        self._pose = ports.read_newest_pose(self.current_position) or self._pose
        for message in ports.read_all(self.goal):
            self._take(message)
        if self._waiting and self._pose is not None:
            self._plan(ec, self._pose)
        for status in ports.read_all(self.status_in):
            self._follow(ec, status)
        return ReturnCode.RTC_OK

    def _take(self, message: iis.TimedPose2D) -> None:
        """Take a goal, or a point of a path. The new goal replaces earlier goals."""
        kind = message.id[0] if message.id else None
        if kind not in (position_input.INTERMEDIATE_POINT, position_input.END_POINT):
            self._points = []
        self._points.append(ports.to_pose(message.data))
        if kind in (position_input.START_POINT, position_input.INTERMEDIATE_POINT):
            return
        plausible = [point for point in self._points if point is not None]
        if len(plausible) == len(self._points):
            self._waiting = plausible
        else:
            self.refused += 1
            _LOG.warning("%s: ignored an invalid number: %s", self.instance_name, message)
        self._points = []

    def _plan(self, ec: ExecutionContext, pose: Pose) -> None:
        way = plan(pose, self._waiting)
        self._waiting = []
        now = Time.from_us(ec.now_us)
        self.min_path.write(iis.TimedPath2DSeq(now, pose=tuple(ports.to_pose_2d(p) for p in way)))
        for _ in ports.read_all(self.status_in):  # of the command before
            continue
        self._began, self._ran = True, False

    def _follow(self, ec: ExecutionContext, status: TimedState) -> None:
        if status.data != ports.NavigationState.FINISH:
            self._ran = True
        elif self._began and self._ran:
            self._began = False
            self.status_out.write(TimedState(Time.from_us(ec.now_us), ports.NavigationState.FINISH))


def plan(start: Pose, points: Sequence[Pose]) -> list[Pose]:
    """Plan a path of turns on the spot and straight lines, and return it as a list of poses.

    The list begins with the start. Each point of the path adds two poses. The first is the previous
    position, with the heading towards the point. The second is the point, with the same heading.
    The last pose of the list is the last point, with the heading that is given for this point (RH3
    specification, path calculation).

    >>> [tuple(round(n, 2) for n in p) for p in plan(Pose(), [Pose(0.0, 2.0, 0.0)])]
    [(0.0, 0.0, 0.0), (0.0, 0.0, 1.57), (0.0, 2.0, 1.57), (0.0, 2.0, 0.0)]
    """
    way, here = [start], start
    for point in points:
        if here.distance(point) > _LEAST_WAY_M:
            heading = here.bearing(point)
            way += [Pose(here.x, here.y, heading), Pose(point.x, point.y, heading)]
            here = point
    return [*way, points[-1]]
