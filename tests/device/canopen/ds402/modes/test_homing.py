"""Homing of an EPOS with its wheel: switches at angles of the shaft, index pulses of the motor."""

from __future__ import annotations

from itertools import pairwise
from math import ceil, floor

import pytest

from tests.device.canopen.ds402.wheel import (
    BIT_12,
    BIT_13,
    COUNTS_PER_DEG,
    REACHED,
    RPM,
    TURN,
    Wheel,
)
from tickrig.device.canopen.dictionary import SdoAbort
from tickrig.device.canopen.ds402.modes.homing import METHODS, index_pulse
from tickrig.wire.instant import NEVER

START, READY, HALT = 0x1F, 0x0F, 0x11F
FAST_RPM, SLOW_RPM, OFFSET = 600, 60, 777
EDGE_TOLERANCE = SLOW_RPM * RPM / 1_000 + 1
"""Counts: what the axis moves in a tick, and one."""

AT_HOME = 4
"""Counts (0.014 degrees of the wheel) that the motor is off the demand at most when it stands."""

NEGATIVE_DEG, POSITIVE_DEG = -20.0, 25.0
EVERYWHERE_DEG = 1_000.0
HOME_DEG = {
    "left of it": (10.0, 11.0),
    "on it": (-0.5, 0.5),
    "right of it": (-9.0, -8.0),
}
"""The home switch, as it lies when the axis starts at 0."""


def make_wheel(method: int, home: tuple[float, float] = (900.0, 901.0)) -> Wheel:
    wheel = Wheel()
    wheel.set(negative_limit_at=NEGATIVE_DEG, positive_limit_at=POSITIVE_DEG)
    wheel.set(home_from=home[0], home_to=home[1])
    for index, sub, value in (
        (0x6098, 0, method),
        (0x6099, 1, FAST_RPM),
        (0x6099, 2, SLOW_RPM),
        (0x609A, 0, 20_000),
        (0x607C, 0, OFFSET),
    ):
        wheel.write(index, value, sub)
    wheel.enable(6)
    return wheel


def test_switches_are_seen_whoever_presses_them() -> None:
    wheel = Wheel()
    names = ("at_negative_limit", "at_positive_limit", "at_home")

    def pressed() -> list[object]:
        wheel.run(2)
        return [wheel.drive.read(name) for name in names]

    assert pressed() == [0, 0, 0]
    wheel.set(home_from=-1.0, home_to=1.0, negative_limit_at=5.0)
    assert pressed() == [1, 0, 1]
    wheel.set(positive_limit_switch=1)
    assert pressed() == [1, 1, 1]


def home(wheel: Wheel) -> int:
    """Home; return bits 10, 12 and 13 in the end."""
    wheel.control(START)
    wheel.run_until(lambda: bool(wheel.bits & REACHED))
    return wheel.bits


def home_counts(wheel: Wheel) -> float:
    """Return the counts of the place that is called 607Ch."""
    return wheel.drive.axis.counts_of(OFFSET)


def home_switch(method: int, start: str) -> tuple[float, float]:
    """Return where the home switch of a method begins and ends."""
    first, last = HOME_DEG[start]
    if method % 16 in (3, 4):
        return first, EVERYWHERE_DEG
    return (-EVERYWHERE_DEG, last) if method % 16 in (5, 6) else (first, last)


def expected(method: int, home_deg: tuple[float, float]) -> tuple[float, int]:
    """Return the edge in counts and the direction behind it, by the figures of CiA 402-2."""
    left, right = home_deg
    edge_deg, direction = {
        1: (NEGATIVE_DEG, +1),
        2: (POSITIVE_DEG, -1),
        3: (left, -1),
        4: (left, +1),
        5: (right, +1),
        6: (right, -1),
        7: (left, -1),
        8: (left, +1),
        9: (right, -1),
        10: (right, +1),
        11: (right, +1),
        12: (right, -1),
        13: (left, +1),
        14: (left, -1),
    }[method % 16]
    return edge_deg * COUNTS_PER_DEG, direction


def next_index(edge: float, direction: int) -> int:
    return (ceil(edge / TURN) if direction > 0 else floor(edge / TURN)) * TURN


