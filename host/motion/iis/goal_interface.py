"""The goal interface of IIS in front of RH3's planner."""

from __future__ import annotations

from typing import ClassVar

from tickrig.host.motion.iis.adapters import with_wrapped_heading
from tickrig.host.motion.ports import newest
from tickrig.host.rtc import ExecutionContext, InPort, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.basic import Time


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
        if (goal := newest(self.goal)) is None:
            return ReturnCode.RTC_OK
        now = Time.from_us(ec.now_us)
        if not goal.data:
            self.min_path.write(iis.TimedPath2DSeq(now))
        elif (pose := with_wrapped_heading(iis.TimedPose2D(now, data=goal.data[0]))) is not None:
            self.position.write(pose)
        return ReturnCode.RTC_OK
