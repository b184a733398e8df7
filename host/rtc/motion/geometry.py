"""Poses on a plane: metres, and radians from x towards y."""

from __future__ import annotations

from math import atan2, cos, hypot, pi, remainder, sin, tau
from typing import NamedTuple


class Pose(NamedTuple):
    """Position (x and y in m) and heading (in rad) on a plane."""

    x: float = 0.0
    y: float = 0.0
    heading: float = 0.0

    def along(self, point: Pose) -> float:
        """Return the distance of a point ahead of this pose, measured along its heading."""
        return (point.x - self.x) * cos(self.heading) + (point.y - self.y) * sin(self.heading)

    def left(self, point: Pose) -> float:
        """Return how far a point is to the left of this pose, at right angles to its heading.

        If the point is to the right, the result is negative.
        """
        return (point.y - self.y) * cos(self.heading) - (point.x - self.x) * sin(self.heading)

    def distance(self, point: Pose) -> float:
        """Return the distance to a point."""
        return hypot(point.x - self.x, point.y - self.y)

    def bearing(self, point: Pose) -> float:
        """Return the heading towards a point."""
        return atan2(point.y - self.y, point.x - self.x)

    def turn_to(self, pose: Pose) -> float:
        """Return the angle between the headings of two poses, without its sign."""
        return abs(wrap(pose.heading - self.heading))


class Twist(NamedTuple):
    """A velocity, forward and to the left in m/s, and turning in rad/s."""

    v: float = 0.0
    w: float = 0.0


def wrap(angle: float) -> float:
    """Wrap an angle to the range -pi..pi. Half a turn is pi, not -pi.

    >>> wrap(3 * pi) == wrap(-pi) == pi
    True
    """
    wrapped = remainder(angle, tau)
    return pi if wrapped == -pi else wrapped


def positive(angle: float) -> float:
    """Wrap an angle to the range 0..2 pi, as the IIS interfaces recommend."""
    return angle % tau


def clip(value: float, limit: float) -> float:
    """Return a value limited in both directions."""
    return min(max(value, -limit), limit)


class Wheels(NamedTuple):
    """Wheel radii and axle length of a cart in m, which its odometry needs."""

    left: float
    right: float
    axle: float


def wheel_speeds(
    twist: Twist, tread: float, radius_left: float, radius_right: float
) -> tuple[float, float]:
    """Return the speeds of the left and the right wheel in rad/s."""
    half = twist.w * tread / 2
    return (twist.v - half) / radius_left, (twist.v + half) / radius_right


def moved(pose: Pose, left_m: float, right_m: float, tread: float) -> Pose:
    """Return the pose of a cart after its wheels have rolled given distances, on an exact arc.

    Args:
        pose: pose before the motion.
        left_m: distance of the left wheel in m.
        right_m: distance of the right wheel in m.
        tread: distance between the wheels in m.

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
    """Return the velocity of a cart whose wheels roll at these speeds in m/s."""
    return Twist((left + right) / 2, (right - left) / tread)
