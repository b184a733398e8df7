"""PathFollower, which computes a velocity for each period from a relay point and a pose."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import ClassVar

from tickrig.host.rtc import ExecutionContext, InPort, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.host.rtc.motion import control_laws
from tickrig.host.rtc.motion.geometry import Pose, Twist, clip, twist_of
from tickrig.host.rtc.motion.ports import RunMode, plausible, read_newest_pose, write_velocity
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.rtc import Path

_Mode = Callable[[Path, Pose, Pose], Twist]

_TUNED = {"line_K3": "40", "spin": "time-optimal", "latency": "0.08"}
"""Values of the set `tuned` (rh3-control, J)."""


class PathFollower(RtComponent):
    """A component that commands the velocity of a cart along a path (rh3-control, control laws).

    Each message sets a mode, which runs until the next message. The modes are:

    - free and stop, both towards standstill
    - line, to-point, and circle (centre x, y, radius r, to the left if positive)
    - spin, and velocity (v, w)
    - wheel velocity (v left, w right, rad/s, by `tread` and `radius`)

    A message with an invalid number means stop. Without a pose for `pose_timeout`, the cart stops,
    because its position is unknown. The parameters after `max_w` are additions:

    - `acc_cycle` is the time for which `max_acc_*` are given
    - `law` is the integration method of the regulator
    - `spin` is the method by which the cart turns
    - `latency` is the time from a pose to the effect of the command

    Attributes:
        twist: command of the latest period.
        path: the current path.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("PathFollower", "Velocity along lines and arcs")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        bind = self.configuration.bind
        self.control_cycle = bind("control_cycle", 0.02, "x>0", unit="s")
        self.line_c1 = bind("line_C1", 0.01, "x>=0")
        self.line_dist = bind("line_Dist", 0.05, "x>0", unit="m")
        self.line_k1 = bind("line_K1", 800.0, "x>=0")
        self.line_k2 = bind("line_K2", 300.0, "x>=0")
        self.line_k3 = bind("line_K3", 400.0, "x>0")
        self.max_acc_v = bind("max_acc_v", 0.0003, "x>0", unit="m/s")
        self.max_acc_w = bind("max_acc_w", 0.1, "x>0", unit="rad/s")
        self.max_v = bind("max_v", 1.0, "x>0", unit="m/s")
        self.max_w = bind("max_w", 0.3, "x>0", unit="rad/s")
        self.acc_cycle = bind("acc_cycle", 0.001, "x>0", unit="s")
        self.law = bind("law", "implicit", "(implicit, explicit)")
        self.spin = bind("spin", "reference", "(reference, time-optimal)")
        self.latency = bind("latency", 0.0, "x>=0", unit="s")
        self.pose_timeout = bind("pose_timeout", 0.5, "x>0", unit="s")
        self.tread = bind("tread", 0.464, "x>0", unit="m")
        self.radius = bind("radius", 0.0995, "x>0", unit="m")
        self.configuration.add_set("tuned", _TUNED)
        self.configuration.on_update.append(lambda set_id: self._configure())
        self.position = self.add_port(InPort("position", iis.TimedPose2D))
        self.target_path = self.add_port(InPort("target_path", Path))
        self.velocity = self.add_port(OutPort("velocity", iis.TimedVelocity2D))
        self._modes: Mapping[int, _Mode] = {
            RunMode.LINEFOLLOW: self._line,
            RunMode.TO_POINT: self._to_point,
            RunMode.CIRCLEFOLLOW: self._circle,
            RunMode.SPIN: self._turn,
            RunMode.VEL: lambda path, target, pose: Twist(path.v, path.w),
            RunMode.WHEEL_VEL: self._wheels,
        }
        self._configure()
        self._forget()

    def _forget(self) -> None:
        self.path, self.twist = Path(RunMode.STOP), Twist()
        self._pose: Pose | None = None
        self._received_us = 0

    def _configure(self) -> None:
        h, alpha = self.control_cycle.value, self.max_acc_w.value / self.control_cycle.value
        self._regulator = control_laws.Regulator(
            self.line_k1.value,
            self.line_k2.value,
            self.line_k3.value,
            self.line_dist.value,
            self.line_c1.value,
            h,
            control_laws.ControlLaw(self.law.value),
        )
        self._spin: control_laws.ReferenceSpin | control_laws.TimeOptimalSpin = (
            control_laws.ReferenceSpin(alpha)
        )
        if self.spin.value == "time-optimal":
            self._spin = control_laws.TimeOptimalSpin(alpha / 2, h, self.latency.value)

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Begin at standstill."""
        self._forget()
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Read one message, compute the next command in the mode, and write the velocity."""
        if self.target_path.is_new and (path := self.target_path.read()) is not None:
            numbers = (path.x, path.y, path.theta, path.v, path.w, path.r)
            self.path = path if plausible(*numbers) else Path(RunMode.STOP)
        wanted = self._wanted(self._update_pose(ec))
        self.twist = self.limits(ec.period_us).smooth(wanted, self.twist)
        write_velocity(self.velocity, ec, self.twist.v, 0.0, self.twist.w)
        return ReturnCode.RTC_OK

    def limits(self, period_us: int) -> control_laws.VelocityLimits:
        """Return the limits for commands that follow each other after a period."""
        dv, dw = control_laws.steps(
            self.max_acc_v.value, self.max_acc_w.value, period_us / 1e6, self.acc_cycle.value
        )
        return control_laws.VelocityLimits(self.max_v.value, self.max_w.value, dv, dw)

    def _update_pose(self, ec: ExecutionContext) -> Pose | None:
        """Read new poses. Return the latest pose, or None if no pose came for `pose_timeout`."""
        if (pose := read_newest_pose(self.position)) is not None:
            self._pose, self._received_us = pose, ec.now_us
        elif ec.now_us - self._received_us > self.pose_timeout.value * 1e6:
            self._pose = None
        return self._pose

    def _wanted(self, pose: Pose | None) -> Twist:
        path = self.path
        mode = self._modes.get(path.type)
        if mode is None or pose is None:
            return Twist()
        return mode(path, Pose(path.x, path.y, path.theta), pose)

    def _line(self, path: Path, target: Pose, pose: Pose) -> Twist:
        return self._regulator.follow_line(target, pose, path.v, self.twist)

    def _circle(self, path: Path, centre: Pose, pose: Pose) -> Twist:
        if not path.r:
            return Twist()
        return self._regulator.follow_circle(centre, path.r, pose, path.v, self.twist)

    def _turn(self, path: Path, target: Pose, pose: Pose) -> Twist:
        most = min(abs(path.w), self.max_w.value)
        return self._spin.turn(target.heading, pose.heading, most, self.twist)

    def _wheels(self, path: Path, target: Pose, pose: Pose) -> Twist:
        radius = self.radius.value
        return twist_of(path.v * radius, path.w * radius, self.tread.value)

    def _to_point(self, path: Path, target: Pose, pose: Pose) -> Twist:
        """Follow the line with a speed limit in m/s that equals the distance to its end in m."""
        if target.along(pose) > 0:
            return Twist()
        v = clip(path.v, pose.distance(target))
        return self._regulator.follow_line(target, pose, v, self.twist)
