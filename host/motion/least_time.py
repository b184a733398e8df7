"""The least time that a cart within its limits can take: each turn and line for itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import sqrt

from tickrig.host.motion.geometry import Pose, wrap


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """What a cart can do at most: m/s, rad/s, m/s2, rad/s2; as the default set has it."""

    v: float = 0.3
    w: float = 0.3
    acceleration: float = 0.3
    angular_acceleration: float = 5.0


def way_time_s(way: float, speed: float, acceleration: float) -> float:
    """Return how long a way takes from rest to rest.

    >>> way_time_s(3.0, 0.3, 0.3), way_time_s(0.3, 1.0, 0.3)
    (11.0, 2.0)
    """
    if way < speed * speed / acceleration:
        return 2 * sqrt(way / acceleration)
    return way / speed + speed / acceleration


def least_time_s(relays: Sequence[Pose], can: MotionLimits | None = None) -> float:
    """Return the least time along a list of `omni_to_2wd.plan`.

    >>> round(least_time_s([Pose(), Pose(), Pose(3.0), Pose(3.0, 0.0, 0.3)]), 2)
    12.06
    """
    can = can or MotionLimits()
    return sum(
        way_time_s(here.distance(there), can.v, can.acceleration)
        + way_time_s(abs(wrap(there.heading - here.heading)), can.w, can.angular_acceleration)
        for here, there in pairwise(relays)
    )
