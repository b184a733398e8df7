"""What bases on wheels have in common: a velocity in, wheel speeds out, a pose out."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Final

from tickrig.host.rtc import ExecutionContext, InPort, OutPort, ReturnCode, RtComponent
from tickrig.host.rtc.motion.geometry import Pose, Twist, moved, wheel_speeds
from tickrig.host.rtc.motion.ports import plausible, read_all, to_pose_2d
from tickrig.host.text.log import log_of
from tickrig.wire.rtc_types.basic import Time
from tickrig.wire.rtc_types.extended_2d import TimedPose2D, TimedVelocity2D

OK: Final = ReturnCode.RTC_OK

_LOG: Final = log_of(__name__)


class WheeledBase(RtComponent, ABC):
    """Turns a velocity into wheel speeds, and what the wheels did into a pose.

    A velocity to the side, or one with a number that is none, is refused: it is passed over
    with a line in the log. Without a velocity for `timeout` the wheels stop. Where a wheel
    would be too fast, both sides are slowed down alike.

    Not emulated: acceleration limits; the drives have their own.

    Args:
        instance_name: of the component.
        radius_m: of the wheels.
        tread_m: between left and right wheels.

    Attributes:
        velocity: InPort; m/s, rad/s.
        position: OutPort; where it thinks it is, from where it was activated.
        pose: the same.
        refused: how many velocities were.
    """

    def __init__(self, instance_name: str, radius_m: float, tread_m: float) -> None:
        super().__init__(instance_name)
        bind = self.configuration.bind
        self.radius = bind("wheel_radius", radius_m, "x>0", unit="m")
        self.tread = bind("tread", tread_m, "x>0", unit="m")
        self.timeout = bind("timeout", 0.5, "x>0", unit="s")
        self.velocity = self.add_port(InPort("velocity", TimedVelocity2D))
        self.position = self.add_port(OutPort("pose", TimedPose2D))
        self.refused, self.pose, self._twist = 0, Pose(), Twist()
        self._received_us = self._executed_us = 0

    @property
    @abstractmethod
    def fastest(self) -> float:
        """The speed that a wheel can be told, rad/s."""

    @abstractmethod
    def command(self, tm: Time, left: float, right: float) -> None:
        """Tell the drives how fast the wheels of each side are to turn, rad/s."""

    @abstractmethod
    def turned(self, since_s: float) -> tuple[float, float]:
        """Return how far the wheels of each side have turned since the last call, rad.

        Args:
            since_s: how long ago that was.
        """

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Begin at zero, standing."""
        self.pose, self._twist = Pose(), Twist()
        self._received_us = self._executed_us = ec.now_us
        self.velocity.clear()
        return OK

    def on_deactivated(self, ec: ExecutionContext) -> ReturnCode:
        """Stop the wheels."""
        self.command(Time.from_us(ec.now_us), 0.0, 0.0)
        return OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Command the wheels, and tell where they took it."""
        for message in read_all(self.velocity):
            self._take(ec.now_us, message)
        if ec.now_us - self._received_us > 1e6 * self.timeout.value:
            self._twist = Twist()
        tm, radius = Time.from_us(ec.now_us), self.radius.value
        speeds = wheel_speeds(self._twist, self.tread.value, radius, radius)
        share = min(1.0, self.fastest / max(1e-9, *map(abs, speeds)))
        self.command(tm, speeds[0] * share, speeds[1] * share)
        left, right = self.turned((ec.now_us - self._executed_us) / 1e6)
        self._executed_us = ec.now_us
        self.pose = moved(self.pose, left * radius, right * radius, self.tread.value)
        self.position.write(TimedPose2D(tm, to_pose_2d(self.pose)))
        return OK

    def _take(self, now_us: int, message: TimedVelocity2D) -> None:
        vx, vy, va = message.data.vx, message.data.vy, message.data.va
        if vy == 0 and plausible(vx, va):
            self._twist, self._received_us = Twist(vx, va), now_us
            return
        self.refused += 1
        _LOG.warning("%s: cannot drive %s", self.instance_name, message.data)
