"""Parameters of motors, power stages, gears, encoders and control loops.

Units are in the names; the presets are in `tickrig.device.servo.parameters`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from tickrig.device.twin import Immutable

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


@dataclass(frozen=True, slots=True)
class MotorParameters(Immutable):
    """Parameters of a permanent-magnet motor, brushed or brushless, modelled as one winding.

    Attributes:
        resistance_ohm: terminal resistance at 25 degC.
        inductance_h: terminal inductance.
        torque_constant_nm_a: torque per current. It also is the back-EMF per speed (V s/rad).
        inertia_kg_m2: inertia of the rotor.
        coulomb_nm: dry friction of the rotor, which is more than 0 so that the rotor comes to rest.
        viscous_nm_s: friction torque that grows with the speed, per rad/s.
        winding_housing_k_w: thermal resistance from the winding to the housing.
        housing_ambient_k_w: thermal resistance from the housing to the air.
        winding_s: thermal time constant of the winding while the housing keeps its temperature.
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
        _require_positive(self, zero=("viscous_nm_s",))


@dataclass(frozen=True, slots=True)
class PowerStage(Immutable):
    """Parameters of a servo's power stage, a four-quadrant stage of ideal switches.

    Attributes:
        continuous_a: current that the stage carries permanently.
        peak_a: largest current of the stage.
        peak_s: time for which the stage carries the peak current.
        duty_max: largest part of the supply voltage that reaches the winding, 0..1.
        supply_v: supply voltage at the start.
        supply_min_v: supply voltage below which the switches stay open.
    """

    continuous_a: float
    peak_a: float
    peak_s: float
    duty_max: float
    supply_v: float
    supply_min_v: float

    def __post_init__(self) -> None:
        _require_positive(self)
        if self.peak_a < self.continuous_a:
            raise ValueError(f"peak_a {self.peak_a} is below continuous_a {self.continuous_a}")
        if self.duty_max > 1:
            raise ValueError(f"duty_max {self.duty_max} is not in 0..1")


@dataclass(frozen=True, slots=True)
class GearParameters(Immutable):
    """Parameters of a gear without play, with the inertia and friction of its output shaft.

    Attributes:
        ratio: number of motor turns per turn of the output shaft.
        efficiency: efficiency of the gear for an external torque, above 0 and up to 1. If the
            torque acts against the motion, the motor must supply the torque divided by
            `efficiency`. If the torque acts in the direction of the motion, the torque multiplied
            by `efficiency` reaches the motor.
        inertia_kg_m2: inertia at the output shaft, without the motor's own inertia.
        coulomb_nm: dry friction at the output shaft.
    """

    ratio: float = 1.0
    efficiency: float = 1.0
    inertia_kg_m2: float = 0.0
    coulomb_nm: float = 0.0

    def __post_init__(self) -> None:
        _require_positive(self, zero=("inertia_kg_m2", "coulomb_nm"))
        if self.efficiency > 1:
            raise ValueError(f"efficiency {self.efficiency} is not in 0..1")


@dataclass(frozen=True, slots=True)
class Encoders(Immutable):
    """Resolution of a servo's motor encoder, and of the absolute encoder of its output shaft.

    Attributes:
        counts_per_turn: number of quadrature counts per turn of the motor.
        gear_counts_per_turn: number of counts of the absolute encoder per turn of the output shaft,
            or 0 if the servo has no absolute encoder.
    """

    counts_per_turn: int
    gear_counts_per_turn: int = 0

    def __post_init__(self) -> None:
        _require_positive(self, zero=("gear_counts_per_turn",))


@dataclass(frozen=True, slots=True)
class LoopGains(Immutable):
    """Tuning of a servo's velocity and position loops.

    The values apply to the inertia of the servo without the additional inertia `load_kg_m2`.

    Attributes:
        velocity_rad_s: natural frequency of the velocity loop.
        damping: damping ratio of the velocity loop. The damping ratio falls when an additional
            inertia is attached: 1.5 becomes 0.47 if the total inertia is ten times as large.
        position_rad_s: bandwidth of the position loop.
    """

    velocity_rad_s: float = 100.0
    damping: float = 1.5
    position_rad_s: float = 40.0

    def __post_init__(self) -> None:
        _require_positive(self)


@dataclass(frozen=True, slots=True)
class ServoParameters(Immutable):
    """All parameters of a servo."""

    motor: MotorParameters
    stage: PowerStage
    encoders: Encoders
    gear: GearParameters = field(default_factory=GearParameters)
    gains: LoopGains = field(default_factory=LoopGains)

    @property
    def inertia_kg_m2(self) -> float:
        """Inertia at the motor shaft, without the load on the output."""
        return self.motor.inertia_kg_m2 + self.gear.inertia_kg_m2 / self.gear.ratio**2

    @property
    def coulomb_nm(self) -> float:
        """Dry friction at the motor shaft, including the gear."""
        return self.motor.coulomb_nm + self.gear.coulomb_nm / self.gear.ratio


def _require_positive(table: DataclassInstance, zero: tuple[str, ...] = ()) -> None:
    """Check that all numbers of a table are above 0; the numbers named in `zero` may be 0.

    Raises:
        ValueError: a number is out of range.
    """
    for name in (item.name for item in fields(table)):
        value = getattr(table, name)
        if not (value > 0 or (name in zero and value == 0)):
            allowed = "0 or more" if name in zero else "more than 0"
            raise ValueError(f"{name} {value} is not {allowed}")


# Included servos, with the sources of their numbers (docs/reference/devices/servo.md).

