"""Where a wheel touches the ground."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

GRAVITY_M_S2: Final = 9.80665
"""Standard gravity."""


@dataclass(slots=True)
class Contact:
    """A wheel that carries its share of a body over the ground.

    Without `friction` the ground goes with the wheel, and the wheel feels the
    mass as inertia. With it, the ground's speed changes by at most
    friction x gravity; what the wheel turns beyond that is slip. While it slips, the
    wheel feels the force of friction instead of the mass.

    Not emulated: a friction that depends on speed or direction, a share of the
    weight that changes with acceleration.

    Attributes:
        radius_m: of the wheel.
        mass_kg: its share of the body.
        friction: coefficient, None if it never slips.
        speed_m_s: of the ground below it.
        slip_m_s: speed of the rim beyond that, 0 with grip.
    """

    radius_m: float
    mass_kg: float
    friction: float | None = None
    speed_m_s: float = field(default=0.0, init=False)
    slip_m_s: float = field(default=0.0, init=False)

    def roll(self, turn_rad: float, step_s: float) -> float:
        """Turn the wheel at a steady speed; return the way over the ground in metres."""
        rim_m_s = turn_rad * self.radius_m / step_s
        speed_m_s = rim_m_s
        if self.friction is not None:
            most = self.friction * GRAVITY_M_S2 * step_s
            speed_m_s = min(max(rim_m_s, self.speed_m_s - most), self.speed_m_s + most)
        self.speed_m_s, self.slip_m_s = speed_m_s, rim_m_s - speed_m_s
        return speed_m_s * step_s

    @property
    def load_kg_m2(self) -> float:
        """The inertia that the wheel feels."""
        return 0.0 if self.slip_m_s else self.mass_kg * self.radius_m**2

    @property
    def load_nm(self) -> float:
        """The torque that the ground has on the wheel, positive forward."""
        if not self.slip_m_s or self.friction is None:
            return 0.0
        torque_nm = self.friction * self.mass_kg * GRAVITY_M_S2 * self.radius_m
        return -torque_nm if self.slip_m_s > 0 else torque_nm
