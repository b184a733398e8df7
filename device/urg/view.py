"""What a sensor sees in one scan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from math import inf, tau
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
        """Return a number for each `cluster` steps: the least distance of them in mm.

        Where none has a distance, it is the code of the first.
        """
        steps = [self._distance(step) for step in range(first, last + 1)]
        width = max(1, cluster)
        return tuple(self._least(steps[at : at + width]) for at in range(0, len(steps), width))

    def _least(self, numbers: Sequence[int]) -> int:
        good = [number for number in numbers if number >= self.kind.nearest_mm]
        return min(good, default=numbers[0])

    def _distance(self, step: int) -> int:
        kind, pose = self.kind, self.pose
        if not kind.first <= step <= kind.last:
            return NoDistance.NOT_MEASURABLE
        angle_rad = pose.heading_rad + (step - kind.front) * tau / kind.resolution
        distance_m = self.world.distance_m(pose.x_m, pose.y_m, angle_rad)
        if distance_m == inf:
            return NoDistance.WEAK
        distance_mm = round(distance_m * 1_000 + self._error_mm(step, distance_m))
        if distance_mm > kind.farthest_mm:
            return NoDistance.WEAK
        return distance_mm if distance_mm >= kind.nearest_mm else NoDistance.OTHER

    def _error_mm(self, step: int, distance_m: float) -> float:
        """Return the noise of a step: uniform, and the same whoever asks."""
        if not self.parameters.noise:
            return 0.0
        most_mm = self.parameters.noise * max(10.0, distance_m * 10)
        chance = Chance(self.parameters.seed, f"{self.number} {step}")
        return most_mm * (chance.draw() / HALF - 1)
