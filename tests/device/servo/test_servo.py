"""A servo as its drive and an observer see it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tests.device.servo.trapezoid import Trapezoid
from tickrig.device.servo.parameters import EPOS_WHEEL, MOTOR_CORE_UNIT, PRESETS
from tickrig.device.servo.readings import COPPER_PER_K, nearest
from tickrig.device.servo.servo import Servo

SECOND_US = 1_000_000
QUICKLY_WARM = replace(
    EPOS_WHEEL,
    motor=replace(EPOS_WHEEL.motor, winding_s=1.0, housing_s=10.0),
    stage=replace(EPOS_WHEEL.stage, peak_a=15.0),
)


@pytest.fixture(params=PRESETS)
def servo(request: pytest.FixtureRequest) -> Servo:
    return Servo(PRESETS[request.param])


def let(servo: Servo, seconds: float) -> Servo:
    servo.step_to(servo.now_us + round(seconds * SECOND_US))
    return servo


def follow(servo: Servo, move: Trapezoid) -> tuple[float, int]:
    """Make a move in degrees; return the worst error in degrees, and the highest count."""
    scale = servo.counts_per_turn * servo.gear_ratio / 360
    start_us, worst_deg, highest = servo.now_us, 0.0, 0
    for ms in range(round(move.seconds * 1_000) + 1_000):
        position, velocity, acceleration = move.at(ms / 1_000)
        worst_deg = max(worst_deg, abs(servo.shaft_deg - position))
        servo.drive_position(position * scale, velocity * scale, acceleration * scale)
        servo.step_to(start_us + (ms + 1) * 1_000)
        highest = max(highest, servo.counts)
    return worst_deg, highest


def test_a_position_is_reached_to_the_count_and_held_at_rest(servo: Servo) -> None:
    servo.drive_position(12_345)
    let(servo, 3)
    assert (servo.counts, servo.velocity_counts_s, servo.resting) == (12_345, 0, True)


@pytest.mark.parametrize("fraction", [0.25, 0.5, 0.75])
def test_a_fraction_of_a_count_is_reached_to_less_than_a_count(
    servo: Servo, fraction: float
) -> None:
    servo.drive_position(100 + fraction)
    let(servo, 3)
    assert abs(servo.counts - 100 - fraction) < 1
    assert servo.resting


def test_a_trapezoid_is_followed_to_a_fifth_of_a_degree_without_overshoot(servo: Servo) -> None:
    worst_deg, highest = follow(servo, Trapezoid(90.0, 360.0, 3_600.0))
    target = servo.counts_per_turn * servo.gear_ratio / 4
    assert worst_deg < 0.2
    assert highest == servo.counts == target
    assert servo.resting


@pytest.mark.parametrize("load_nm", [-3.0, 3.0])
def test_a_load_is_borne_on_the_way(load_nm: float) -> None:
    servo = Servo(MOTOR_CORE_UNIT)
    servo.load_nm = load_nm
    servo.drive_position(0.0)
    worst_deg, highest = follow(let(servo, 1), Trapezoid(90.0, 360.0, 3_600.0))
    assert worst_deg < 0.2
    assert highest == servo.counts == 102_400


@pytest.mark.parametrize("times", [2, 10])
def test_a_target_is_reached_with_more_inertia_than_the_loops_are_tuned_to(
    servo: Servo, times: int
) -> None:
    servo.load_kg_m2 = servo.parameters.inertia_kg_m2 * servo.gear_ratio**2 * (times - 1)
    follow(servo, Trapezoid(90.0, 360.0, 3_600.0))
    let(servo, 3)
    assert servo.counts == servo.counts_per_turn * servo.gear_ratio / 4
    assert servo.resting


def test_a_jump_of_many_turns_settles(servo: Servo) -> None:
    servo.drive_position(-200_000)
    let(servo, 4)
    assert (servo.counts, servo.resting) == (-200_000, True)


@pytest.mark.unmeasured
@pytest.mark.parametrize("velocity", [-20_000, 37, 20_000])
def test_a_velocity_is_kept(servo: Servo, velocity: int) -> None:
    servo.drive_velocity(velocity)
    let(servo, 2)
    assert abs(servo.velocity_counts_s - velocity) <= 1
    before = servo.counts
    let(servo, 1)
    assert abs(servo.counts - before - velocity) <= 2


def test_a_velocity_of_zero_comes_to_rest(servo: Servo) -> None:
    servo.drive_velocity(20_000)
    let(servo, 1)
    servo.drive_velocity(0)
    let(servo, 1)
    assert (servo.velocity_counts_s, servo.resting) == (0, True)


def test_a_load_that_comes_and_goes_is_held(servo: Servo) -> None:
    servo.drive_position(500)
    for load_nm in (2.0, -2.0, 0.0):
        let(servo, 3)
        servo.load_nm = load_nm
    let(servo, 3)
    assert servo.counts == 500


def test_the_supply_limits_the_speed() -> None:
    servo = Servo(EPOS_WHEEL)
    speeds = []
    for supply_v in (12.0, 24.0):
        servo.supply_v = supply_v
        servo.drive_velocity(1e9)
        speeds.append(let(servo, 2).motor_rad_s)
        assert servo.current_limited
    motor = EPOS_WHEEL.motor
    volts_lost = EPOS_WHEEL.coulomb_nm / motor.torque_constant_nm_a * motor.resistance_ohm
    expected = (24 * 0.9 - volts_lost) / (12 * 0.9 - volts_lost)
    assert speeds[1] / speeds[0] == pytest.approx(expected, rel=1e-3)


@pytest.mark.unmeasured
def test_the_integral_does_not_wind_up_at_a_limit(servo: Servo) -> None:
    servo.blocked = True
    servo.drive_velocity(20_000)
    let(servo, 5)
    servo.blocked = False
    servo.drive_velocity(0.0)
    before = servo.counts
    let(servo, 0.2)
    assert abs(servo.counts - before) < servo.counts_per_turn


def test_the_drive_limits_the_current(servo: Servo) -> None:
    servo.current_limit_a = 1.5
    servo.blocked = True
    for wanted_a, flows_ma in ((9.0, 1_500), (-9.0, -1_500), (1.0, 1_000)):
        servo.drive_current(wanted_a)
        let(servo, 0.1)
        assert (servo.current_ma, servo.current_limited) == (flows_ma, abs(wanted_a) > 1.5)


def test_a_negative_limit_lets_no_current_flow(servo: Servo) -> None:
    servo.current_limit_a = -1.0
    servo.drive_current(5.0)
    assert let(servo, 0.1).current_ma == 0


def test_the_stage_bears_its_peak_for_its_time(servo: Servo) -> None:
    stage = servo.parameters.stage
    servo.blocked = True
    servo.drive_current(100.0)
    let(servo, stage.peak_s - 0.03)
    assert (servo.current_a, servo.overloaded) == (stage.peak_a, False)
    let(servo, 0.06)
    assert (servo.current_a, servo.overloaded) == (stage.continuous_a, True)


@pytest.mark.unmeasured
def test_the_peak_comes_back_after_a_while(servo: Servo) -> None:
    servo.blocked = True
    servo.drive_current(100.0)
    let(servo, 5)
    servo.drive_current(0.0)
    assert not let(servo, 10).overloaded
    assert servo.resting


@pytest.mark.unmeasured
def test_a_hot_winding_gets_less_current() -> None:
    servo = Servo(QUICKLY_WARM)
    servo.blocked = True
    servo.drive_current(5.0)
    let(servo, 60)
    assert 110 < servo.winding_c < 125
    assert servo.current_a < 5.0
    assert servo.current_limited
    assert not servo.resting


@pytest.mark.unmeasured
def test_a_warm_winding_lets_less_current_through() -> None:
    servo, motor = Servo(QUICKLY_WARM), QUICKLY_WARM.motor
    servo.blocked = True
    servo.drive_current(4.0)
    let(servo, 10)
    assert servo.winding_c > 60
    servo.load_kg_m2 = 0.1  # a new inertia forgets no resistance
    servo.supply_v, volts = 9.0, 9.0 * 0.9
    servo.drive_current(100.0)
    servo.current_limit_a = 1_000.0
    let(servo, 0.01)
    ohm = motor.resistance_ohm * (1 + COPPER_PER_K * (servo.winding_c - 25))
    assert servo.current_a == pytest.approx(volts / ohm, rel=0.01)


def test_a_released_shaft_coasts_and_stops(servo: Servo) -> None:
    servo.drive_velocity(20_000)
    let(servo, 1)
    servo.release()
    let(servo, 0.001)
    assert servo.velocity_counts_s > 0
    let(servo, 2)
    assert (servo.velocity_counts_s, servo.current_ma, servo.resting) == (0, 0, True)


@pytest.mark.parametrize("what", ["phase", "supply"])
def test_without_phase_or_supply_nothing_drives(servo: Servo, what: str) -> None:
    if what == "phase":
        servo.phase_open = True
    else:
        servo.supply_v = 5.0
    servo.drive_current(5.0)
    let(servo, 1)
    assert (servo.counts, servo.current_ma, servo.resting) == (0, 0, True)


def test_a_strong_load_turns_a_released_shaft_backward(servo: Servo) -> None:
    servo.load_nm = -5.0
    let(servo, 1)
    assert servo.counts < -1_000
    assert servo.shaft_deg_s < 0


@pytest.mark.unmeasured
def test_a_held_shaft_stands_and_draws_current(servo: Servo) -> None:
    servo.blocked = True
    servo.drive_position(5_000)
    let(servo, 1)
    assert (servo.counts, servo.current_limited) == (0, True)
    servo.blocked = False
    let(servo, 4)
    assert servo.counts == 5_000


def test_without_encoder_the_counts_stand_and_the_shaft_runs_away(servo: Servo) -> None:
    servo.drive_velocity(2_000)
    let(servo, 1)
    servo.encoder_unplugged = True
    before = servo.counts
    let(servo, 1)
    assert (servo.counts, servo.velocity_counts_s) == (before, 0)
    assert servo.motor_rad_s > 300


def test_counts_that_an_unplugged_encoder_missed_are_lost(servo: Servo) -> None:
    servo.encoder_unplugged = True
    servo.drive_current(1.0)
    let(servo, 0.5)
    servo.release()
    let(servo, 10)
    turned_deg = servo.shaft_deg
    servo.encoder_unplugged = False
    servo.drive_position(1_000)
    let(servo, 3)
    assert servo.counts == 1_000
    moved = (servo.shaft_deg - turned_deg) / 360 * servo.gear_ratio * servo.counts_per_turn
    assert moved == pytest.approx(1_000, abs=1)


def test_the_gear_encoder_counts_the_turns_of_the_output() -> None:
    servo = Servo(MOTOR_CORE_UNIT)
    assert servo.gear_counts == 0
    servo.drive_position(-102_400)  # a quarter turn back
    let(servo, 3)
    assert servo.gear_counts == pytest.approx(-16_384, abs=1)
    assert Servo(EPOS_WHEEL).gear_counts == 0


def test_the_drive_measures_whole_numbers(servo: Servo) -> None:
    servo.supply_v = 23.4567
    servo.blocked = True
    servo.drive_current(1.2345678)
    let(servo, 0.1)
    assert (servo.supply_mv, servo.current_ma) == (23_457, 1_235)
    assert servo.winding_dc == 250


@given(st.floats(allow_nan=False, allow_infinity=False) | st.integers(-99, 99).map(lambda n: n / 2))
@example(0.49999999999999994)
@example(-0.49999999999999994)
@example(-0.5)
@example(0.5)
@example(1.5)
@example(2.0**52 + 1)
@example(-(2.0**53))
def test_a_measurement_is_rounded_as_round_does(value: float) -> None:
    assert nearest(value) == round(value)
