"""A robot on omni wheels as one RT component: its base is inside, there is no line."""

from __future__ import annotations

from typing import ClassVar, Final

from tickrig.device.body.omni_body import OmniBody, OmniParameters, Velocity
from tickrig.device.body.pose import Pose as BodyPose
from tickrig.host.motion.geometry import Pose
from tickrig.host.motion.ports import newest, sound, to_pose_2d
from tickrig.host.rtc import ExecutionContext, InPort, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.basic import Time

STEP_US: Final = 1_000

WATCHDOG_US: Final = 500_000
"""Silence after which it stops, as the base on two wheels does."""


class OmniCart(RtComponent):
    """Takes IIS velocities with all three parts, and tells its pose, which is the true one.

    A velocity with a number that is none means stop.

    Not emulated: a driver and its line, encoders, an odometry that errs.

    Attributes:
        body: the wheels and where they are.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("OmniCart", "Robot on three omni wheels, emulated")

    def __init__(self, instance_name: str, parameters: OmniParameters | None = None) -> None:
        super().__init__(instance_name)
        self.velocity = self.add_port(InPort("InTargetVelocity", iis.TimedVelocity2D))
        self.position = self.add_port(OutPort("OdometryPosition", iis.TimedPose2D))
        self.body = OmniBody(parameters or OmniParameters())
        self._wanted, self._heard_us = Velocity(), 0

    @property
    def truth(self) -> Pose:
        """Where it is."""
        pose = self.body.pose
        return Pose(pose.x_m, pose.y_m, pose.wrapped_rad)

    def place(self, pose: Pose) -> None:
        """Put it somewhere."""
        self.body.pose = BodyPose(*pose)

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Begin at standstill."""
        self._wanted = Velocity()
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Go on for a period."""
        if (latest := newest(self.velocity)) is not None:
            numbers = (latest.data.vx, latest.data.vy, latest.data.va)
            self._wanted = Velocity(*numbers) if sound(*numbers) else Velocity()
            self._heard_us = ec.now_us
        elif ec.now_us - self._heard_us > WATCHDOG_US:
            self._wanted = Velocity()
        for _ in range(ec.period_us // STEP_US):
            self.body.step(self._wanted)
        now = Time.from_us(ec.now_us)
        self.position.write(iis.TimedPose2D(now, data=to_pose_2d(self.truth)))
        return ReturnCode.RTC_OK
