"""Where the energy of a servo went."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class Losses:
    """Energies since the start.

    Attributes:
        electrical_j: what came out of the power stage.
        copper_j: heat of the winding.
        friction_j: heat of friction and gear, and of a shaft that was held.
        square_a2s: integral of the squared current, from which the drive takes its share.
    """

    electrical_j: float = 0.0
    copper_j: float = 0.0
    friction_j: float = 0.0
    square_a2s: float = 0.0
