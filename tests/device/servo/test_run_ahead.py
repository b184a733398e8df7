"""Several control steps in one go: to the bit those that are made one by one."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, sin

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tickrig.device.servo.parameters import EPOS_WHEEL
from tickrig.device.servo.servo import STEP_US, Servo

ANYWHERE = (-inf, inf)
Path = list[tuple[float, float]]


def line(servo: Servo, velocity: float, steps: int, first: float = 0.0) -> Path:
    """Return demands on a line that begins where the servo is."""
    begin = servo.counts + first
    return [(begin + velocity * step / 1_000, velocity) for step in range(steps)]


def make(
    velocity: float = 10_000.0, ms: int = 400, world: Mapping[str, float] | None = None
) -> Servo:
    """Return a servo that has followed a line for some time."""
    servo = Servo(EPOS_WHEEL)
    for name, value in (world or {}).items():
        setattr(servo, name, value)
    for step in range(ms):
        servo.drive_position(velocity * step / 1_000, velocity)
        servo.step_to(servo.now_us + STEP_US)
    return servo


def state(servo: Servo) -> tuple[object, ...]:
    plant, loops = servo._plant, servo._loops
    return (
        (servo.now_us, servo.counts, servo.current_limited, servo.resting, loops.integral_a),
        (plant.position, plant.speed_rad_s, plant.current_a, plant.losses),
    )


def one_by_one(servo: Servo, demands: Path) -> tuple[object, ...]:
    for position, velocity in demands:
        servo.drive_position(position, velocity)
        servo.step_to(servo.now_us + STEP_US)
    return state(servo)


LIVES = st.tuples(st.floats(-24_000, 24_000), st.integers(1, 60))
WORLDS = st.fixed_dictionaries({"load_nm": st.floats(-2.5, 2.5), "load_kg_m2": st.floats(0, 0.01)})


@settings(max_examples=40, deadline=None)
@given(LIVES, WORLDS, st.integers(1, 18), st.floats(-300, 300))
def test_a_run_is_its_steps(
    life: tuple[float, int], world: dict[str, float], count: int, sway: float
) -> None:
    goes, stays = (make(*life, world) for _ in range(2))
    straight = line(goes, life[0], count + 1)
    waves = [sway * sin(step) for step in range(count + 1)]
    path = [(p + wave, v + 9 * wave) for (p, v), wave in zip(straight, waves, strict=True)]
    for servo in (goes, stays):
        servo.drive_position(*path[0])
    before = state(goes)
    run = goes.run_ahead(path[: min(count, goes.plain_steps)], ANYWHERE, inf, 1_000)
    assert state(goes) == before
    goes.follow(run, *path[run.steps])
    goes.step_to(goes.now_us + STEP_US)
    assert state(goes) == one_by_one(stays, path[: run.steps + 1])


@pytest.mark.parametrize("velocity", [10.0, 200.0, 10_000.0])
def test_a_demand_to_stand_where_it_turns_is_a_step_as_any_other(velocity: float) -> None:
    goes, stays = make(velocity), make(velocity)
    path = [(float(goes.counts), 0.0)] * 3
    for servo in (goes, stays):
        servo.drive_position(*path[0])
    run = goes.run_ahead(path[: min(2, goes.plain_steps)], ANYWHERE, inf, 1_000)
    goes.follow(run, *path[run.steps])
    goes.step_to(goes.now_us + STEP_US)
    assert state(goes) == one_by_one(stays, path[: run.steps + 1])


@pytest.fixture
def servo() -> Servo:
    """One that turns, as it is told, with 10 000 counts a second."""
    servo = make()
    servo.step_to(servo.now_us + STEP_US)
    return servo


def steps(servo: Servo, demands: Path, error: float = inf, end: float = inf) -> int:
    return servo.run_ahead(demands, (-inf, end), error, 1_000).steps


def test_a_run_goes_up_to_the_next_look_at_the_heat(servo: Servo) -> None:
    looks = servo.now_us - servo._heat.since_us
    assert servo.plain_steps == 19 - looks // 1_000
    assert steps(servo, line(servo, 10_000, servo.plain_steps)) == servo.plain_steps


def test_a_run_ends_before_a_cut(servo: Servo) -> None:
    path = line(servo, 10_000, 10)
    path[4] = (path[4][0] + 20_000, 10_000.0)
    assert steps(servo, path) == 4


def test_a_run_ends_before_the_voltage_is_cut() -> None:
    servo = make(150_000, 500)
    assert steps(servo, line(servo, 150_000, 10)) == 10
    servo.supply_v = 12.0
    assert steps(servo, line(servo, 150_000, 10)) == 0


def test_a_run_ends_before_the_motor_is_too_far_away(servo: Servo) -> None:
    path = line(servo, 10_000, 12)
    path[7] = (path[7][0] + 30, 10_000.0)
    assert [steps(servo, path, error) for error in (15.0, 30.0)] == [7, 12]


def test_a_run_ends_at_the_end_of_the_range(servo: Servo) -> None:
    assert steps(servo, line(servo, 10_000, 15), end=servo.counts + 55) == 5


def test_a_run_ends_before_the_motor_stands_although_it_shall_turn() -> None:
    servo = make(1_500, 300)
    path = [(float(servo.counts), 1_500.0 - 700 * step) for step in range(6)]
    assert 0 < steps(servo, path) < 6


def test_a_run_ends_where_friction_holds_the_shaft(servo: Servo) -> None:
    path = [(float(servo.counts + 20), 0.0)] * 15
    assert 0 < steps(servo, path) < 15


def test_there_is_no_run_at_standstill() -> None:
    servo = Servo(EPOS_WHEEL)
    servo.drive_position(500.0)
    assert steps(servo, line(servo, 10_000, 10)) == 0


@pytest.mark.parametrize("how", ["encoder_unplugged", "phase_open"])
def test_no_step_is_plain_with_a_broken_wire(servo: Servo, how: str) -> None:
    setattr(servo, how, True)
    assert servo.plain_steps == 0


def test_no_step_is_plain_without_a_position(servo: Servo) -> None:
    servo.drive_velocity(10_000)
    assert servo.plain_steps == 0
    servo.drive_position(100.0, 0.0, acceleration=5.0)
    assert servo.plain_steps == 0
