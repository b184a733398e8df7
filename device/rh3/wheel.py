"""A wheel with its motor, gear and encoder."""

from __future__ import annotations

from math import copysign, floor
from typing import Final

from tickrig.device.rh3.parameters import COUNTS_PER_RAD, BaseParameters

SLOW: Final = 0.5
"""Counts/ms below which friction can hold a wheel."""

BRAKE: Final = 500.0
"""Per mille of torque with which the shorted motor brakes; a choice."""


class Wheel:
    """Turns by torque against friction and load, a millisecond a step.

    Not emulated: inductance and back-EMF of the motor, play and stiffness of the gear,
    heat.

    Args:
        parameters: of the base.

    Attributes:
        travel: counts since the start of the rig, with fractions.
        speed: counts/ms.
        load_nm: torque against forward motion.
        jammed: something holds the wheel.
        friction: per mille of torque that it takes to turn it.
    """

    def __init__(self, parameters: BaseParameters) -> None:
        self._agility, self._per_mille = parameters.agility, parameters.per_mille
        self.friction = parameters.per_mille(parameters.friction_nm)
        self.travel = self.speed = self.load_nm = 0.0
        self.jammed = False

    @property
    def counts(self) -> int:
        """What the encoder has counted."""
        return floor(self.travel)

    @property
    def angle_rad(self) -> float:
        """Angle since the start of the rig."""
        return self.travel / COUNTS_PER_RAD

    @property
    def turned_rad(self) -> float:
        """Angle of the latest step."""
        return self.speed / COUNTS_PER_RAD

    def held(self, torque: float) -> bool:
        """Whether it stands and stays so under a torque."""
        return not self.speed and (self.jammed or self._gripped(self._net(torque)))

    def step(self, torque: float) -> None:
        """Turn for a millisecond with a torque in per mille."""
        net = self._net(torque)
        if self.jammed or (abs(self.speed) < SLOW and self._gripped(net)):
            self.speed = 0.0
            return
        self.speed += (net - copysign(self.friction, self.speed or net)) * self._agility
        self.travel += self.speed

    def brake(self) -> None:
        """Turn for a millisecond with the motor shorted."""
        most = min(BRAKE, abs(self.speed) / self._agility)
        self.step(-copysign(most, self.speed) if self.speed else 0.0)

    def _net(self, torque: float) -> float:
        return torque - self._per_mille(self.load_nm)

    def _gripped(self, net: float) -> bool:
        return abs(net) <= self.friction
