"""From turning wheels to a pose (rh3-control, kinematics and odometry)."""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple

from tickrig.host.motion.geometry import Pose, Twist, wrap


class Wheels(NamedTuple):
    """What an odometry takes for the geometry of its cart: radii and axle, m."""

    left: float
    right: float
    axle: float


def wheel_speeds(
    twist: Twist, tread: float, radius_left: float, radius_right: float
) -> tuple[float, float]:
    """Return the speeds of the left and the right wheel, rad/s."""
    half = twist.w * tread / 2
    return (twist.v - half) / radius_left, (twist.v + half) / radius_right


def moved(pose: Pose, left_m: float, right_m: float, tread: float) -> Pose:
    """Return the pose after the wheels have rolled so far, on an exact arc.

    >>> moved(Pose(), 1.0, 1.0, 0.4)
    Pose(x=1.0, y=0.0, heading=0.0)
    """
    turn = (right_m - left_m) / tread
    half = turn / 2
    chord = (left_m + right_m) / 2 * (sin(half) / half if half else 1.0)
    middle = pose.heading + half
    return Pose(
        pose.x + chord * cos(middle), pose.y + chord * sin(middle), wrap(pose.heading + turn)
    )


def twist_of(left: float, right: float, tread: float) -> Twist:
    """Return the velocity of a cart whose wheels roll at these speeds, m/s."""
    return Twist((left + right) / 2, (right - left) / tread)
