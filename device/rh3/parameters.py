"""Parameters of a base, each with its source and reason."""

from __future__ import annotations

from dataclasses import dataclass
from math import tau
from typing import Final

from tickrig.device.twin import Immutable
from tickrig.wire.modbus import ADDRESSES

_GEAR_RATIO: Final = 74.91
"""Number of motor turns per turn of the wheel (RH3 functional specification, RefHardRh3)."""
ENCODER_COUNTS: Final = 2_000
"""Number of counts per turn of the motor (same source)."""
COUNTS_PER_RAD: Final = _GEAR_RATIO * ENCODER_COUNTS / tau
"""Number of counts per radian of the wheel: 23 844.6."""

_DEFAULT_GAIN: Final = 10
"""Value of gain_VP for which the speed loop has its time constant."""
PER_MILLE: Final = 1_000.0


@dataclass(frozen=True, slots=True, kw_only=True)
class BaseParameters(Immutable):
    """Parameters of a base and the ground it stands on.

    Attributes:
        address: address of the driver on the line, 1..247.
        radius_left_m: effective radius of the left wheel. The calibrated radius of the
            specification is 0.0995.
        radius_right_m: effective radius of the right wheel.
        tread_m: effective distance between the wheels. The calibrated distance is 0.464.
        mass_kg: mass of the robot, which is our choice because the specification gives no mass.
        friction: coefficient of friction between wheels and ground, or None if the wheels never
            slip.
        response_s: time constant of the speed loop at the default gains without load.
        delay_ms: time from the arrival of a command to its effect.
        rated_nm: torque at a wheel at 1000 per mille, which is our choice.
        rated_ma: current at the rated torque, which is our choice.
        friction_nm: friction of a motor with its gear. The driver compensates it while the motor
            moves.
        noise: spread of the distance that a wheel moves over the ground, as a share of the
            distance.
        seed: seed of the noise.

    Raises:
        ValueError: a number is out of range.
    """

    address: int = 1
    radius_left_m: float = 0.0995
    radius_right_m: float = 0.0995
    tread_m: float = 0.464
    mass_kg: float = 60.0
    friction: float | None = None
    response_s: float = 0.05
    delay_ms: int = 0
    rated_nm: float = 25.0
    rated_ma: int = 3_000
    friction_nm: float = 0.5
    noise: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        """Raise ValueError if a number is out of range."""
        if self.address not in ADDRESSES:
            raise ValueError(f"address {self.address} is not in 1..{ADDRESSES[-1]}")
        for name in ("radius_left_m", "radius_right_m", "tread_m", "rated_nm"):
            if not 0 < (value := getattr(self, name)) < 1_000:
                raise ValueError(f"{name} {value} is not above 0 and below 1000")
        for name in ("mass_kg", "response_s", "delay_ms", "friction_nm", "noise", "rated_ma"):
            if not 0 <= (value := getattr(self, name)) <= 60_000:
                raise ValueError(f"{name} {value} is not in 0..60000")
        if self.friction is not None and not 0 <= self.friction <= 10:
            raise ValueError(f"friction {self.friction} is not in 0..10")

    @property
    def agility(self) -> float:
        """Speed in counts/ms that a per mille of torque adds in a millisecond."""
        return 1 / (_DEFAULT_GAIN * max(1.0, self.response_s * 1_000))

    def per_mille(self, torque_nm: float) -> float:
        """Return a torque at a wheel in per mille of the rated torque."""
        return torque_nm / self.rated_nm * PER_MILLE
