"""Speeds that a base can follow (rh3-control, limiter: robot_speed_smooth)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from tickrig.host.motion.geometry import Twist, clip

MOST_ANGULAR_ACCELERATION: Final = 5.0
"""rad/s2: cap of what max_acc_w and acc_cycle give (rh3-control, units)."""


@dataclass(frozen=True, slots=True)
class Limits:
    """What a command may be.

    Attributes:
        v: m/s.
        w: rad/s.
        dv: m/s from one command to the next.
        dw: rad/s from one command to the next.
    """

    v: float
    w: float
    dv: float
    dw: float

    def smooth(self, wanted: Twist, before: Twist) -> Twist:
        """Return the command nearest to what is wanted."""
        v, w = clip(wanted.v, self.v), clip(wanted.w, self.w)
        return Twist(before.v + clip(v - before.v, self.dv), before.w + clip(w - before.w, self.dw))


def steps(
    max_acc_v: float, max_acc_w: float, tick_s: float, acc_cycle_s: float
) -> tuple[float, float]:
    """Return the steps that `max_acc_*` allow in a tick; they are given for each `acc_cycle_s`."""
    share = tick_s / acc_cycle_s
    return max_acc_v * share, min(max_acc_w * share, MOST_ANGULAR_ACCELERATION * tick_s)
