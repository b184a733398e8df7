"""Robots on nodes of RTC-CANopen: a joystick, beego on two EPOS, FourX on four motor core units."""

from __future__ import annotations

from abc import ABC, abstractmethod
from math import radians, tau
from typing import ClassVar, Final

from tickrig.host.rtc import ExecutionContext, InPort, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.host.rtc.motion.geometry import Pose, Twist, clip, moved, wheel_speeds
from tickrig.host.rtc.motion.ports import plausible, read_all, read_newest, to_pose_2d
from tickrig.host.text.log import log_of
from tickrig.wire.rtc_types import rtc

# A joystick as an RT component.

_FULL_PCT: Final = 100.0


class Joystick(RtComponent):
    """Simulated joystick, which writes the requested velocity to an OutPort in each period.

    Attributes:
        velocity: OutPort with the forward velocity in m/s, and the angular velocity to the left in
            rad/s.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("Joystick", "A stick as a velocity")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        bind = self.configuration.bind
        self.full_v = bind("full_v", 0.5, "x>0", unit="m/s")
        self.full_w = bind("full_w", 1.0, "x>0", unit="rad/s")
        self.velocity = self.add_port(OutPort("velocity", rtc.TimedVelocity2D))
        self._forward_pct = self._left_pct = 0.0

    def tilt(self, forward_pct: float, left_pct: float = 0.0) -> None:
        """Set the position of the stick, in per cent of its full deflection.

        Args:
            forward_pct: deflection to the front, limited to -100..100 %.
            left_pct: deflection to the left, limited to -100..100 %.
        """
        self._forward_pct = clip(forward_pct, _FULL_PCT)
        self._left_pct = clip(left_pct, _FULL_PCT)

    def typed(self, line: str) -> None:
        """Set the position of the stick by a line that the user typed, such as `50` or `50 -20`.

        The first number is the deflection to the front. The second number, which is optional, is
        the deflection to the left. Both are in per cent, -100..100.
        """
        try:
            percents = [float(word) for word in line.split()]
        except ValueError:
            percents = []
        if len(percents) not in (1, 2) or not all(-_FULL_PCT <= n <= _FULL_PCT for n in percents):
            raise ValueError(f"{line!r} is not FORWARD [LEFT], each -100..100 %")
        self.tilt(*percents)

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Write the velocity of the stick."""
        v = self._forward_pct / _FULL_PCT * self.full_v.value
        w = self._left_pct / _FULL_PCT * self.full_w.value
        self.velocity.write(
            rtc.TimedVelocity2D(rtc.Time.from_us(ec.now_us), rtc.Velocity2D(v, 0.0, w))
        )
        return ReturnCode.RTC_OK


# The common part of bases on wheels: a velocity in, wheel speeds out, a pose out.

_OK: Final = ReturnCode.RTC_OK

_LOG: Final = log_of(__name__)


class WheeledBase(RtComponent, ABC):
    """A base that converts a velocity into wheel speeds, and wheel movements into a pose.

    A lateral velocity, or a velocity with an invalid number, is ignored with a line in the log.
    Without a velocity for `timeout`, the wheels stop. If a wheel would be too fast, both sides slow
    down by the same factor.

    Not emulated: acceleration limits, because the drives have their own.

    Args:
        instance_name: name of the component.
        radius_m: radius of the wheels.
        tread_m: distance between left and right wheels.

    Attributes:
        velocity: InPort with the velocity in m/s and rad/s.
        position: OutPort with the estimated position relative to the position at activation.
        pose: estimated position as a pose.
        refused: number of ignored velocities.
    """

    def __init__(self, instance_name: str, radius_m: float, tread_m: float) -> None:
        super().__init__(instance_name)
        bind = self.configuration.bind
        self.radius = bind("wheel_radius", radius_m, "x>0", unit="m")
        self.tread = bind("tread", tread_m, "x>0", unit="m")
        self.timeout = bind("timeout", 0.5, "x>0", unit="s")
        self.velocity = self.add_port(InPort("velocity", rtc.TimedVelocity2D))
        self.position = self.add_port(OutPort("pose", rtc.TimedPose2D))
        self.refused, self.pose, self._twist = 0, Pose(), Twist()
        self._received_us = self._executed_us = 0

    @property
    @abstractmethod
    def fastest(self) -> float:
        """The highest wheel speed that can be commanded, in rad/s."""

    @abstractmethod
    def command(self, tm: rtc.Time, left: float, right: float) -> None:
        """Send the wheel speed of each side to the drives, in rad/s."""

    @abstractmethod
    def turned(self, since_s: float) -> tuple[float, float]:
        """Return how far the left and the right wheels have turned since the last call, in rad.

        Args:
            since_s: time since the last call in s.
        """

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Begin at zero, with wheels at rest."""
        self.pose, self._twist = Pose(), Twist()
        self._received_us = self._executed_us = ec.now_us
        self.velocity.clear()
        return _OK

    def on_deactivated(self, ec: ExecutionContext) -> ReturnCode:
        """Stop the wheels."""
        self.command(rtc.Time.from_us(ec.now_us), 0.0, 0.0)
        return _OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Command the wheels, and write the resulting position."""
        for message in read_all(self.velocity):
            self._take(ec.now_us, message)
        if ec.now_us - self._received_us > 1e6 * self.timeout.value:
            self._twist = Twist()
        tm, radius = rtc.Time.from_us(ec.now_us), self.radius.value
        speeds = wheel_speeds(self._twist, self.tread.value, radius, radius)
        share = min(1.0, self.fastest / max(1e-9, *map(abs, speeds)))
        self.command(tm, speeds[0] * share, speeds[1] * share)
        left, right = self.turned((ec.now_us - self._executed_us) / 1e6)
        self._executed_us = ec.now_us
        self.pose = moved(self.pose, left * radius, right * radius, self.tread.value)
        self.position.write(rtc.TimedPose2D(tm, to_pose_2d(self.pose)))
        return _OK

    def _take(self, now_us: int, message: rtc.TimedVelocity2D) -> None:
        vx, vy, va = message.data.vx, message.data.vy, message.data.va
        if vy == 0 and plausible(vx, va):
            self._twist, self._received_us = Twist(vx, va), now_us
            return
        self.refused += 1
        _LOG.warning("%s: cannot drive %s", self.instance_name, message.data)


