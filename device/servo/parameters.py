"""What a motor, its power stage, its gear, its encoders and its loops are made of.

Units are in the names; the presets are in `tickrig.device.servo.presets`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING

from tickrig.device.twin import Immutable

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


@dataclass(frozen=True, slots=True)
class MotorParameters(Immutable):
    """A permanent-magnet motor, brushed or brushless, seen as one winding.

    Attributes:
        resistance_ohm: terminal resistance at 25 degC.
        inductance_h: terminal inductance.
        torque_constant_nm_a: torque per current, and back-EMF per speed (V s/rad).
        inertia_kg_m2: inertia of the rotor.
        coulomb_nm: dry friction of the rotor; more than 0, so that it comes to rest.
        viscous_nm_s: friction that grows with the speed, per rad/s.
        winding_housing_k_w: thermal resistance from the winding to the housing.
        housing_ambient_k_w: thermal resistance from the housing to the air.
        winding_s: thermal time constant of the winding, the housing held.
        housing_s: thermal time constant of the housing.
        winding_max_c: highest permissible temperature of the winding.
    """

    resistance_ohm: float
    inductance_h: float
    torque_constant_nm_a: float
    inertia_kg_m2: float
    coulomb_nm: float
    viscous_nm_s: float
    winding_housing_k_w: float
    housing_ambient_k_w: float
    winding_s: float
    housing_s: float
    winding_max_c: float

    def __post_init__(self) -> None:
        require_positive(self, zero=("viscous_nm_s",))


@dataclass(frozen=True, slots=True)
class PowerStage(Immutable):
    """A four-quadrant stage of ideal switches.

    Attributes:
        continuous_a: current that it bears for ever.
        peak_a: current that it never exceeds.
        peak_s: how long it bears the peak current.
        duty_max: largest part of the supply that reaches the winding.
        supply_v: supply at the start.
        supply_min_v: below this the switches stay open.
    """

    continuous_a: float
    peak_a: float
    peak_s: float
    duty_max: float
    supply_v: float
    supply_min_v: float

    def __post_init__(self) -> None:
        require_positive(self)
        if self.peak_a < self.continuous_a:
            raise ValueError(f"peak_a {self.peak_a} is below continuous_a {self.continuous_a}")
        if self.duty_max > 1:
            raise ValueError(f"duty_max {self.duty_max} is not in 0..1")


@dataclass(frozen=True, slots=True)
class GearParameters(Immutable):
    """A gear without play, and what is always on its output shaft.

    Attributes:
        ratio: turns of the motor per turn of the output shaft.
        efficiency: part of the power of an external torque that gets through.
        inertia_kg_m2: inertia at the output shaft, the motor's own not counted.
        coulomb_nm: dry friction at the output shaft.
    """

    ratio: float = 1.0
    efficiency: float = 1.0
    inertia_kg_m2: float = 0.0
    coulomb_nm: float = 0.0

    def __post_init__(self) -> None:
        require_positive(self, zero=("inertia_kg_m2", "coulomb_nm"))
        if self.efficiency > 1:
            raise ValueError(f"efficiency {self.efficiency} is not in 0..1")


@dataclass(frozen=True, slots=True)
class Encoders(Immutable):
    """The incremental encoder of the motor, and an absolute one of the output shaft.

    Attributes:
        counts_per_turn: quadrature counts per turn of the motor.
        gear_counts_per_turn: counts of the absolute encoder; 0: there is none.
    """

    counts_per_turn: int
    gear_counts_per_turn: int = 0

    def __post_init__(self) -> None:
        require_positive(self, zero=("gear_counts_per_turn",))


@dataclass(frozen=True, slots=True)
class LoopGains(Immutable):
    """What the loops are tuned to, for the inertia without `load_kg_m2`.

    Attributes:
        velocity_rad_s: natural frequency of the velocity loop.
        damping: its damping; 1.5 leaves 0.47 at ten times the inertia.
        position_rad_s: bandwidth of the position loop.
    """

    velocity_rad_s: float = 100.0
    damping: float = 1.5
    position_rad_s: float = 40.0

    def __post_init__(self) -> None:
        require_positive(self)


@dataclass(frozen=True, slots=True)
class ServoParameters(Immutable):
    """All that makes a servo."""

    motor: MotorParameters
    stage: PowerStage
    encoders: Encoders
    gear: GearParameters = field(default_factory=GearParameters)
    gains: LoopGains = field(default_factory=LoopGains)

    @property
    def inertia_kg_m2(self) -> float:
        """Inertia at the motor shaft, without what hangs on the output."""
        return self.motor.inertia_kg_m2 + self.gear.inertia_kg_m2 / self.gear.ratio**2

    @property
    def coulomb_nm(self) -> float:
        """Dry friction at the motor shaft, that of the gear in it."""
        return self.motor.coulomb_nm + self.gear.coulomb_nm / self.gear.ratio


def require_positive(table: DataclassInstance, zero: tuple[str, ...] = ()) -> None:
    """Refuse a table with a number that is not above 0; those named in `zero` may be 0.

    Raises:
        ValueError: such a number.
    """
    for name in (item.name for item in fields(table)):
        value = getattr(table, name)
        if not (value > 0 or (name in zero and value == 0)):
            allowed = "0 or more" if name in zero else "more than 0"
            raise ValueError(f"{name} {value} is not {allowed}")
