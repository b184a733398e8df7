"""Follow a line or a circle: the regulator of the Spur family (rh3-control, control laws)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from math import atan2, copysign, hypot, pi

from tickrig.host.motion.geometry import Pose, Twist, clip, wrap


class ControlLaw(StrEnum):
    """How the angular velocity goes on from one command to the next."""

    IMPLICIT = "implicit"  # stable for any step; the designed dynamics
    EXPLICIT = "explicit"  # as it was: a limit cycle where step times K3 is above 2


@dataclass(frozen=True, slots=True)
class Regulator:
    """Steers to a line: w' = -K3 (w - w_ff) - K2 q - K1 d.

    Attributes:
        k1: rad/s2 for a metre beside the line.
        k2: rad/s2 for a radian off its heading.
        k3: 1/s.
        most_offset: metres that count at most.
        c1: m/s taken off the speed for a rad/s; the explicit law has none.
        step_s: time from one command to the next, as the law takes it.
        law: implicit or explicit.
    """

    k1: float
    k2: float
    k3: float
    most_offset: float
    c1: float
    step_s: float
    law: ControlLaw = ControlLaw.IMPLICIT

    def follow_line(self, line: Pose, pose: Pose, v: float, before: Twist) -> Twist:
        """Return the command along a line at a speed, positive or negative."""
        return self._steer(line.left(pose), wrap(pose.heading - line.heading), v, before)

    def follow_circle(
        self, centre: Pose, radius: float, pose: Pose, v: float, before: Twist
    ) -> Twist:
        """Return the command round a circle, to the left for a positive radius."""
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