@pytest.mark.unmeasured
@pytest.mark.parametrize("start", HOME_DEG)
@pytest.mark.parametrize("method", range(1, 15))
def test_home_is_the_index_pulse_behind_the_edge(method: int, start: str) -> None:
    home_deg = home_switch(method, start)
    wheel = make_wheel(method, home_deg)
    assert home(wheel) == REACHED | BIT_12
    assert home_counts(wheel) == next_index(*expected(method, home_deg))
    assert wheel.read(0x6064) == pytest.approx(OFFSET, abs=AT_HOME)


@pytest.mark.unmeasured
@pytest.mark.parametrize("start", HOME_DEG)
@pytest.mark.parametrize("method", range(17, 31))
def test_home_is_the_edge(method: int, start: str) -> None:
    home_deg = home_switch(method, start)
    wheel = make_wheel(method, home_deg)
    assert home(wheel) == REACHED | BIT_12
    edge, direction = expected(method, home_deg)
    assert -1 <= (home_counts(wheel) - edge) * direction <= EDGE_TOLERANCE
    assert wheel.read(0x6064) == pytest.approx(OFFSET, abs=AT_HOME)


@pytest.mark.unmeasured
@pytest.mark.parametrize(("method", "turns"), [(33, -1), (34, 1)])
def test_33_and_34_go_to_the_next_index_pulse(method: int, turns: int) -> None:
    wheel = make_wheel(method)
    assert home(wheel) == REACHED | BIT_12
    assert home_counts(wheel) == turns * TURN
    wheel.run(500)
    assert wheel.read(0x6062) == OFFSET
    assert wheel.slave.due_us == NEVER


@pytest.mark.parametrize("method", [35, 37])
def test_35_and_37_take_the_present_position_at_once(method: int) -> None:
    wheel = make_wheel(method)
    assert wheel.control(START) & (REACHED | BIT_12 | BIT_13) == REACHED | BIT_12
    wheel.run(100)
    assert (wheel.read(0x6063), wheel.read(0x6064)) == (0, OFFSET)
    assert wheel.slave.due_us == NEVER


@pytest.mark.parametrize("method", [1, 7, 18])
def test_a_reversed_polarity_mirrors_the_directions(method: int) -> None:
    wheel = Wheel()
    wheel.write(0x607E, 0xC0)
    wheel.write(0x6098, method)
    wheel.write(0x6099, FAST_RPM, 1)
    wheel.enable(6)
    wheel.control(START)
    wheel.run(50)
    assert wheel.read(0x6063) * METHODS[method].first < 0
    assert wheel.read(0x6064) * METHODS[method].first > 0


def test_the_search_is_fast_and_the_approach_slow() -> None:
    wheel = make_wheel(17)
    wheel.control(START)
    speeds = list[int]()
    while not wheel.bits & BIT_12:
        wheel.step()
        speeds.append(wheel.read(0x606B))
    assert (min(speeds), max(speeds)) == (-FAST_RPM, SLOW_RPM)
    ramps = [after - before for before, after in pairwise(speeds)]
    assert max(map(abs, ramps)) <= 20_000 / 1_000 + 1


def test_the_bits_say_not_begun_searching_attained_and_there() -> None:
    wheel = make_wheel(17)
    told = [wheel.bits]
    wheel.control(START)
    while told[-1] != REACHED | BIT_12:
        if wheel.bits != told[-1]:
            told.append(wheel.bits)
        wheel.step()
    assert told == [REACHED, 0, BIT_12, REACHED | BIT_12]


def test_the_home_position_stays_when_bit_4_falls_and_in_other_modes() -> None:
    wheel = make_wheel(33)
    home(wheel)
    assert wheel.control(READY) & (REACHED | BIT_12) == REACHED | BIT_12
    wheel.write(0x6060, 1)
    wheel.write(0x607A, 0)
    wheel.control(START)
    wheel.run_until(lambda: bool(wheel.bits & REACHED))
    assert wheel.read(0x6063) == pytest.approx(-TURN - OFFSET, abs=AT_HOME)