RE_30: Final = MotorParameters(  # maxon catalogue, RE 30, 60 W, 24 V, order number 310007
    resistance_ohm=0.611,
    inductance_h=0.119e-3,
    torque_constant_nm_a=25.9e-3,
    inertia_kg_m2=33.5e-7,
    coulomb_nm=3.4e-3,  # with the next: no-load current 164 mA at 8810 rpm; split ours
    viscous_nm_s=0.92e-6,
    winding_housing_k_w=1.7,
    housing_ambient_k_w=6.0,
    winding_s=16.2,
    housing_s=593.0,
    winding_max_c=125.0,
)

EPOS_24_5: Final = PowerStage(  # EPOS 24/5: 11..24 V, 5 A, 10 A for 1 s, 0.9 of the supply
    continuous_a=5.0,
    peak_a=10.0,
    peak_s=1.0,
    duty_max=0.9,
    supply_v=24.0,
    supply_min_v=9.0,  # chosen, below the 11 V of its manual
)

EPOS_WHEEL: Final = ServoParameters(
    motor=RE_30,
    stage=EPOS_24_5,
    encoders=Encoders(counts_per_turn=2_000),  # 500 pulses
    gear=GearParameters(  # chosen, typical of a planetary gear of 32 mm with three stages
        ratio=51.0,
        efficiency=0.70,
        inertia_kg_m2=2.0e-3,
        coulomb_nm=0.05,
    ),
)

_CORE_RATIO: Final = 100.0  # strain wave gear, chosen

CORE_MOTOR: Final = MotorParameters(  # chosen, typical of a brushless motor of 100 W, but:
    resistance_ohm=0.5,
    inductance_h=0.5e-3,
    torque_constant_nm_a=9.0 / _CORE_RATIO,  # table 5: 60 rpm at 60 V, of which 0.95 arrive
    inertia_kg_m2=4.0e-6,
    coulomb_nm=2.0e-3,  # with the gear's: 0.5 Nm at the output
    viscous_nm_s=1.0e-6,
    winding_housing_k_w=8.0,  # so that a winding can be too hot before its housing is
    housing_ambient_k_w=2.5,
    winding_s=20.0,
    housing_s=900.0,
    winding_max_c=125.0,
)

FTMD: Final = PowerStage(  # NEDO report, FTMD 1 axis: 7 A continuous, 10 A peak, 10..60 V
    continuous_a=7.0,
    peak_a=10.0,
    peak_s=2.0,  # chosen
    duty_max=0.95,  # chosen
    supply_v=60.0,
    supply_min_v=10.0,
)

MOTOR_CORE_UNIT: Final = ServoParameters(
    motor=CORE_MOTOR,
    stage=replace(  # the driver, set to what the gear bears (table 5): 15 Nm, 30 Nm at the peak
        FTMD, continuous_a=15.0 / 9.0, peak_a=30.0 / 9.0
    ),
    encoders=Encoders(counts_per_turn=4_096, gear_counts_per_turn=65_536),  # chosen
    gear=GearParameters(  # with the rotor: 0.05 kg m2 at the output
        ratio=_CORE_RATIO,
        efficiency=1.0,  # its loss is in the torque constant and in the friction
        inertia_kg_m2=0.01,
        coulomb_nm=0.3,
    ),
    gains=LoopGains(),
)

PRESETS: Final[Mapping[str, ServoParameters]] = MappingProxyType(
    {"epos-wheel": EPOS_WHEEL, "motor-core-unit": MOTOR_CORE_UNIT}
)


# Servos scaled to the size that a joint needs.


def peak_torque_nm(servo: ServoParameters) -> float:
    """Return the torque of the peak current at the output shaft, without friction.

    >>> from tickrig.device.servo.parameters import EPOS_WHEEL
    >>> round(peak_torque_nm(EPOS_WHEEL), 2)
    13.21
    """
    return servo.stage.peak_a * servo.motor.torque_constant_nm_a * servo.gear.ratio


def free_speed_rad_s(servo: ServoParameters) -> float:
    """Return the speed at which a servo without load turns at its largest voltage, in rad/s.

    At this speed of the output shaft the back-EMF equals the voltage.

    >>> from tickrig.device.servo.parameters import EPOS_WHEEL
    >>> round(free_speed_rad_s(EPOS_WHEEL), 1)
    16.4
    """
    volts = servo.stage.duty_max * servo.stage.supply_v
    return volts / servo.motor.torque_constant_nm_a / servo.gear.ratio


def of_size(servo: ServoParameters, size: float) -> ServoParameters:
    """Return the parameters of a servo that is as strong as several equal servos on one shaft.

    Currents, torques, inertias and friction are multiplied by the number of servos. Electrical and
    thermal resistances are divided by it. Speeds, voltages, temperatures and all time constants
    stay the same.

    Args:
        servo: the parameters of one servo.
        size: number of servos, above 0. A fraction gives a smaller servo.
    """
    motor, stage, gear = servo.motor, servo.stage, servo.gear
    return replace(
        servo,
        motor=replace(
            motor,
            resistance_ohm=motor.resistance_ohm / size,
            inductance_h=motor.inductance_h / size,
            inertia_kg_m2=motor.inertia_kg_m2 * size,
            coulomb_nm=motor.coulomb_nm * size,
            viscous_nm_s=motor.viscous_nm_s * size,
            winding_housing_k_w=motor.winding_housing_k_w / size,
            housing_ambient_k_w=motor.housing_ambient_k_w / size,
        ),
        stage=replace(stage, continuous_a=stage.continuous_a * size, peak_a=stage.peak_a * size),
        gear=replace(
            gear, inertia_kg_m2=gear.inertia_kg_m2 * size, coulomb_nm=gear.coulomb_nm * size
        ),
    )
