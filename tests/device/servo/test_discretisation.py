"""One control step of winding and shaft against their differential equations."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, exp, sin

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.device.servo.differential_equations import Equations, State
from tickrig.device.servo.parameters import CORE_MOTOR, PRESETS, RE_30, MotorParameters
from tickrig.device.servo.plant import STEP_S, Discretisation, Row, discretise, exponential


@dataclass(frozen=True)
class Case:
    """A motor at the start of a step."""

    motor: MotorParameters
    inertia_kg_m2: float
    current_a: float
    speed_rad_s: float
    torque_nm: float

    @property
    def rows(self) -> Discretisation:
        return discretise(self.motor, self.motor.resistance_ohm, self.inertia_kg_m2)

    def times(self, row: Row, third: float) -> float:
        values = self.current_a, self.speed_rad_s, third, self.torque_nm
        return sum(weight * value for weight, value in zip(row, values, strict=True))

    def after(self, voltage_v: float) -> State:
        equations = Equations(self.motor, self.inertia_kg_m2, voltage_v, self.torque_nm)
        return equations.after((self.current_a, self.speed_rad_s, 0.0, 0.0), STEP_S)


cases = st.builds(
    Case,
    motor=st.sampled_from([RE_30, CORE_MOTOR]),
    inertia_kg_m2=st.floats(4e-7, 4e-5),
    current_a=st.floats(-20, 20),
    speed_rad_s=st.floats(-900, 900),
    torque_nm=st.floats(-0.3, 0.3),
)


def test_the_exponential_of_a_rotation_turns() -> None:
    (a, b), (c, d) = exponential([[0.0, -1.0], [1.0, 0.0]])
    assert (a, b, c, d) == pytest.approx((cos(1), -sin(1), sin(1), cos(1)), abs=1e-14)


@given(st.floats(-30, 3))
def test_the_exponential_of_a_number_is_that_of_the_library(x: float) -> None:
    assert exponential([[x]])[0][0] == pytest.approx(exp(x), rel=1e-12)


@settings(max_examples=30)
@given(cases, st.floats(-60, 60))
def test_a_constant_voltage_leads_where_the_equations_lead(case: Case, voltage_v: float) -> None:
    rows = case.rows
    got = [case.times(row, voltage_v) for row in (rows.current_u, rows.speed_u, rows.angle_u)]
    assert got == pytest.approx(case.after(voltage_v)[:3], rel=1e-6, abs=1e-6)


@settings(max_examples=30)
@given(cases, st.floats(-20, 20))
def test_a_constant_voltage_ends_at_a_wanted_current(case: Case, wanted_a: float) -> None:
    end = case.after(case.times(case.rows.voltage, wanted_a))
    assert end[0] == pytest.approx(wanted_a, rel=1e-6, abs=1e-6)


@settings(max_examples=30)
@given(cases, st.floats(-20, 20))
def test_a_led_current_turns_the_shaft_as_its_mean_does(case: Case, wanted_a: float) -> None:
    even = replace(case, motor=replace(case.motor, viscous_nm_s=0.0))
    torque_nm = case.motor.torque_constant_nm_a * (case.current_a + wanted_a) / 2 + case.torque_nm
    expected = case.speed_rad_s + torque_nm * STEP_S / case.inertia_kg_m2
    assert even.times(even.rows.speed, wanted_a) == pytest.approx(expected, rel=1e-9, abs=1e-9)


@settings(max_examples=30)
@given(cases)
def test_a_steady_current_turns_the_shaft_by_its_mean_speed(case: Case) -> None:
    even = replace(case, motor=replace(case.motor, viscous_nm_s=0.0))
    speed, way = (even.times(row, case.current_a) for row in (even.rows.speed, even.rows.angle))
    assert way == pytest.approx((case.speed_rad_s + speed) / 2 * STEP_S, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("scale", [0.1, 1, 10])
@pytest.mark.parametrize("name", PRESETS)
def test_no_preset_is_unstable_at_a_tenth_to_ten_times_its_inertia(name: str, scale: float) -> None:
    motor = PRESETS[name].motor
    rows = discretise(motor, motor.resistance_ohm, PRESETS[name].inertia_kg_m2 * scale)
    (a, b), (c, d) = rows.current_u[:2], rows.speed_u[:2]
    trace, determinant = a + d, a * d - b * c
    assert abs(determinant) < 1  # both roots of z^2 - trace z + determinant
    assert abs(trace) < 1 + determinant  # lie in the unit circle (Jury)


def test_a_shaft_without_friction_and_current_coasts_evenly() -> None:
    rows = discretise(replace(RE_30, viscous_nm_s=0.0), 1.0, 2.0)
    assert rows.speed[1] == 1.0
    assert rows.angle[1] == pytest.approx(STEP_S)
    assert (rows.speed[3], rows.angle[3]) == pytest.approx((STEP_S / 2, STEP_S**2 / 4))


def test_viscous_friction_slows_a_coasting_shaft_exponentially() -> None:
    rows = discretise(replace(RE_30, viscous_nm_s=100.0), 1.0, 2.0)
    assert rows.speed[1] == pytest.approx(exp(-100 / 2 * STEP_S), rel=1e-12)