# beego: a differential drive on two EPOS (NEDO report, 3.4.43.3; ours: K21).

_TURN: Final = 2**32
"""Number of counts after which a position begins again (6064h is INTEGER32)."""

_FASTEST_RPM: Final = 8_000


class Beego(WheeledBase):
    """Component for the robot beego, which has two wheels on CANopen drives of the type EPOS.

    The component sends motor velocities in rpm to the drives, and reads their positions in counts.
    The dimensions of the real robot are not available, so the configuration has those of
    `examples/rigs/beego.toml`.

    Attributes:
        speeds: OutPorts `left_speed` and `right_speed`, for object 60FFh.
        positions: InPorts `left_position` and `right_position`, for object 6064h.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("Beego", "Base on two EPOS", category="RTC-CANopen")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name, radius_m=0.078, tread_m=0.33)
        self.gear = self.configuration.bind("gear", 51.0, "x>0")
        self.counts = self.configuration.bind("counts", 2_000, "x>0")  # a turn of the motor
        self.speeds = tuple(
            self.add_port(OutPort(f"{side}_speed", rtc.TimedLong)) for side in ("left", "right")
        )
        self.positions = tuple(
            self.add_port(InPort(f"{side}_position", rtc.TimedLong)) for side in ("left", "right")
        )
        self._counts: list[int | None] = [None, None]

    @property
    def fastest(self) -> float:
        """The highest wheel speed that can be commanded, in rad/s."""
        return _FASTEST_RPM / 60 * tau / self.gear.value

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Set the estimated pose to zero, whatever the positions of the drives are."""
        self._counts = [None, None]
        for port in self.positions:
            port.clear()
        return super().on_activated(ec)

    def command(self, tm: rtc.Time, left: float, right: float) -> None:
        """Write the speeds in rpm."""
        for port, speed in zip(self.speeds, (left, right), strict=True):
            port.write(rtc.TimedLong(tm, round(speed * self.gear.value * 60 / tau)))

    def turned(self, since_s: float) -> tuple[float, float]:
        """Return the change of the positions."""
        left, right = (self._moved(side) for side in (0, 1))
        return left, right

    def _moved(self, side: int) -> float:
        if (position := read_newest(self.positions[side])) is None:
            return 0.0
        before, self._counts[side] = self._counts[side], position.data
        if before is None:
            return 0.0
        counts = (position.data - before + _TURN // 2) % _TURN - _TURN // 2
        return counts / (self.counts.value * self.gear.value) * tau


# FourX: four driven wheels, a motor core unit each (NEDO report, 3.4.43.3; ours: K20).

WHEELS: Final = ("fl", "rl", "fr", "rr")
"""Front and rear left, front and rear right."""

_FULL: Final = 32_767
"""Value for the full scale, 2010h:02."""


class FourX(WheeledBase):
    """Component for the robot FourX, whose four wheels are driven by CANopen motor units.

    The robot steers like a tank, and its motor units are in velocity mode. The component calculates
    the pose from the measured speeds. If no new speed arrives, the component uses the last one.

    Attributes:
        references: OutPorts `fl_reference` and so on, for object 6411h:01.
        speeds: InPorts `fl_speed` and so on, for object 6401h:02.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("FourX", "Base on four wheels", category="RTC-CANopen")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name, radius_m=0.1, tread_m=0.4)
        self.full_scale = self.configuration.bind("full_scale", 360.0, "x>0", unit="deg/s")
        self.references = tuple(
            self.add_port(OutPort(f"{wheel}_reference", rtc.TimedShort)) for wheel in WHEELS
        )
        self.speeds = tuple(
            self.add_port(InPort(f"{wheel}_speed", rtc.TimedShort)) for wheel in WHEELS
        )
        self._latest = [0.0] * len(WHEELS)

    @property
    def fastest(self) -> float:
        """The highest wheel speed that can be commanded, in rad/s."""
        return radians(self.full_scale.value)

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Begin at zero, with wheels at rest."""
        self._latest = [0.0] * len(WHEELS)
        for port in self.speeds:
            port.clear()
        return super().on_activated(ec)

    def command(self, tm: rtc.Time, left: float, right: float) -> None:
        """Write the references."""
        for port, speed in zip(self.references, (left, left, right, right), strict=True):
            port.write(rtc.TimedShort(tm, round(speed / self.fastest * _FULL)))

    def turned(self, since_s: float) -> tuple[float, float]:
        """Return the mean rotation of the wheels at the speeds that were measured last."""
        for place, port in enumerate(self.speeds):
            if (speed := read_newest(port)) is not None:
                self._latest[place] = speed.data / _FULL * self.fastest
        front_left, rear_left, front_right, rear_right = self._latest
        return (front_left + rear_left) / 2 * since_s, (front_right + rear_right) / 2 * since_s
