"""A trapezoidal move, as a drive would ask for it."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt


@dataclass(frozen=True, slots=True)
class Trapezoid:
    """From 0 to a distance; velocity and acceleration are positive."""

    distance: float
    velocity: float
    acceleration: float

    @property
    def top(self) -> float:
        return min(self.velocity, sqrt(self.distance * self.acceleration))

    @property
    def seconds(self) -> float:
        return self.distance / self.top + self.top / self.acceleration

    def at(self, seconds: float) -> tuple[float, float, float]:
        """Return position, velocity, acceleration."""
        top, ramp, left = self.top, self.top / self.acceleration, self.seconds - seconds
        if left <= 0:
            return self.distance, 0.0, 0.0
        if seconds < ramp:
            velocity = self.acceleration * seconds
            return velocity * seconds / 2, velocity, self.acceleration
        if left < ramp:
            velocity = self.acceleration * left
            return self.distance - velocity * left / 2, velocity, -self.acceleration
        return top * (seconds - ramp / 2), top, 0.0
