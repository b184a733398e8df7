"""Where a body is, and how far an arc takes it."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, remainder, sin, tau

from tickrig.device.twin import Immutable


@dataclass(frozen=True, slots=True)
class Pose(Immutable):
    """A place on a plane, and the way to look.

    Attributes:
        x_m: metres.
        y_m: metres, to the left of x.
        heading_rad: from x towards y, not wrapped.
    """

    x_m: float = 0.0
    y_m: float = 0.0
    heading_rad: float = 0.0

    @property
    def wrapped_rad(self) -> float:
        """The heading within half a turn to each side."""
        return remainder(self.heading_rad, tau)

    def moved(self, left_m: float, right_m: float, tread_m: float) -> Pose:
        """Return the pose after both sides have rolled at steady speeds.

        The path is an arc, which is taken exactly: its chord has the heading
        of its middle.

        Args:
            left_m: way of the left wheels.
            right_m: way of the right wheels.
            tread_m: distance between left and right wheels.

        >>> Pose().moved(1.0, 1.0, 0.4)
        Pose(x_m=1.0, y_m=0.0, heading_rad=0.0)
        """
        return Pose(*arc((self.x_m, self.y_m, self.heading_rad), left_m, right_m, tread_m))


def arc(
    place: tuple[float, float, float], left_m: float, right_m: float, tread_m: float
) -> tuple[float, float, float]:
    """Return x, y and heading after an arc; `Pose.moved` in plain numbers, for each step."""
    x_m, y_m, heading_rad = place
    turn_rad = (right_m - left_m) / tread_m
    half_rad = turn_rad / 2
    chord_m = (left_m + right_m) / 2
    if half_rad:
        chord_m *= sin(half_rad) / half_rad
    middle_rad = heading_rad + half_rad
    return (
        x_m + chord_m * cos(middle_rad),
        y_m + chord_m * sin(middle_rad),
        heading_rad + turn_rad,
    )
