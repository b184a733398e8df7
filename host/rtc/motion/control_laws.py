"""Control laws for steering and turning, and speeds that a base can follow (rh3-control).

The regulator of the Spur family follows lines and circles. The limiter is robot_speed_smooth.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from math import atan2, copysign, hypot, pi, sqrt
from typing import Final

from tickrig.host.rtc.motion.geometry import Pose, Twist, clip, wrap

_MOST_ANGULAR_ACCELERATION: Final = 5.0
"""Limit in rad/s2 for the result of max_acc_w and acc_cycle (rh3-control, units)."""

_FLOOR: Final = pi / 90
"""Minimum of the reference spin in rad/s, which is 2 degrees per second."""

_ETA: Final = 0.1
"""Share of the angular acceleration that the reference spin uses."""


@dataclass(frozen=True, slots=True)
class VelocityLimits:
    """Largest velocities of a cart, and their largest changes from one command to the next.

    Attributes:
        v: maximum forward velocity in m/s.
        w: maximum angular velocity in rad/s.
        dv: maximum change of the forward velocity in m/s from one command to the next.
        dw: maximum change of the angular velocity in rad/s from one command to the next.
    """

    v: float
    w: float
    dv: float
    dw: float

    def smooth(self, wanted: Twist, before: Twist) -> Twist:
        """Return the allowed command that is nearest to the wanted velocity."""
        v, w = clip(wanted.v, self.v), clip(wanted.w, self.w)
        return Twist(before.v + clip(v - before.v, self.dv), before.w + clip(w - before.w, self.dw))


def steps(
    max_acc_v: float, max_acc_w: float, tick_s: float, acc_cycle_s: float
) -> tuple[float, float]:
    """Return the velocity changes allowed in one tick. `max_acc_*` are those for `acc_cycle_s`."""
    share = tick_s / acc_cycle_s
    return max_acc_v * share, min(max_acc_w * share, _MOST_ANGULAR_ACCELERATION * tick_s)


class ControlLaw(StrEnum):
    """The integration method of the regulator for the angular velocity."""

    IMPLICIT = "implicit"  # stable for any step; the designed dynamics
    EXPLICIT = "explicit"  # as it was: a limit cycle where step times K3 is above 2


@dataclass(frozen=True, slots=True)
class Regulator:
    """Control law that steers a cart along a line or a circle: w' = -K3 (w - w_ff) - K2 q - K1 d.

    In the formula, w is the angular velocity, w_ff is the angular velocity that the circle needs (0
    for a line), d is the distance from the line, and q is the deviation from its heading.

    Attributes:
        k1: gain K1 in rad/s2 per metre of distance d.
        k2: gain K2 in rad/s2 per radian of deviation q.
        k3: gain K3 in 1/s for the angular velocity.
        most_offset: limit in m to which a larger distance d is reduced.
        c1: reduction of the speed in m/s per rad/s of turning. The explicit law does not use `c1`.
        step_s: time in s from one command to the next.
        law: integration method, implicit or explicit.
    """

    k1: float
    k2: float
    k3: float
    most_offset: float
    c1: float
    step_s: float
    law: ControlLaw = ControlLaw.IMPLICIT

    def follow_line(self, line: Pose, pose: Pose, v: float, before: Twist) -> Twist:
        """Return the command that steers to a line, at a positive or negative speed."""
        return self._steer(line.left(pose), wrap(pose.heading - line.heading), v, before)

    def follow_circle(
        self, centre: Pose, radius: float, pose: Pose, v: float, before: Twist
    ) -> Twist:
        """Return the velocity command that keeps a cart on a circle.

        Args:
            centre: centre of the circle.
            radius: radius in m, positive for a left turn and negative for a right turn.
            pose: present pose of the cart.
            v: wanted speed in m/s.
            before: previous command.
        """
        rho = hypot(pose.x - centre.x, pose.y - centre.y)
        phi = atan2(pose.y - centre.y, pose.x - centre.x)
        turn = copysign(1.0, radius)
        off = (abs(radius) - rho) * turn
        q = wrap(pose.heading - phi - turn * pi / 2)
        return self._steer(off, q, v, before, v / radius)

    def _steer(self, d: float, q: float, v: float, before: Twist, w_ff: float = 0.0) -> Twist:
        h, k3 = self.step_s, self.k3
        way = copysign(1.0, v if self.law is ControlLaw.IMPLICIT else before.v)
        pull = way * self.k1 * clip(d, self.most_offset) + self.k2 * q
        if self.law is ControlLaw.EXPLICIT:
            return Twist(v, before.w - h * (pull + k3 * (before.w - w_ff)))
        w = (before.w + h * k3 * w_ff - h * pull) / (1 + h * k3)
        slower = abs(v) - self.c1 * abs(w - w_ff)
        return Twist(copysign(max(0.0, slower), v), w)


@dataclass(frozen=True, slots=True)
class ReferenceSpin:
    """Control law of Reference Hardware 3 (RH3) for a cart that turns on the spot to a heading.

    Attributes:
        alpha: angular acceleration in rad/s2.
    """

    alpha: float

    def turn(self, heading: float, present: float, most: float, before: Twist) -> Twist:
        """Return the command that turns the cart to a heading, with `most` rad/s or less."""
        q = wrap(heading - present)
        wanted = max(sqrt(2 * _ETA * self.alpha * abs(q)), _FLOOR)
        return Twist(0.0, copysign(min(most, wanted), q))


@dataclass(frozen=True, slots=True)
class TimeOptimalSpin:
    """Control law for a cart that turns on the spot to a heading and brakes as late as possible.

    The law uses the heading that is expected at the time at which the command takes effect.

    Attributes:
        alpha: angular acceleration in rad/s2.
        step_s: time in s from one command to the next.
        latency_s: time in s from the measurement of a heading until the command calculated from
            this heading takes effect.
    """

    alpha: float
    step_s: float
    latency_s: float

    def turn(self, heading: float, present: float, most: float, before: Twist) -> Twist:
        """Return the command that turns the cart to a heading, with `most` rad/s or less."""
        e = wrap(present + before.w * self.latency_s - heading)
        w = -copysign(min(most, sqrt(2 * self.alpha * abs(e))), e)
        if (e + self.latency_s * w) * e < 0:
            w = -e / (self.step_s + self.latency_s)
        return Twist(0.0, w)
