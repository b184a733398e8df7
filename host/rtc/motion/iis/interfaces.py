"""The goal interface of IIS in front of RH3's planner, and its running information."""

from __future__ import annotations

from math import cos, sin
from typing import ClassVar, Final

from tickrig.host.rtc import ExecutionContext, InPort, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.host.rtc.motion.geometry import Pose, wrap
from tickrig.host.rtc.motion.iis.adapters import with_wrapped_heading
from tickrig.host.rtc.motion.ports import read_all, read_newest, to_pose
from tickrig.host.text.log import log_of
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.rtc import Time, Velocity2D

_PERIOD_US: Final = 10_000
"""What IIS recommends at most."""

_LOG: Final = log_of(__name__)


class RunningInformation(RtComponent):
    """Makes velocities in the robot's frame out of its poses, and writes one each period.

    A pose that is older than `timeout` says nothing any more: the velocity is then 0. Give
    it an execution context of 100 Hz or more; slower ones are logged. `tm` is the
    time of the later pose.
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
        """Take new poses, write the velocity."""
        for sample in read_all(self.position):
            if (pose := to_pose(sample.data)) is not None:
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
    """Takes goals as IIS has them: the first pose counts, no pose clears the goal.

    A new goal takes the place of the old one. A cleared goal becomes an empty path, so the
    cart stops on the spot, as IIS recommends. A goal with a number that is none is passed
    over. Join `position` with OmniTo2WD.goal and `min_path` with Navigation.min_path.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("GoalInterface", "IIS goals for RH3")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.goal = self.add_port(InPort("goal", iis.TimedPose2DSeq))
        self.position = self.add_port(OutPort("position", iis.TimedPose2D))
        self.min_path = self.add_port(OutPort("min_path", iis.TimedPath2DSeq))

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Pass the newest goal on."""
        if (goal := read_newest(self.goal)) is None:
            return ReturnCode.RTC_OK
        now = Time.from_us(ec.now_us)
        if not goal.data:
            self.min_path.write(iis.TimedPath2DSeq(now))
        elif (pose := with_wrapped_heading(iis.TimedPose2D(now, data=goal.data[0]))) is not None:
            self.position.write(pose)
        return ReturnCode.RTC_OK
