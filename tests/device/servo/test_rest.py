"""A servo at rest costs nothing, and nobody can tell."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tickrig.device.servo.parameters import EPOS_WHEEL, PRESETS, ServoParameters
from tickrig.device.servo.servo import Servo

SECOND_US = 1_000_000

events = st.lists(
    st.tuples(
        st.integers(0, 1_500),  # ms since the event before
        st.one_of(
            st.tuples(st.just("drive_position"), st.integers(-3_000, 3_000)),
            st.tuples(st.just("drive_velocity"), st.sampled_from([0, 0, 4_000, -9_000])),
            st.tuples(st.just("drive_current"), st.floats(-8, 8)),
            st.tuples(st.just("release")),
            st.tuples(st.just("load_nm"), st.floats(-4, 4)),
            st.tuples(st.just("load_kg_m2"), st.floats(0, 0.05)),
            st.tuples(st.just("supply_v"), st.floats(0, 40)),
            st.tuples(st.just("ambient_c"), st.floats(-20, 110)),
            st.tuples(st.just("current_limit_a"), st.floats(0, 9)),
            st.tuples(
                st.sampled_from(["blocked", "encoder_unplugged", "phase_open"]), st.booleans()
            ),
        ),
    ),
    max_size=8,
)
Event = tuple[int, tuple[str, float] | tuple[str]]


def act(servo: Servo, name: str, *values: float) -> None:
    """Call what can be called, else set it."""
    if callable(method := getattr(servo, name)):
        method(*values)
    else:
        setattr(servo, name, *values)


def play(parameters: ServoParameters, script: list[Event], dense: bool) -> list[object]:
    """Return what is seen at the events, and 2 s after the last one."""
    servo, now_us, seen = Servo(parameters), 0, list[object]()
    for ms, (name, *values) in [*script, (2_000, ("release",))]:
        for _ in range(ms if dense else 0):
            servo.step_to(servo.now_us + 1_000)
        servo.step_to(now_us := now_us + ms * 1_000)
        seen.append((servo.counts, servo.velocity_counts_s, servo.gear_counts, servo.overloaded))
        seen.append((servo.shaft_deg, servo.shaft_deg_s, servo.current_a, servo.current_limited))
        seen.append((servo.winding_c, servo.housing_c, servo.resting))
        act(servo, name, *values)
    return seen


@pytest.mark.unmeasured
@settings(max_examples=25, deadline=None)
@given(st.sampled_from(list(PRESETS.values())), events)
def test_each_millisecond_and_seldom_are_the_same_to_the_bit(
    parameters: ServoParameters, script: list[Event]
) -> None:
    assert play(parameters, script, dense=True) == play(parameters, script, dense=False)


@pytest.fixture
def servo() -> Servo:
    return at_rest(-2.0)


def at_rest(load_nm: float) -> Servo:
    """Return a servo that holds a load and rests."""
    servo = Servo(EPOS_WHEEL)
    servo.load_nm = load_nm
    servo.drive_position(5_000)
    servo.step_to(5 * SECOND_US)
    assert servo.resting
    return servo


def test_the_same_demand_again_leaves_it_at_rest(servo: Servo) -> None:
    servo.drive_position(5_000)
    servo.load_nm = -2.0
    assert servo.resting


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("drive_position", (5_001.0,)),
        ("drive_position", (5_000.0, 0.0, 1.0)),
        ("drive_velocity", (0.0,)),
        ("drive_current", (0.0,)),
        ("release", ()),
        ("load_nm", (1.0,)),
        ("load_kg_m2", (0.1,)),
        ("supply_v", (23.0,)),
        ("ambient_c", (26.0,)),
        ("current_limit_a", (4.0,)),
        ("blocked", (True,)),
        ("encoder_unplugged", (True,)),
        ("phase_open", (True,)),
    ],
)
def test_another_demand_or_input_ends_the_rest(
    servo: Servo, name: str, values: tuple[float, ...]
) -> None:
    act(servo, name, *values)
    assert not servo.resting


def test_a_held_load_warms_the_resting_motor(servo: Servo) -> None:
    before = servo.winding_c
    servo.step_to(3_600 * SECOND_US)
    assert servo.winding_c > servo.housing_c > before


@pytest.mark.parametrize("load_nm", [-2.0, -1.3, 1.9])
@pytest.mark.parametrize("until_s", [66, 3_600, 3_605])
def test_the_heat_of_a_rest_is_there_when_it_ends(load_nm: float, until_s: int) -> None:
    servo = at_rest(load_nm)
    servo.step_to(until_s * SECOND_US)
    before = servo.winding_c, servo.housing_c
    servo.drive_position(5_001)
    assert (servo.winding_c, servo.housing_c) == before


def test_the_air_of_a_rest_is_the_air_that_was(servo: Servo) -> None:
    servo.step_to(600 * SECOND_US)
    before = servo.housing_c
    servo.ambient_c = -20.0
    assert servo.housing_c == before


def test_a_second_change_at_the_same_instant_changes_no_temperature(servo: Servo) -> None:
    servo.step_to(60 * SECOND_US)
    servo.ambient_c, before = 30.0, servo.winding_c
    servo.release()
    assert servo.winding_c == before


def test_rest_waits_until_the_overload_is_over() -> None:
    servo = Servo(EPOS_WHEEL)
    servo.blocked = True
    servo.drive_current(10.0)
    servo.step_to(SECOND_US // 2)
    servo.drive_current(1.0)
    servo.step_to(SECOND_US)
    assert not servo.resting
    servo.step_to(4 * SECOND_US)
    assert servo.resting


def test_a_current_that_only_the_voltage_limits_is_no_rest() -> None:
    motor = replace(EPOS_WHEEL.motor, resistance_ohm=5.0)
    servo = Servo(replace(EPOS_WHEEL, motor=motor))
    servo.blocked = True
    servo.drive_current(9.9)
    servo.step_to(SECOND_US)
    assert servo.current_a == pytest.approx(24 * 0.9 / 5.0, rel=0.1)
    assert (servo.current_limited, servo.resting) == (True, False)
