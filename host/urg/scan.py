"""One scan, in the units of people."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import tau

from tickrig.wire.scip.description import Specification


@dataclass(frozen=True, slots=True)
class Scan:
    """What a sensor measured in one turn.

    Attributes:
        time_ms: its timer when the turn began, 24 bits.
        first: step of the first number.
        cluster: steps for each number.
        distances_mm: as they came; what is below DMIN is a code, no distance.
        kind: limits and steps of the sensor.
    """

    time_ms: int
    first: int
    cluster: int
    distances_mm: tuple[int, ...]
    kind: Specification

    def angle_rad(self, place: int) -> float:
        """Return the direction of a number, from straight ahead to the left."""
        step = self.first + place * self.cluster + (self.cluster - 1) / 2
        return (step - self.kind.front) * tau / self.kind.resolution

    def points(self) -> Iterator[tuple[float, float]]:
        """Yield direction in rad and distance in m, where there is one."""
        low, high = self.kind.nearest_mm, self.kind.farthest_mm
        for place, distance_mm in enumerate(self.distances_mm):
            if low <= distance_mm <= high:
                yield self.angle_rad(place), distance_mm / 1_000