@pytest.mark.unmeasured
def test_what_a_homing_found_holds_until_the_next_one_begins() -> None:
    wheel = make_wheel(33)
    home(wheel)
    wheel.write(0x6060, 1)
    wheel.control(READY)
    wheel.write(0x6060, 6)
    wheel.run(2)
    assert wheel.bits == BIT_12 | REACHED
    wheel.write(0x6098, 1)
    assert wheel.control(START) & (BIT_12 | REACHED) == 0
    assert not wheel.drive.axis.homed


@pytest.mark.parametrize("controlword", [READY, HALT])
def test_a_homing_is_interrupted_by_bit_4_and_by_halt(controlword: int) -> None:
    wheel = make_wheel(17)
    wheel.control(START)
    wheel.run(100)
    assert wheel.control(controlword) & (REACHED | BIT_12 | BIT_13) == 0
    wheel.run_until(lambda: bool(wheel.bits & REACHED))
    assert wheel.bits == REACHED
    assert not wheel.drive.axis.homed


def test_after_halt_a_rising_edge_begins_anew() -> None:
    wheel = make_wheel(17)
    wheel.control(START, HALT, START)
    wheel.run(200)
    assert (wheel.read(0x606C), wheel.bits) == (0, REACHED)
    wheel.control(READY)
    assert home(wheel) == REACHED | BIT_12


@pytest.mark.unmeasured
def test_halt_on_the_way_back_delays_it() -> None:
    wheel = make_wheel(17)
    wheel.write(0x609A, 1_000)
    wheel.control(START)
    wheel.run_until(lambda: bool(wheel.bits & BIT_12))
    wheel.control(HALT)
    wheel.run(100)
    assert wheel.bits == REACHED | BIT_12
    assert wheel.read(0x6064) != pytest.approx(OFFSET, abs=AT_HOME)
    wheel.control(START)
    wheel.run_until(lambda: bool(wheel.bits & REACHED))
    assert wheel.read(0x6064) == pytest.approx(OFFSET, abs=AT_HOME)


def test_a_limit_switch_in_the_way_is_an_error_with_then_without_motion() -> None:
    wheel = make_wheel(20)
    wheel.write(0x609A, 2_000)
    wheel.control(START)
    wheel.run_until(lambda: bool(wheel.bits & BIT_13))
    assert wheel.bits == BIT_13
    wheel.run_until(lambda: bool(wheel.bits & REACHED))
    assert wheel.bits == BIT_13 | REACHED
    assert wheel.control(READY) & BIT_13
    assert not wheel.drive.axis.homed


def test_both_limit_switches_are_an_error() -> None:
    wheel = make_wheel(33)
    wheel.set(negative_limit_switch=1, positive_limit_switch=1)
    wheel.step()
    assert home(wheel) == BIT_13 | REACHED


def test_switches_by_hand_home_as_well() -> None:
    wheel = Wheel()
    wheel.write(0x6098, 19)
    wheel.enable(6)
    wheel.control(START)
    wheel.run(50)
    wheel.set(home_switch=1)
    wheel.run(100)
    wheel.set(home_switch=0)
    wheel.run_until(lambda: bool(wheel.bits & REACHED))
    assert wheel.bits == BIT_12 | REACHED


def test_method_0_is_an_error() -> None:
    assert home(make_wheel(0)) == BIT_13 | REACHED


@pytest.mark.parametrize("method", [-1, 15, 16, 31, 32, 36, 38])
def test_other_methods_are_refused(method: int) -> None:
    with pytest.raises(SdoAbort, match="VALUE_RANGE"):
        Wheel().write(0x6098, method)


@pytest.mark.parametrize(
    ("before", "after", "pulse"),
    [
        (0, 0, None),
        (0, 1_999, None),
        (0, 2_000, 2_000),
        (2_000, 2_001, None),
        (1_999, 9_000, 2_000),
        (2_001, 2_000, 2_000),
        (2_000, 1_999, None),
        (1, -1, 0),
        (-1, 1, 0),
        (-1, -9_000, -2_000),
    ],
)
def test_the_index_pulse_is_the_first_on_the_way(before: int, after: int, pulse: int) -> None:
    assert index_pulse(before, after, TURN) == pulse
