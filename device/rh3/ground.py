"""The ground under a base: where its wheels have taken it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from tickrig.device.body.contact import Contact
from tickrig.device.body.pose import Pose, arc
from tickrig.device.chance import Chance
from tickrig.device.rh3.parameters import COUNTS_PER_RAD, BaseParameters
from tickrig.device.twin import Part

STEP_S: Final = 1e-3
HALF: Final = 2.0**63


class Ground(Part):
    """Takes the turning of two wheels for a way over the ground, on exact arcs.

    Not emulated: castors, slopes, walls; a slipping wheel turns as easily as before.

    Args:
        parameters: of the base.

    Attributes:
        speed_m_s: forward, in the latest step.
        turn_rad_s: to the left, in the latest step.
        left: the left wheel's contact.
        right: the right wheel's contact.
    """

    def __init__(self, parameters: BaseParameters) -> None:
        share_kg, friction = parameters.mass_kg / 2, parameters.friction
        self.left = Contact(parameters.radius_left_m, share_kg, friction)
        self.right = Contact(parameters.radius_right_m, share_kg, friction)
        self._tread_m, self._noise = parameters.tread_m, parameters.noise
        self._grips = friction is None
        self._chance = Chance(parameters.seed, "ground")
        self.pose, self.speed_m_s, self.turn_rad_s = Pose(), 0.0, 0.0

    @property
    def pose(self) -> Pose:
        """Where the middle of the axle is; it may be put elsewhere."""
        return Pose(*self._place)

    @pose.setter
    def pose(self, pose: Pose) -> None:
        self._place = (pose.x_m, pose.y_m, pose.heading_rad)

    @property
    def resting(self) -> bool:
        """Whether a step without turning would change nothing."""
        return not (self.speed_m_s or self.turn_rad_s or self.left.slip_m_s or self.right.slip_m_s)

    def roll(self, lefts: Sequence[float], rights: Sequence[float]) -> None:
        """Let milliseconds pass.

        Args:
            lefts: by how many counts the left wheel turned in each.
            rights: the same of the right wheel.
        """
        left, right, tread_m, place = self.left, self.right, self._tread_m, self._place
        grips, noise, left_m, right_m = self._grips, self._noise, 0.0, 0.0
        for each, other in zip(lefts, rights):  # noqa: B905 - strict takes as long as a step
            left_rad, right_rad = each / COUNTS_PER_RAD, other / COUNTS_PER_RAD
            if grips:
                left_m, right_m = left_rad * left.radius_m, right_rad * right.radius_m
            else:
                left_m, right_m = left.roll(left_rad, STEP_S), right.roll(right_rad, STEP_S)
            if noise:
                left_m, right_m = self._roughened(left_m), self._roughened(right_m)
            if left_m or right_m:
                place = arc(place, left_m, right_m, tread_m)
        self._place = place
        self.speed_m_s = (left_m + right_m) / 2 / STEP_S
        self.turn_rad_s = (right_m - left_m) / tread_m / STEP_S

    def _roughened(self, way_m: float) -> float:
        """Return a way with the noise of the ground: uniform, from one step to the next anew."""
        if not way_m:
            return 0.0
        return way_m * (1 + self._noise * (self._chance.draw() / HALF - 1))
