"""What a sensor sees in one scan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from math import isinf, tau
from typing import Final

from tickrig.device.body.pose import Pose
from tickrig.device.chance import Chance
from tickrig.device.urg.parameters import UrgParameters
from tickrig.device.urg.world import World
from tickrig.wire.scip.description import Specification

HALF: Final = 2.0**63


class NoDistance(IntEnum):
    """Numbers below DMIN that are no distances (SCIP 2.0, error codes)."""

    WEAK = 1
    OTHER = 6
    NOT_MEASURABLE = 19


@dataclass(frozen=True, slots=True)
class View:
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
        numbers = self._numbers(range(first, last + 1))
        if cluster <= 1:
            return tuple(numbers)
        places = range(0, len(numbers) - cluster + 1, cluster)
        return tuple(self._least(numbers[at : at + cluster]) for at in places)

    def _least(self, numbers: Sequence[int]) -> int:
        good = [number for number in numbers if number >= self.kind.nearest_mm]
        return min(good, default=numbers[0])

    def _numbers(self, steps: Sequence[int]) -> list[int]:
        kind, pose = self.kind, self.pose
        angles = [pose.heading_rad + (s - kind.front) * tau / kind.resolution for s in steps]
        ways_m = self.world.distances_m(pose.x_m, pose.y_m, angles)
        if self.parameters.noise:
            pairs = zip(steps, ways_m, strict=True)
            ways_m = [
                way_m if isinf(way_m) else way_m + self._error_mm(step, way_m) / 1_000
                for step, way_m in pairs
            ]
        near_m, far_m = kind.nearest_mm / 1_000, kind.farthest_mm / 1_000
        return [
            NoDistance.NOT_MEASURABLE
            if not kind.first <= step <= kind.last
            else NoDistance.WEAK
            if way_m > far_m
            else NoDistance.OTHER
            if way_m < near_m
            else round(way_m * 1_000)
            for step, way_m in zip(steps, ways_m, strict=True)
        ]

    def _error_mm(self, step: int, distance_m: float) -> float:
        """Return the noise of a step: uniform, and the same whoever asks."""
        most_mm = self.parameters.noise * max(10.0, distance_m * 10)
        chance = Chance(self.parameters.seed, f"{self.number} {step}")
        return most_mm * (chance.draw() / HALF - 1)
