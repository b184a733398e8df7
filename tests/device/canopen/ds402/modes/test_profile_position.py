"""Profile position mode of an EPOS with its wheel."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.device.canopen.ds402.motion.test_trapezoid import trapezoid
from tests.device.canopen.ds402.wheel import (
    BIT_12,
    INTERNAL_LIMIT,
    REACHED,
    RPM,
    Wheel,
    make_lenient,
)
from tests.soak import examples
from tickrig.device.canopen.dictionary import SdoAbort
from tickrig.device.canopen.ds402.trapezoid import PathLimits
from tickrig.device.canopen.models import epos
from tickrig.device.canopen.slave import ServiceMaker
from tickrig.wire.instant import NEVER

VELOCITY, ACCELERATION, DECELERATION = 3_000, 20_000, 10_000
LIMITS = PathLimits(VELOCITY * RPM, ACCELERATION * RPM, DECELERATION * RPM)

NEW, NEW_AT_ONCE, NEW_RELATIVE, NEW_ON_THE_WAY, READY = 0x1F, 0x3F, 0x5F, 0x21F, 0x0F
HALT = 0x10F

FOLLOWS = 60
"""Counts (0.6 degrees of the wheel) that the motor is off the demand at most, on any ramp here."""


@pytest.fixture
def wheel() -> Wheel:
    return make_wheel()


def make_wheel(application: ServiceMaker = epos.make_application) -> Wheel:
    wheel = Wheel(application)
    wheel.write(0x6081, VELOCITY)
    wheel.write(0x6083, ACCELERATION)
    wheel.write(0x6084, DECELERATION)
    wheel.enable(1)
    return wheel


def give(wheel: Wheel, target: int, controlword: int = NEW) -> None:
    wheel.write(0x607A, target)
    wheel.control(controlword, READY)


def arrive(wheel: Wheel) -> int:
    """Run until bit 10 is set; return for how many ms."""
    return wheel.run_until(lambda: bool(wheel.bits & REACHED))


@pytest.mark.unmeasured
@pytest.mark.parametrize("target", [100_000, -100_000, 5_000, 30])
def test_the_demand_is_the_trapezoid_and_the_motor_follows(wheel: Wheel, target: int) -> None:
    wheel.write(0x607A, target)
    wheel.write(0x6040, NEW)
    direction = 1 if target > 0 else -1
    for passed_ms in range(1, 1_400):
        wheel.step()
        position, velocity = trapezoid(abs(target), LIMITS, passed_ms / 1_000)
        assert wheel.read(0x6062) * direction == pytest.approx(position, abs=0.51)
        assert wheel.read(0x606B) * direction == pytest.approx(velocity / RPM, abs=0.51)
        assert abs(wheel.read(0x6064) - wheel.read(0x6062)) <= FOLLOWS
    assert (wheel.read(0x6064), wheel.read(0x606C)) == (target, 0)


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    ("target", "expected_ms"),
    [(100_000, 1_225), (-100_000, 1_225), (20_000, 425), (5_000, 213)],
)
def test_it_arrives_in_the_tick_of_the_formulas(
    wheel: Wheel, target: int, expected_ms: int
) -> None:
    give(wheel, target)
    assert arrive(wheel) + 2 == pytest.approx(expected_ms, abs=1)


def test_a_standing_axis_has_reached_its_target_and_sleeps(wheel: Wheel) -> None:
    wheel.run(2)
    assert wheel.bits == REACHED
    wheel.run(200)
    assert wheel.slave.due_us == NEVER


def test_the_set_point_is_acknowledged_until_bit_4_falls(wheel: Wheel) -> None:
    wheel.write(0x607A, 10_000)
    assert wheel.control(NEW) & (BIT_12 | REACHED) == BIT_12
    assert wheel.control(NEW) & BIT_12
    assert wheel.control(READY) & BIT_12 == 0


def test_a_high_bit_4_is_no_set_point(wheel: Wheel) -> None:
    wheel.control(0x06, 0x07, NEW)
    wheel.write(0x607A, 10_000)
    wheel.run(100)
    assert wheel.read(0x6062) == 0
    wheel.control(READY)
    wheel.control(NEW)
    arrive(wheel)
    assert wheel.read(0x6062) == 10_000


def test_the_next_set_point_waits_and_holds_the_acknowledge(wheel: Wheel) -> None:
    give(wheel, 5_000)
    give(wheel, -5_000)
    assert wheel.bits == BIT_12
    wheel.run_until(lambda: not wheel.bits & BIT_12)
    assert (wheel.read(0x6062), wheel.read(0x606B), wheel.bits) == (5_000, 0, 0)
    arrive(wheel)
    assert wheel.read(0x6062) == -5_000


def test_a_third_set_point_is_not_taken(wheel: Wheel) -> None:
    for target in (5_000, 10_000, 15_000):
        give(wheel, target)
    arrive(wheel)
    assert wheel.read(0x6062) == 10_000


def test_a_third_set_point_at_once_replaces_both(wheel: Wheel) -> None:
    give(wheel, 5_000)
    give(wheel, 10_000)
    give(wheel, -2_000, NEW_AT_ONCE)
    assert wheel.bits == 0
    arrive(wheel)
    assert wheel.read(0x6062) == -2_000


@pytest.mark.unmeasured
def test_a_set_point_at_once_turns_the_way_without_a_jump(wheel: Wheel) -> None:
    give(wheel, 100_000)
    wheel.run(300)
    wheel.write(0x607A, 0)
    before = wheel.read(0x606B)
    wheel.control(NEW_AT_ONCE)
    assert before - wheel.read(0x606B) == pytest.approx(DECELERATION / 1_000, abs=1)
    arrive(wheel)
    assert wheel.read(0x6062) == 0


@pytest.mark.unmeasured
def test_a_set_point_keeps_what_it_came_with(wheel: Wheel) -> None:
    give(wheel, 100_000)
    wheel.write(0x6081, 100)
    wheel.write(0x607A, 0)
    assert arrive(wheel) < 1_300
    assert wheel.read(0x6062) == 100_000


def test_relative_set_points_add_to_the_target_before(wheel: Wheel) -> None:
    give(wheel, 3_000, NEW_RELATIVE)
    give(wheel, 3_000, NEW_RELATIVE)
    arrive(wheel)
    assert wheel.read(0x6062) == 6_000
    give(wheel, -1_000, NEW_RELATIVE)
    arrive(wheel)
    assert wheel.read(0x6062) == 5_000


@pytest.mark.parametrize(
    ("controlword", "following", "slowest"),
    [
        (NEW_ON_THE_WAY, 100_000, VELOCITY),  # passes at the profile velocity
        (NEW, 100_000, 0),  # stops
        (NEW_ON_THE_WAY, 0, 0),  # the way turns there
    ],
)
def test_change_on_set_point_passes_without_a_stop(
    wheel: Wheel, controlword: int, following: int, slowest: int
) -> None:
    give(wheel, 50_000)
    give(wheel, following, controlword)
    wheel.run_until(lambda: wheel.read(0x6062) >= 30_000)
    speeds = []
    for _ in range(600):
        wheel.step()
        if 30_000 <= wheel.read(0x6062) < 60_000:
            speeds.append(wheel.read(0x606B))
    assert min(speeds, key=abs) == pytest.approx(slowest, abs=10)
    arrive(wheel)
    assert wheel.read(0x6062) == following


@pytest.mark.unmeasured
def test_with_an_end_velocity_the_motor_goes_on(wheel: Wheel) -> None:
    wheel.write(0x6082, 600)
    give(wheel, 50_000)
    arrive(wheel)
    assert wheel.read(0x6062) == pytest.approx(50_000, abs=2 * 600 * RPM / 1_000)
    wheel.run(100)
    assert (wheel.read(0x606B), wheel.bits) == (600, REACHED)
    wheel.write(0x6082, 0)
    give(wheel, 0)
    arrive(wheel)
    assert wheel.read(0x6062) == 0


@pytest.mark.unmeasured
def test_halt_brakes_and_goes_on(wheel: Wheel) -> None:
    give(wheel, 100_000)
    wheel.run(300)
    wheel.control(HALT)
    assert wheel.bits == 0
    braking_ms = arrive(wheel)
    assert braking_ms >= VELOCITY / DECELERATION * 1_000 - 1
    assert 0 < wheel.read(0x6062) < 100_000
    assert wheel.control(READY) & REACHED == 0
    arrive(wheel)
    assert wheel.read(0x6062) == 100_000


def test_a_set_point_in_halt_waits_for_its_end(wheel: Wheel) -> None:
    wheel.control(HALT)
    wheel.write(0x607A, 5_000)
    assert wheel.control(HALT | 0x10) & BIT_12
    wheel.run(100)
    assert wheel.read(0x6062) == 0
    wheel.control(READY)
    arrive(wheel)
    assert wheel.read(0x6062) == 5_000


def test_the_target_is_reached_when_the_motor_has_been_in_the_window(wheel: Wheel) -> None:
    wheel.write(0x6067, 100)
    wheel.write(0x6068, 50)
    give(wheel, 5_000)
    ended_ms = wheel.run_until(lambda: wheel.read(0x6062) == 5_000)
    assert wheel.bits == 0
    assert ended_ms + arrive(wheel) == pytest.approx(213 - 2 + 50, abs=2)


def test_a_motor_that_is_pulled_away_has_not_reached_its_target(wheel: Wheel) -> None:
    wheel.write(0x6067, 0)
    give(wheel, 5_000)
    arrive(wheel)
    wheel.set(load_nm=2.0)
    wheel.run(3)
    assert wheel.bits & REACHED == 0


def test_a_target_beyond_a_software_limit_ends_there(wheel: Wheel) -> None:
    wheel.write(0x607D, -2_000, 1)
    wheel.write(0x607D, 3_000, 2)
    give(wheel, 10_000)
    arrive(wheel)
    assert wheel.read(0x6062) == 3_000
    assert wheel.read(0x6041) & INTERNAL_LIMIT
    give(wheel, 1_000)
    assert wheel.read(0x6041) & INTERNAL_LIMIT == 0


@pytest.mark.unmeasured
def test_a_profile_velocity_of_0_is_the_slowest() -> None:
    wheel = make_wheel()
    wheel.write(0x6081, 0)
    give(wheel, 5_000)
    wheel.run(2_000)
    assert wheel.read(0x6062) == 2


def test_the_largest_profile_velocity_cuts_the_profile(wheel: Wheel) -> None:
    wheel.write(0x607F, 1_000)
    give(wheel, 100_000)
    wheel.run(300)
    assert wheel.read(0x606B) == 1_000


def test_ramps_without_a_limit_jump(wheel: Wheel) -> None:
    wheel.write(0x6083, 0xFFFF_FFFF)
    give(wheel, 100_000)
    assert wheel.read(0x606B) == VELOCITY


@pytest.mark.unmeasured
def test_sin2_ramps_start_gently(wheel: Wheel) -> None:
    wheel.write(0x6086, 1)
    give(wheel, 100_000)
    wheel.run(8)
    assert wheel.read(0x606B) < ACCELERATION * 0.010 / 5
    assert 8 + arrive(wheel) + 2 == pytest.approx(1_000 + (75 + 150) * 1.5708, abs=1)
    assert wheel.read(0x6062) == 100_000


@pytest.mark.parametrize("shape", [-1, 2, 3])
def test_other_motion_profiles_are_refused(wheel: Wheel, shape: int) -> None:
    with pytest.raises(SdoAbort, match="VALUE_RANGE"):
        wheel.write(0x6086, shape)


def test_a_mode_that_begins_in_motion_brakes(wheel: Wheel) -> None:
    wheel.write(0x60FF, 600)
    wheel.write(0x6060, 3)
    wheel.run(500)
    wheel.write(0x6060, 1)
    wheel.step()
    assert wheel.read(0x606B) == pytest.approx(590, abs=1)
    assert wheel.bits == 0
    arrive(wheel)
    assert wheel.read(0x606B) == 0


@pytest.mark.unmeasured
def test_a_limit_switch_stops_the_way_and_the_way_back_is_free() -> None:
    wheel = make_wheel(make_lenient)
    give(wheel, 100_000)
    wheel.run(300)
    wheel.set(positive_limit_switch=1)
    wheel.run(500)
    stopped = wheel.read(0x6062)
    assert 0 < stopped < 100_000
    assert wheel.read(0x6041) & INTERNAL_LIMIT
    give(wheel, 0, NEW_AT_ONCE)
    arrive(wheel)
    assert wheel.read(0x6062) == 0


@pytest.mark.unmeasured
def test_a_way_goes_on_when_the_limit_switch_is_released() -> None:
    wheel = make_wheel(make_lenient)
    give(wheel, 100_000)
    wheel.run(300)
    wheel.set(positive_limit_switch=1)
    wheel.run(500)
    stopped = wheel.read(0x6062)
    wheel.set(positive_limit_switch=0)
    wheel.step()
    assert wheel.read(0x6062) == pytest.approx(stopped, abs=1)
    arrive(wheel)
    assert wheel.read(0x6062) == 100_000


@pytest.mark.unmeasured
@settings(max_examples=examples(30))
@given(
    st.lists(
        st.tuples(
            st.integers(-20_000, 20_000),
            st.sampled_from([NEW, NEW_AT_ONCE, NEW_RELATIVE, NEW_ON_THE_WAY, HALT]),
            st.integers(1, 120),
        ),
        min_size=1,
        max_size=8,
    )
)
def test_the_demand_never_jumps_and_ends_where_a_set_point_was(
    moves: list[tuple[int, int, int]],
) -> None:
    wheel = make_wheel()
    for target, controlword, passed_ms in moves:
        wheel.write(0x607A, target)
        wheel.write(0x6040, controlword)
        for _ in range(passed_ms):
            before = wheel.read(0x606B)
            wheel.step()
            assert abs(wheel.read(0x606B)) <= VELOCITY
            assert abs(wheel.read(0x606B) - before) <= ACCELERATION / 1_000 + 1
        wheel.control(READY)
    arrive(wheel)
    assert wheel.read(0x606B) == 0


@pytest.mark.parametrize("index", [0x6081, 0x6083, 0x6084])
def test_the_profile_of_a_move_comes_in_a_pdo(wheel: Wheel, index: int) -> None:
    for at, sub, value in (
        *((0x1400, 1, 1 << 31 | 0x201), (0x1600, 0, 0), (0x1600, 1, index << 16 | 32)),
        *((0x1600, 0, 1), (0x1400, 1, 0x201)),
    ):
        wheel.write(at, value, sub)
    wheel.step("000#0101")
    wheel.step("201#2C010000")
    assert wheel.read(index) == 300
