"""A wheel with its motor, gear and encoder."""

from __future__ import annotations

from math import copysign, floor
from typing import Final

from tickrig.device.rh3.parameters import BaseParameters
from tickrig.device.twin import Part

SLOW: Final = 0.5
"""Counts/ms below which friction can hold a wheel."""

BRAKE: Final = 500.0
"""Per mille of torque with which the shorted motor brakes; a choice."""


class Wheel(Part):
    """Turns by torque against friction and load, a millisecond a step.

    Not emulated: inductance and back-EMF of the motor, play and stiffness of the gear,
    heat.

    Args:
        parameters: of the base.

    Attributes:
        travel: counts since the start of the rig, with fractions.
        speed: counts/ms.
        load: torque against forward motion, per mille.
        jammed: something holds the wheel.
        friction: per mille of torque that it takes to turn it.
        agility: counts/ms gained in a millisecond by a per mille of torque.
    """

    def __init__(self, parameters: BaseParameters) -> None:
        self.agility = parameters.agility
        self.friction = parameters.per_mille(parameters.friction_nm)
        self.travel = self.speed = self.load = 0.0
        self.jammed = False

    @property
    def counts(self) -> int:
        """What the encoder has counted."""
        return floor(self.travel)

    def held(self, torque: float) -> bool:
        """Whether it stands and stays so under a torque."""
        return not self.speed and (self.jammed or abs(torque - self.load) <= self.friction)

    def step(self, torque: float) -> None:
        """Turn for a millisecond with a torque in per mille."""
        speed, friction, net = self.speed, self.friction, torque - self.load
        if self.jammed or (-SLOW < speed < SLOW and -friction <= net <= friction):
            self.speed = 0.0
            return
        against = friction if (speed or net) > 0 else -friction
        self.speed = speed = speed + (net - against) * self.agility
        self.travel += speed

    def brake(self) -> None:
        """Turn for a millisecond with the motor shorted."""
        most = min(BRAKE, abs(self.speed) / self.agility)
        self.step(-copysign(most, self.speed) if self.speed else 0.0)
