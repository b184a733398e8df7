"""Turn on the spot to a heading (rh3-control, spin)."""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, pi, sqrt
from typing import Final

from tickrig.host.motion.geometry import Twist, wrap

FLOOR: Final = pi / 90
"""rad/s: the reference spin is never slower than 2 degrees a second."""

ETA: Final = 0.1
"""Share of the angular acceleration that the reference spin uses."""


@dataclass(frozen=True, slots=True)
class ReferenceSpin:
    """The spin of the reference hardware's follower.

    Attributes:
        alpha: angular acceleration, rad/s2.
    """

    alpha: float

    def turn(self, heading: float, present: float, most: float, before: Twist) -> Twist:
        """Return the command towards a heading, at most so fast."""
        q = wrap(heading - present)
        wanted = max(sqrt(2 * ETA * self.alpha * abs(q)), FLOOR)
        return Twist(0.0, copysign(min(most, wanted), q))


@dataclass(frozen=True, slots=True)
class TimeOptimalSpin:
    """A spin that brakes as late as it can, for the angle that it will have when it acts.

    Attributes:
        alpha: angular acceleration, rad/s2.
        step_s: time from one command to the next.
        latency_s: from a pose to the effect of the command made of it.
    """

    alpha: float
    step_s: float
    latency_s: float

    def turn(self, heading: float, present: float, most: float, before: Twist) -> Twist:
        """Return the command towards a heading, at most so fast."""
        e = wrap(present + before.w * self.latency_s - heading)
        w = -copysign(min(most, sqrt(2 * self.alpha * abs(e))), e)
        if (e + self.latency_s * w) * e < 0:
            w = -e / (self.step_s + self.latency_s)
        return Twist(0.0, w)
