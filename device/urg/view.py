"""What a sensor sees in one scan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache
from math import inf, isinf, tau
from typing import Final

from tickrig.device.body.pose import Pose
from tickrig.device.chance import Chance
from tickrig.device.twin import Immutable
from tickrig.device.urg.parameters import UrgParameters
from tickrig.device.urg.ray_cast import Beams
from tickrig.device.urg.world import Rays, World, rays_of
from tickrig.wire.sensors.scip.description import Specification

HALF: Final = 2.0**63


class NoDistance(IntEnum):
    """Numbers below DMIN that are no distances (SCIP 2.0, error codes)."""

    WEAK = 1
    OTHER = 6
    NOT_MEASURABLE = 19


@dataclass(frozen=True, slots=True)
class View(Immutable):
    """A scan; rays are cast when somebody asks for their distances.

    Not emulated: the way that the sensor goes during a scan; angle of incidence, colour and
    gloss of what it sees; a beam that is wider than a line.

    Attributes:
        number: of the scan since power-up.
        time_ms: timer of the sensor when the scan began.
        pose: of the sensor when the scan ended.
        world: at that time.
        kind: limits and steps.
        parameters: noise and seed.
    """

    number: int
    time_ms: int
    pose: Pose
    world: World
    kind: Specification
    parameters: UrgParameters

    def distances(self, first: int, last: int, cluster: int) -> tuple[int, ...]:
        """Return a number for each whole `cluster` of steps: the least distance in mm.

        Where none has a distance, it is the code of the first. Steps behind the last whole
        cluster have no number (DECISION U11).
        """
        kind, ways_m = self.kind, self._ways_m(range(first, last + 1))
        measurable = kind.first <= first and last <= kind.last
        if measurable and cluster > 1:  # round once a cluster: a third of the time of a scan
            least_m = _least_of_each(ways_m, cluster)
            if kind.nearest_mm / 1_000 <= min(least_m, default=inf):
                return tuple(self._numbers(least_m))
        numbers = self._numbers(ways_m)
        if not measurable:
            numbers = [
                number if kind.first <= step <= kind.last else NoDistance.NOT_MEASURABLE
                for step, number in enumerate(numbers, first)
            ]
        if cluster <= 1:
            return tuple(numbers)
        places = range(0, len(numbers) - cluster + 1, cluster)
        return tuple(self._least(numbers[at : at + cluster]) for at in places)

    def _least(self, numbers: Sequence[int]) -> int:
        good = [number for number in numbers if number >= self.kind.nearest_mm]
        return min(good, default=numbers[0])

    def _ways_m(self, steps: range) -> list[float]:
        """Return how far it is in the direction of each step, with the noise of the sensor."""
        kind, pose = self.kind, self.pose
        rays, first_rad = _rays(kind, steps, pose.heading_rad)
        ways_m = Beams(pose.x_m, pose.y_m, rays, first_rad, kind.resolution).cast_m(self.world)
        if not self.parameters.noise:
            return ways_m
        return [
            way_m if isinf(way_m) else way_m + self._error_mm(step, way_m) / 1_000
            for step, way_m in zip(steps, ways_m, strict=True)
        ]

    def _numbers(self, ways_m: Sequence[float]) -> list[int]:
        """Return distances in mm, and codes."""
        near_m, far_m = self.kind.nearest_mm / 1_000, self.kind.farthest_mm / 1_000
        weak, other = int(NoDistance.WEAK), int(NoDistance.OTHER)
        return [
            weak if way_m > far_m else other if way_m < near_m else round(way_m * 1_000)
            for way_m in ways_m
        ]

    def _error_mm(self, step: int, distance_m: float) -> float:
        """Return the noise of a step: uniform, and the same whoever asks."""
        most_mm = self.parameters.noise * max(10.0, distance_m * 10)
        chance = Chance(self.parameters.seed, f"{self.number} {step}")
        return most_mm * (chance.draw() / HALF - 1)


@lru_cache(maxsize=8)
def _off_rad(kind: Specification, steps: range) -> tuple[float, ...]:
    """Return the directions of steps from straight ahead; each scan asks for the same."""
    return tuple((step - kind.front) * tau / kind.resolution for step in steps)


@lru_cache(maxsize=8)  # a robot that stands or goes straight: a third of the time of a scan
def _rays(kind: Specification, steps: range, heading_rad: float) -> tuple[Rays, float]:
    """Return where the beams of steps go, and the angle of the first."""
    angles_rad = [heading_rad + off_rad for off_rad in _off_rad(kind, steps)]
    return rays_of(angles_rad), angles_rad[0] if angles_rad else 0.0


def _least_of_each(ways_m: Sequence[float], cluster: int) -> list[float]:
    """Return the least of each whole cluster."""
    end = len(ways_m) - len(ways_m) % cluster
    return list(map(min, *(ways_m[at:end:cluster] for at in range(cluster))))
