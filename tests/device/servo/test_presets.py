"""What is shipped, against what its makers say, and what no servo can be made of."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import pytest

from tickrig.device.servo.parameters import (
    EPOS_24_5,
    EPOS_WHEEL,
    FTMD,
    MOTOR_CORE_UNIT,
    RE_30,
    Encoders,
    GearParameters,
    free_speed_rad_s,
)

RAD_S_PER_RPM = pi / 30


def test_the_re_30_runs_free_as_its_catalogue_says() -> None:
    k, r = RE_30.torque_constant_nm_a, RE_30.resistance_ohm
    no_load_rad_s = 8_810 * RAD_S_PER_RPM
    friction_nm = RE_30.coulomb_nm + RE_30.viscous_nm_s * no_load_rad_s
    assert friction_nm / k == pytest.approx(0.164, rel=0.01)
    assert (24 - 0.164 * r) / k == pytest.approx(no_load_rad_s, rel=0.002)


def test_the_re_30_is_as_stiff_and_as_fast_as_its_catalogue_says() -> None:
    k, r = RE_30.torque_constant_nm_a, RE_30.resistance_ohm
    assert k * 24 / r == pytest.approx(1.02, rel=0.01)  # stall torque, Nm
    assert RE_30.inertia_kg_m2 * r / k**2 == pytest.approx(3.05e-3, rel=0.01)  # s


def test_the_motor_core_unit_is_what_its_table_says() -> None:
    unit, motor = MOTOR_CORE_UNIT, MOTOR_CORE_UNIT.motor
    ratio = unit.gear.ratio
    constant_nm_a = motor.torque_constant_nm_a * ratio
    assert constant_nm_a == pytest.approx(9.0)
    assert constant_nm_a * unit.stage.continuous_a == pytest.approx(15.0)
    assert constant_nm_a * unit.stage.peak_a == pytest.approx(30.0)
    assert (FTMD.continuous_a, FTMD.peak_a) == (7.0, 10.0)
    assert unit.stage.peak_a < FTMD.continuous_a
    assert unit.inertia_kg_m2 * ratio**2 == pytest.approx(0.05)
    assert unit.coulomb_nm * ratio == pytest.approx(0.5)
    assert free_speed_rad_s(unit) == pytest.approx(60 * RAD_S_PER_RPM, rel=0.01)


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan")])
def test_a_number_that_must_be_positive_is(value: float) -> None:
    with pytest.raises(ValueError, match=r"resistance_ohm .* is not more than 0"):
        replace(RE_30, resistance_ohm=value)


def test_a_friction_may_be_zero_but_not_less() -> None:
    assert replace(RE_30, viscous_nm_s=0.0).viscous_nm_s == 0.0
    with pytest.raises(ValueError, match=r"viscous_nm_s -1.0 is not 0 or more"):
        replace(RE_30, viscous_nm_s=-1.0)


def test_a_peak_below_the_continuous_current_is_refused() -> None:
    with pytest.raises(ValueError, match=r"peak_a 4.0 is below continuous_a 5.0"):
        replace(EPOS_24_5, peak_a=4.0)


def test_no_stage_gives_more_than_its_supply_and_no_gear_more_than_it_takes() -> None:
    with pytest.raises(ValueError, match=r"duty_max 1.1 is not in 0..1"):
        replace(EPOS_24_5, duty_max=1.1)
    with pytest.raises(ValueError, match=r"efficiency 1.1 is not in 0..1"):
        GearParameters(efficiency=1.1)


def test_a_servo_without_a_gear_is_its_motor() -> None:
    servo = replace(EPOS_WHEEL, gear=GearParameters(), encoders=Encoders(2_000))
    assert servo.inertia_kg_m2 == RE_30.inertia_kg_m2
    assert servo.coulomb_nm == RE_30.coulomb_nm
