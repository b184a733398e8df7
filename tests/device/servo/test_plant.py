"""Winding, shaft and friction against closed forms."""

from __future__ import annotations

from dataclasses import replace
from math import expm1, log, radians

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.device.servo.differential_equations import Equations
from tickrig.device.servo.parameters import EPOS_WHEEL, MOTOR_CORE_UNIT, PRESETS, ServoParameters
from tickrig.device.servo.plant import BREAKAWAY, STEP_S, Plant

FULL_A = 1_000.0  # more than any voltage allows, so the voltage is imposed


@pytest.fixture(params=PRESETS)
def parameters(request: pytest.FixtureRequest) -> ServoParameters:
    return PRESETS[request.param]


def steps(plant: Plant, seconds: float, current_a: float, limit_v: float) -> Plant:
    for _ in range(round(seconds / STEP_S)):
        plant.drive(current_a, limit_v)
    return plant


def kinetic_j(plant: Plant, parameters: ServoParameters) -> float:
    magnetic = parameters.motor.inductance_h * plant.current_a**2
    return (plant.inertia_kg_m2 * plant.speed_rad_s**2 + magnetic) / 2


def test_a_voltage_step_is_answered_with_the_mechanical_time_constant() -> None:
    motor = replace(EPOS_WHEEL.motor, inductance_h=1e-9, viscous_nm_s=0.0)
    parameters = replace(EPOS_WHEEL, motor=motor)
    plant, k, r = Plant(parameters), motor.torque_constant_nm_a, motor.resistance_ohm
    time_constant_s = plant.inertia_kg_m2 * r / k**2
    end_rad_s = (12 - parameters.coulomb_nm * r / k) / k
    for ms in range(1, 12):
        assert plant.drive(FULL_A, 12.0) == 1
        expected = -end_rad_s * expm1(-ms * STEP_S / time_constant_s)
        assert plant.speed_rad_s == pytest.approx(expected, rel=1e-5)


def test_a_current_step_accelerates_evenly(parameters: ServoParameters) -> None:
    motor = replace(parameters.motor, viscous_nm_s=0.0)
    plant = steps(Plant(replace(parameters, motor=motor)), 0.05, 2.0, 1e6)
    before = plant.speed_rad_s
    steps(plant, 0.1, 2.0, 1e6)
    torque_nm = motor.torque_constant_nm_a * 2.0 - parameters.coulomb_nm
    assert plant.speed_rad_s - before == pytest.approx(0.1 * torque_nm / plant.inertia_kg_m2)


def test_voltage_and_load_decide_the_final_speed(parameters: ServoParameters) -> None:
    plant, motor = Plant(parameters), parameters.motor
    plant.bear(-0.01, 1.0)
    steps(plant, 3.0, FULL_A, 10.0)
    k, r, b = motor.torque_constant_nm_a, motor.resistance_ohm, motor.viscous_nm_s
    expected = (k * 10 / r - 0.01 - parameters.coulomb_nm) / (k * k / r + b)
    assert plant.speed_rad_s == pytest.approx(expected, rel=1e-9)


def test_a_held_shaft_draws_the_stall_current(parameters: ServoParameters) -> None:
    plant = Plant(parameters)
    plant.hold(True)
    steps(plant, 0.1, FULL_A, 12.0)
    assert plant.current_a == pytest.approx(12 / parameters.motor.resistance_ohm, rel=1e-12)
    assert (plant.speed_rad_s, plant.position) == (0.0, 0.0)


def test_holding_a_turning_shaft_turns_its_motion_into_heat(parameters: ServoParameters) -> None:
    plant = steps(Plant(parameters), 0.2, 2.0, 12.0)
    before, motion = plant.losses.friction_j, plant.inertia_kg_m2 * plant.speed_rad_s**2 / 2
    plant.hold(True)
    assert plant.losses.friction_j - before == pytest.approx(motion)


@pytest.mark.unmeasured
@given(st.floats(1, 900), st.floats(0.3, 10))
def test_a_coasting_shaft_stops_when_friction_says(speed_rad_s: float, scale: float) -> None:
    plant, motor = Plant(EPOS_WHEEL), EPOS_WHEEL.motor
    plant.shape(plant.inertia_kg_m2 * scale, motor.resistance_ohm)
    plant.speed_rad_s = speed_rad_s
    b, coulomb = motor.viscous_nm_s, EPOS_WHEEL.coulomb_nm
    stop_s = plant.inertia_kg_m2 / b * log(1 + b * speed_rad_s / coulomb)
    passed = 0
    while plant.speed_rad_s > 0:
        plant.open()
        passed += 1
    assert passed * STEP_S == pytest.approx(stop_s, abs=1.1 * STEP_S)
    assert plant.speed_rad_s == 0.0


@pytest.mark.parametrize("part", [-1, 1])
def test_friction_holds_a_shaft_up_to_its_bound_and_no_further(part: int) -> None:
    most_nm = EPOS_WHEEL.coulomb_nm * BREAKAWAY
    plant = Plant(EPOS_WHEEL)
    plant.bear(part * most_nm * 0.999, 1.0)
    plant.open()
    assert (plant.speed_rad_s, plant.position) == (0.0, 0.0)
    plant.bear(part * most_nm * 1.001, 1.0)
    plant.open()
    assert plant.position * part > 0


