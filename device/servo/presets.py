"""Servos that are shipped, with where their numbers are from (docs/reference/devices/servo.md)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Final

from tickrig.device.servo.parameters import (
    Encoders,
    GearParameters,
    LoopGains,
    MotorParameters,
    PowerStage,
    ServoParameters,
)

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

CORE_RATIO: Final = 100.0  # strain wave gear, chosen

CORE_MOTOR: Final = MotorParameters(  # chosen, typical of a brushless motor of 100 W, but:
    resistance_ohm=0.5,
    inductance_h=0.5e-3,
    torque_constant_nm_a=9.0 / CORE_RATIO,  # table 5: 60 rpm at 60 V, of which 0.95 arrive
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
        ratio=CORE_RATIO,
        efficiency=1.0,  # its loss is in the torque constant and in the friction
        inertia_kg_m2=0.01,
        coulomb_nm=0.3,
    ),
    gains=LoopGains(),
)

PRESETS: Final[Mapping[str, ServoParameters]] = MappingProxyType(
    {"epos-wheel": EPOS_WHEEL, "motor-core-unit": MOTOR_CORE_UNIT}
)
