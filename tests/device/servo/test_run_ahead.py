"""Several control steps in one go: to the bit those that are made one by one."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tickrig.device.servo.parameters import EPOS_WHEEL
from tickrig.device.servo.plant import STEP_S
from tickrig.device.servo.servo import STEP_US, Line, Servo

ANYWHERE = (-inf, inf, inf, 1_000.0, 10_000)
Demands = list[tuple[float, float]]


def line(servo: Servo, velocity: float, steps: int, first: float = 0.0) -> Line:
    """Return a line that begins where the servo is."""
    begin = servo.counts + first
    return Line((begin, velocity), begin + velocity * steps / 1_000, steps)


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
    plant, loops, heat = servo._plant, servo._loops, servo._heat
    return (
        (servo.now_us, servo.counts, servo.current_limited, servo.resting, loops.integral_a),
        (plant.position, plant.speed_rad_s, plant.current_a, plant.losses, plant.resistance_ohm),
        (heat.temperatures, heat.since_us, heat.i2t.filled_a2s, heat.i2t.reduced, servo._limit_a),
    )


def one_by_one(servo: Servo, demands: Demands) -> tuple[object, ...]:
    for position, velocity in demands:
        servo.drive_position(position, velocity)
        servo.step_to(servo.now_us + STEP_US)
    return state(servo)


def demands(line: Line, steps: int) -> Demands:
    """Return the demands of a line, step by step."""
    position, found = line.position, [(line.position, line.velocity)]
    for left in range(line.left, line.left - steps, -1):
        velocity = (line.goal - position) / (left * STEP_S) if left > 0 else 0.0
        position += velocity * STEP_S
        found.append((position, velocity + line.added if left > 0 else 0.0))
    return found


LIVES = st.tuples(st.floats(-24_000, 24_000), st.integers(1, 60))
WORLDS = st.fixed_dictionaries({"load_nm": st.floats(-2.5, 2.5), "load_kg_m2": st.floats(0, 0.01)})


@settings(max_examples=40, deadline=None)
@given(LIVES, WORLDS, st.integers(1, 70), st.floats(-300, 300), st.integers(0, 70))
def test_a_run_is_its_steps(
    life: tuple[float, int], world: dict[str, float], count: int, sway: float, left: int
) -> None:
    goes, stays = (make(*life, world) for _ in range(2))
    path = line(goes, life[0], left)
    path.goal, path.added = path.goal + sway, 9 * sway
    for servo in (goes, stays):
        servo.drive_position(path.position, path.velocity)
    before = state(goes)
    run = goes.run_ahead(path, count, ANYWHERE)
    assert state(goes) == before
    steps = demands(path, run.steps)
    assert run.demand == steps[-1]
    goes.follow(run)
    goes.step_to(goes.now_us + STEP_US)
    assert state(goes) == one_by_one(stays, steps)


@pytest.mark.parametrize("velocity", [10.0, 200.0, 10_000.0])
def test_a_demand_to_stand_where_it_turns_is_a_step_as_any_other(velocity: float) -> None:
    goes, stays = make(velocity), make(velocity)
    path = Line((float(goes.counts), 0.0), 0.0, 0)
    for servo in (goes, stays):
        servo.drive_position(path.position)
    run = goes.run_ahead(path, 2, ANYWHERE)
    goes.follow(run)
    goes.step_to(goes.now_us + STEP_US)
    assert state(goes) == one_by_one(stays, demands(path, run.steps))


@pytest.fixture
def servo() -> Servo:
    """One that turns, as it is told, with 10 000 counts a second."""
    servo = make()
    servo.step_to(servo.now_us + STEP_US)
    return servo


def steps(servo: Servo, line: Line, most: int, **bounds: float) -> int:
    end, error, dc = (bounds.get(name, inf) for name in ("end", "error", "dc"))
    return servo.run_ahead(line, most, (-inf, end, error, 1_000, round(min(dc, 10_000)))).steps


def test_a_run_goes_on_over_looks_at_the_heat(servo: Servo) -> None:
    run = servo.run_ahead(line(servo, 10_000, 70), 70, ANYWHERE)
    assert run.steps == 70
    assert run.heat.since_us == 460_000
    assert servo._heat.since_us == 400_000
    servo.follow(run)
    assert servo._heat.since_us == 460_000


def test_a_run_ends_before_the_motor_is_too_hot(servo: Servo) -> None:
    assert steps(servo, line(servo, 10_000, 70), 70, dc=servo.winding_dc - 1) == 18


def test_a_run_ends_before_the_resistance_is_followed(servo: Servo) -> None:
    servo._heat.temperatures = (29.0, 25.0)
    assert steps(servo, line(servo, 10_000, 70), 70) == 18


def test_a_limit_that_falls_with_the_heat_cuts_in_a_run() -> None:
    servo = make()
    servo._plant.shape(servo._plant.inertia_kg_m2, servo._heat._thermal.resistance_ohm(154.9))
    servo._heat.temperatures = (154.9, 25.0)
    assert steps(servo, line(servo, 10_000, 70), 70) == 20


def test_a_run_ends_before_a_cut(servo: Servo) -> None:
    path = line(servo, 10_000, 10)
    assert steps(servo, path, 10) == 10
    path.added = 20_000_000.0
    assert steps(servo, path, 10) == 1


def test_a_run_ends_before_the_line_is_too_steep(servo: Servo) -> None:
    path = line(servo, 10_000, 10)
    path.most = 9_999.0
    assert steps(servo, path, 10) == 0


def test_a_run_ends_before_the_voltage_is_cut() -> None:
    servo = make(150_000, 500)
    assert steps(servo, line(servo, 150_000, 10), 10) == 10
    servo.supply_v = 12.0
    assert steps(servo, line(servo, 150_000, 10), 10) == 0


def test_a_run_ends_before_the_motor_is_too_far_away(servo: Servo) -> None:
    path = line(servo, 10_000, 12)
    path.goal += 240
    assert [steps(servo, path, 12, error=error) for error in (15.0, 40.0)] == [2, 12]


def test_a_run_ends_at_the_end_of_the_range(servo: Servo) -> None:
    assert steps(servo, line(servo, 10_000, 15), 15, end=servo.counts + 55) == 5


def test_a_run_ends_before_the_motor_stands_although_it_shall_turn() -> None:
    servo = make(1_500, 300)
    path = Line((float(servo.counts), 1_500.0), servo.counts - 10, 6)
    assert 0 < steps(servo, path, 6) < 6


def test_a_run_ends_where_friction_holds_the_shaft(servo: Servo) -> None:
    assert 0 < steps(servo, Line((servo.counts + 20.0, 0.0), 0.0, 0), 15) < 15


def test_there_is_no_run_at_standstill() -> None:
    servo = Servo(EPOS_WHEEL)
    servo.drive_position(500.0)
    assert steps(servo, line(servo, 10_000, 10), 10) == 0


@pytest.mark.parametrize("how", ["encoder_unplugged", "phase_open"])
def test_no_step_is_plain_with_a_broken_wire(servo: Servo, how: str) -> None:
    setattr(servo, how, True)
    assert not servo.is_plain


def test_no_step_is_plain_without_a_position(servo: Servo) -> None:
    servo.drive_velocity(10_000)
    assert not servo.is_plain
    servo.drive_position(100.0, 0.0, acceleration=5.0)
    assert not servo.is_plain