@pytest.mark.parametrize(("way", "through"), [(1, 1 / 0.7), (-1, 0.7)])
def test_the_gear_takes_its_part_of_an_external_torque(way: int, through: float) -> None:
    plant, motor = Plant(EPOS_WHEEL), EPOS_WHEEL.motor
    plant.bear(-0.05, 0.7)  # against a forward motion, with a backward one
    plant.speed_rad_s = 50.0 * way
    friction = EPOS_WHEEL.coulomb_nm * way + motor.viscous_nm_s * plant.speed_rad_s
    balance_a = (0.05 * through + friction) / motor.torque_constant_nm_a
    steps(plant, 0.01, balance_a, 24.0)
    before = plant.speed_rad_s
    steps(plant, 0.01, balance_a, 24.0)
    assert plant.speed_rad_s == pytest.approx(before, rel=1e-3)


def test_a_step_that_ends_a_reversal_does_not_jump_over_standstill() -> None:
    plant = steps(Plant(MOTOR_CORE_UNIT), 0.1, 1.0, 60.0)
    speeds = []
    while plant.speed_rad_s != 0.0:
        plant.drive(0.0, 60.0)
        speeds.append(plant.speed_rad_s)
    assert min(speeds) == 0.0
    assert steps(plant, 0.1, 0.0, 60.0).speed_rad_s == 0.0


def test_an_open_winding_has_no_current_and_its_energy_is_heat() -> None:
    plant = steps(Plant(MOTOR_CORE_UNIT), 0.003, 5.0, 60.0)
    before = plant.losses.copper_j
    plant.open()
    assert plant.current_a == 0.0
    assert plant.losses.copper_j - before == pytest.approx(0.5e-3 * 5.0**2 / 2)


@settings(max_examples=20)
@given(st.sampled_from(list(PRESETS.values())), st.floats(5, 10), st.floats(50, 500))
def test_the_squared_current_is_that_of_the_equations(
    parameters: ServoParameters, volts: float, speed_rad_s: float
) -> None:
    plant = Plant(parameters)
    plant.speed_rad_s, plant.current_a = speed_rad_s, 3.0
    equations = Equations(parameters.motor, plant.inertia_kg_m2, volts, -parameters.coulomb_nm)
    expected = equations.after((3.0, speed_rad_s, 0.0, 0.0), STEP_S)[3]
    sign = plant.drive(FULL_A, volts)
    assert sign == 1
    assert plant.losses.square_a2s == pytest.approx(expected, rel=1e-5)


commands = st.lists(
    st.tuples(
        st.sampled_from(["drive", "drive", "drive", "open", "hold", "free"]),
        st.floats(-12, 12),  # A
        st.floats(1, 60),  # V
        st.floats(-0.1, 0.1),  # Nm at the motor
    ),
    min_size=1,
    max_size=12,
)


@pytest.mark.unmeasured
@settings(max_examples=60)
@given(st.sampled_from(list(PRESETS.values())), commands)
def test_energy_is_balanced(
    parameters: ServoParameters, script: list[tuple[str, float, float, float]]
) -> None:
    plant, work_j, through_j = Plant(parameters), 0.0, 1e-6
    rad_per_count = radians(360) / parameters.encoders.counts_per_turn
    for what, current_a, limit_v, load_nm in script:
        plant.bear(load_nm, parameters.gear.efficiency)
        if what in ("hold", "free"):
            plant.hold(what == "hold")
        for _ in range(25):
            before = plant.position
            if what == "open":
                plant.open()
            else:
                plant.drive(current_a, limit_v)
            work = load_nm * (plant.position - before) * rad_per_count
            work_j, through_j = work_j + work, through_j + abs(work)
    left_j = plant.losses.electrical_j + work_j - plant.losses.copper_j - plant.losses.friction_j
    through_j += plant.losses.copper_j + plant.losses.friction_j
    assert left_j == pytest.approx(kinetic_j(plant, parameters), abs=1e-3 * through_j)


@pytest.mark.unmeasured
@settings(max_examples=60)
@given(st.sampled_from(list(PRESETS.values())), st.floats(-3_000, 3_000), st.floats(0.1, 10))
def test_a_released_motor_never_gains_energy(
    parameters: ServoParameters, speed_rad_s: float, scale: float
) -> None:
    plant = Plant(parameters)
    plant.shape(plant.inertia_kg_m2 * scale, plant.resistance_ohm)
    plant.speed_rad_s, plant.current_a = speed_rad_s, 5.0
    energy = kinetic_j(plant, parameters)
    for _ in range(200):
        plant.open()
        before, energy = energy, kinetic_j(plant, parameters)
        assert energy <= before


def test_a_voltage_cut_at_standstill_says_its_direction() -> None:
    plant = Plant(EPOS_WHEEL)
    assert [plant.drive(0.1, 24.0), plant.drive(-FULL_A, 0.001)] == [0, -1]
    assert plant.speed_rad_s == 0.0


def test_less_than_no_voltage_is_enough_to_brake() -> None:
    plant = Plant(EPOS_WHEEL)
    plant.speed_rad_s = 100.0
    assert plant.drive(-FULL_A, 1.0) == -1
    assert plant.current_a < 0
    assert plant.losses.electrical_j > 0
