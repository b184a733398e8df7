"""Follower, with which a robot follows another by its position (RSi2/NEDO report, experiment A)."""

from __future__ import annotations

from math import cos, sin
from typing import ClassVar

from tickrig.host.rtc import ExecutionContext, InPort, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.host.rtc.motion.geometry import Pose, clip, wrap
from tickrig.host.rtc.motion.ports import read_newest_pose, write_velocity
from tickrig.wire.rtc_types import iis


class Follower(RtComponent):
    """Component that makes a robot follow another robot (the leader) at a distance.

    The position of the leader arrives at the port `leader`. Both positions are in one map frame. If
    the leader is nearer than `gap`, the robot stands. The robot never goes back. By default, the
    robot turns towards the leader and drives, as a base on two wheels can. With the parameter
    `sideways`, the robot drives straight to its wanted position and turns to the heading of the
    leader. If either position is missing for `pose_timeout`, the robot stands. The connector at
    `leader` decides which robot leads.

    The report that describes this component gives no control law, so the law, its gains and its
    limits are additions of Tickrig.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("Follower", "Follows another robot")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        bind = self.configuration.bind
        self.gap = bind("gap", 0.8, "x>0", unit="m")
        self.sideways = bind("sideways", 0, "0<=x<=1")
        self.gain_v = bind("gain_v", 1.0, "x>0", unit="1/s")
        self.gain_w = bind("gain_w", 1.5, "x>0", unit="1/s")
        self.max_v = bind("max_v", 0.4, "x>0", unit="m/s")
        self.max_w = bind("max_w", 0.8, "x>0", unit="rad/s")
        self.max_acc_v = bind("max_acc_v", 0.3, "x>0", unit="m/s2")
        self.max_acc_w = bind("max_acc_w", 2.0, "x>0", unit="rad/s2")
        self.pose_timeout = bind("pose_timeout", 0.5, "x>0", unit="s")
        self.leader = self.add_port(InPort("leader", iis.TimedPose2D))
        self.position = self.add_port(InPort("position", iis.TimedPose2D))
        self.velocity = self.add_port(OutPort("velocity", iis.TimedVelocity2D))
        self._forget()

    def _forget(self) -> None:
        self._seen: dict[InPort[iis.TimedPose2D], tuple[int, Pose]] = {}
        self._commanded = (0.0, 0.0, 0.0)

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Begin at standstill."""
        self._forget()
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Command a velocity towards the leader."""
        leader, own = self._update_pose(ec, self.leader), self._update_pose(ec, self.position)
        wanted = (0.0, 0.0, 0.0) if leader is None or own is None else self._wanted(own, leader)
        step_s = ec.period_us / 1e6
        steps = (self.max_acc_v.value, self.max_acc_v.value, self.max_acc_w.value)
        vx, vy, va = (
            before + clip(target - before, step * step_s)
            for before, target, step in zip(self._commanded, wanted, steps, strict=True)
        )
        self._commanded = vx, vy, va
        write_velocity(self.velocity, ec, vx, vy, va)
        return ReturnCode.RTC_OK

    def _update_pose(self, ec: ExecutionContext, port: InPort[iis.TimedPose2D]) -> Pose | None:
        if (pose := read_newest_pose(port)) is not None:
            self._seen[port] = ec.now_us, pose
        seen_us, seen = self._seen.get(port, (0, None))
        return seen if ec.now_us - seen_us <= self.pose_timeout.value * 1e6 else None

    def _wanted(self, own: Pose, leader: Pose) -> tuple[float, float, float]:
        off = wrap(own.bearing(leader) - own.heading)
        left_m = own.distance(leader) - self.gap.value
        speed = min(max(self.gain_v.value * left_m, 0.0), self.max_v.value)
        if self.sideways.value:
            turn = clip(self.gain_w.value * wrap(leader.heading - own.heading), self.max_w.value)
            return speed * cos(off), speed * sin(off), turn
        turn = clip(self.gain_w.value * off, self.max_w.value) if speed else 0.0
        return speed * max(0.0, cos(off)), 0.0, turn
