"""What the drive demands of its motor at this instant."""

from __future__ import annotations

from enum import Enum, auto
from typing import Final

from tickrig.device.twin import Part

STEP_S: Final = 0.001
"""Period of the control, in seconds: one tick."""


class Control(Enum):
    """Which loop of the motor a mode works with."""

    POSITION = auto()
    VELOCITY = auto()
    CURRENT = auto()


class Reference(Part):
    """The demanded motion; it belongs to the drive and outlives a change of the mode.

    What a mode does not control follows the motor: the position in velocity modes,
    position and velocity in torque modes. So each mode finds a reference from
    which it can go on without a jump.

    Attributes:
        position: counts of the motor's encoder.
        velocity: counts per second.
        acceleration: counts per second per second, for the feed-forward.
        current_a: amperes.
    """

    __slots__ = ("acceleration", "current_a", "position", "velocity")

    def __init__(self) -> None:
        self.position = self.velocity = self.acceleration = self.current_a = 0.0

    def ramp(self, velocity: float, acceleration: float, deceleration: float) -> bool:
        """Make a step towards a velocity. Returns: whether it is reached.

        Args:
            velocity: counts per second.
            acceleration: of the step away from zero, positive.
            deceleration: of the step towards zero, positive.
        """
        before = self.velocity
        braking = abs(velocity) < abs(before) or velocity * before < 0
        most = (deceleration if braking else acceleration) * STEP_S
        change = velocity - before
        if abs(change) <= most:
            self.move(velocity)
            return True
        self.move(before + (most if change > 0 else -most))
        return False

    def move(self, velocity: float) -> None:
        """Make a step with constant acceleration that ends with a velocity."""
        before, self.velocity = self.velocity, velocity
        self.acceleration = (velocity - before) / STEP_S
        self.position += (before + velocity) / 2 * STEP_S

    def place(self, position: float, velocity: float = 0.0, acceleration: float = 0.0) -> None:
        """Be somewhere, as a generator of positions says."""
        self.position, self.velocity, self.acceleration = position, velocity, acceleration
