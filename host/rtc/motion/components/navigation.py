"""Navigation, which provides one relay point at a time, with the mode and speed to reach it."""

from __future__ import annotations

from math import pi, sqrt
from typing import ClassVar

from tickrig.host.rtc import ExecutionContext, InPort, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.host.rtc.motion import ports
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.rtc import Path, Time, TimedState

_State = ports.NavigationState

_TUNED = {
    "align_angle": "0.01",
    "turn_angle": "0.01",
    "goal_angle": "0.003",
    "goal_distance": "0.002",
    "braking": "0.24",
    "creep_vel": "0.01",
    "latency": "0.08",
}
"""Values of the set `tuned`: turn before driving, brake to the end of the line (rh3-control, J)."""


class Navigation(RtComponent):
    """The navigation of the reference hardware, a state machine (rh3-control, state machine).

    The state machine is evaluated once for each new pose. The parameters after `max_vel` are
    additions. Their defaults are the constants of the reference hardware. With `braking` above 0,
    the component commands a speed for each pose, so that the cart can stop at the end of the line
    with that deceleration. `latency` is the time from a pose to the effect of the command.

    An empty list means stop and FINISH. A new list replaces the old list without a stop. A list
    with an invalid number is ignored.

    Attributes:
        state: state that is written to the port each period.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("Navigation", "Relay points, one at a time")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        bind = self.configuration.bind
        self.judge_radius = bind("judge_radius", 0.5, "x>=0", unit="m")
        self.max_vel = bind("max_vel", 0.3, "x>0", unit="m/s")
        self.align_angle = bind("align_angle", pi / 6, "x>0", unit="rad")
        self.turn_angle = bind("turn_angle", pi / 20, "x>0", unit="rad")
        self.goal_angle = bind("goal_angle", 0.02, "x>0", unit="rad")
        self.goal_distance = bind("goal_distance", 0.05, "x>=0", unit="m")
        self.creep_vel = bind("creep_vel", 0.1, "x>0", unit="m/s")
        self.braking = bind("braking", 0.0, "x>=0", unit="m/s2")
        self.latency = bind("latency", 0.0, "x>=0", unit="s")
        self.configuration.add_set("tuned", _TUNED)
        self.position = self.add_port(InPort("position", iis.TimedPose2D))
        self.min_path = self.add_port(InPort("min_path", iis.TimedPath2DSeq))
        self.path = self.add_port(OutPort("path", Path))
        self.status = self.add_port(OutPort("status", TimedState))
        self._forget()

    def _forget(self) -> None:
        self.state = _State.FINISH
        self._relays: tuple[Pose, ...] = ()
        self._at, self._fresh, self._v = 0, False, 0.0

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Begin without a goal."""
        self._forget()
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Read a new list of points, evaluate a new pose, and write the state."""
        now = Time.from_us(ec.now_us)
        if (way := ports.read_newest(self.min_path)) is not None:
            self._start(now, way)
        if (pose := ports.read_newest_pose(self.position)) is not None and self._relays:
            self._judge(now, pose)
        self.status.write(TimedState(now, self.state))
        return ReturnCode.RTC_OK

    def _start(self, now: Time, way: iis.TimedPath2DSeq) -> None:
        relays = [ports.to_pose(data) for data in way.pose]
        if None in relays:
            return
        self._relays = tuple(relay for relay in relays if relay is not None)
        self._at, self._fresh = 0, True
        self.state = _State.ANGLE_CHECK
        if not self._relays:
            self._stop(now)
            self.state = _State.FINISH

    def _judge(self, now: Time, pose: Pose) -> None:
        if self._fresh:
            self._relays, self._fresh = (pose, *self._relays[1:]), False
        relay = self._relays[self._at]
        match self.state:
            case _State.ANGLE_CHECK:
                self._check_angle(now, relay, pose)
            case _State.TURNING:
                if pose.turn_to(relay) < self.turn_angle.value:
                    self.state = _State.GOAL_CHECK
            case _State.TURNING2:
                if pose.turn_to(relay) < self.goal_angle.value:
                    self._stop(now)
                    self.state, self._relays = _State.FINISH, ()
            case _State.GOAL_CHECK:
                self._check_goal(now, relay, pose)
            case _State.SPEED_DOWN | _State.STOPPING:
                self._approach(now, relay, pose)

    def _check_angle(self, now: Time, relay: Pose, pose: Pose) -> None:
        last = self._at == len(self._relays) - 1
        if last or pose.turn_to(relay) > self.align_angle.value:
            self._send(now, ports.RunMode.SPIN, relay, w=1.0)
            self.state = _State.TURNING2 if last else _State.TURNING
        else:
            self.state = _State.GOAL_CHECK

    def _check_goal(self, now: Time, relay: Pose, pose: Pose) -> None:
        if pose.distance(relay) > self.goal_distance.value:
            self._drive(now, relay, pose, self.max_vel.value)
            self.state = _State.SPEED_DOWN
        else:
            self._next(now)

    def _approach(self, now: Time, relay: Pose, pose: Pose) -> None:
        """Drive to the line across the relay point, with lower speed near it."""
        over, braking = relay.along(pose), self.braking.value > 0
        if braking:
            if over > -self.goal_distance.value:
                self._next(now)
            else:
                self._drive(now, relay, pose, self.max_vel.value)
        elif self.state is _State.STOPPING:
            if over > 0:
                self._next(now)
        elif over > -self.judge_radius.value:
            self.state = _State.STOPPING
            self._drive(now, relay, pose, self.creep_vel.value)

    def _drive(self, now: Time, relay: Pose, pose: Pose, v: float) -> None:
        if self.braking.value:
            left = -relay.along(pose) - self.goal_distance.value - self._v * self.latency.value
            can = sqrt(2 * self.braking.value * max(0.0, left))
            v = min(self.max_vel.value, max(can, self.creep_vel.value))
        self._send(now, ports.RunMode.LINEFOLLOW, relay, v=v)

    def _next(self, now: Time) -> None:
        self._stop(now)
        self._at += 1
        self.state = _State.ANGLE_CHECK
        if self._at == len(self._relays):
            self.state, self._relays = _State.FINISH, ()

    def _stop(self, now: Time) -> None:
        self._send(now, ports.RunMode.STOP, Pose())

    def _send(
        self, now: Time, mode: ports.RunMode, relay: Pose, v: float = 0.0, w: float = 0.0
    ) -> None:
        self._v = v
        self.path.write(Path(mode, 0, relay.x, relay.y, relay.heading, v, w, tm=now))
