"""Where a robot believes it is: odometry, set right by each place that it passes."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

from tickrig.wire.sensors.ucode import MAX_LEVEL


@dataclass(slots=True)
class Estimate:
    """A position on a plane; how it is found is a choice of the demonstration.

    Attributes:
        range_m: of the reader.
        x_m: where it believes to be.
        y_m: the same, to the left of x.
        fixes: how often a place has set it right.
    """

    range_m: float
    x_m: float = 0.0
    y_m: float = 0.0
    fixes: int = 0

    def move(self, dx_m: float, dy_m: float) -> None:
        """Go on as the odometry did."""
        self.x_m += dx_m
        self.y_m += dy_m

    def fix(self, x_m: float, y_m: float, level: int) -> None:
        """Be as far from a marker as the level of its signal says, in the direction believed."""
        away_m = self.range_m * (1 - level / MAX_LEVEL)
        off_x, off_y = self.x_m - x_m, self.y_m - y_m
        if not (believed_m := hypot(off_x, off_y)):
            return
        self.x_m, self.y_m = x_m + off_x * away_m / believed_m, y_m + off_y * away_m / believed_m
        self.fixes += 1

    def error_m(self, x_m: float, y_m: float) -> float:
        """Return how far it is off."""
        return hypot(self.x_m - x_m, self.y_m - y_m)
