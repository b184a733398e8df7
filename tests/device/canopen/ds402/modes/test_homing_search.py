"""Homing of an ideal axis: it moves exactly as demanded, 100 counts a turn."""

from __future__ import annotations

from math import ceil, floor, inf

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.device.canopen.ds402.modes.homing import (
    METHODS,
    HomingMethod,
    HomingSearch,
    Phase,
    Switch,
)
from tickrig.device.canopen.ds402.trapezoid import Motion, PathLimits, to_velocity

FAST, SLOW, ACCELERATION = 2_000.0, 100.0, 20_000.0
TICK_WAY = SLOW / 1_000
TURN = 100
NONE = Switch(0)
NEGATIVE, POSITIVE, HOME = Switch

NEGATIVE_AT, LEFT_EDGE, RIGHT_EDGE, POSITIVE_AT = -530.0, 140.0, 170.0, 620.0
"""Where the switches are; on the home switch of methods 7 to 14 no fast axis can stop."""

MOMENTARY = (LEFT_EDGE, RIGHT_EDGE)
TO_THE_END = (LEFT_EDGE, inf)
FROM_THE_END = (-inf, LEFT_EDGE)


class Axis:
    def __init__(self, home: tuple[float, float], start: float) -> None:
        self.motion, self.home = Motion(start), home
        self.negative_at, self.positive_at = NEGATIVE_AT, POSITIVE_AT

    def switches(self) -> Switch:
        position = self.motion.position
        found = HOME if self.home[0] <= position <= self.home[1] else NONE
        if position <= self.negative_at:
            found |= NEGATIVE
        if position >= self.positive_at:
            found |= POSITIVE
        return found

    def home_by(self, method: HomingMethod) -> tuple[Phase, float]:
        """Return how it ended and where, at most a minute later."""
        search, now_us = HomingSearch(method, self.switches()), 0
        demanded, path = 0.0, to_velocity(0, self.motion, 0.0, limits())
        while not search.ended:
            assert now_us < 60_000_000
            wanted = search.direction * (SLOW if search.slow else FAST)
            if wanted != demanded:
                demanded, path = wanted, to_velocity(now_us, self.motion, wanted, limits())
            now_us += 1_000
            before, self.motion = self.motion, path.at(now_us)
            velocity = self.motion.velocity
            turns = floor(self.motion.position / TURN) != floor(before.position / TURN)
            moving, crawling = (velocity > 0) - (velocity < 0), abs(velocity) <= SLOW
            search.step(self.switches(), moving, crawling=crawling, index=turns)
        return search.phase, self.motion.position


def limits() -> PathLimits:
    return PathLimits(FAST, ACCELERATION, ACCELERATION)


def next_index(edge: float, direction: int) -> float:
    return (ceil(edge / TURN) if direction > 0 else floor(edge / TURN)) * TURN


HOMES = {
    1: (TO_THE_END, NEGATIVE_AT, +1),
    2: (TO_THE_END, POSITIVE_AT, -1),
    3: (TO_THE_END, LEFT_EDGE, -1),
    4: (TO_THE_END, LEFT_EDGE, +1),
    5: (FROM_THE_END, LEFT_EDGE, +1),
    6: (FROM_THE_END, LEFT_EDGE, -1),
    7: (MOMENTARY, LEFT_EDGE, -1),
    8: (MOMENTARY, LEFT_EDGE, +1),
    9: (MOMENTARY, RIGHT_EDGE, -1),
    10: (MOMENTARY, RIGHT_EDGE, +1),
    11: (MOMENTARY, RIGHT_EDGE, +1),
    12: (MOMENTARY, RIGHT_EDGE, -1),
    13: (MOMENTARY, LEFT_EDGE, +1),
    14: (MOMENTARY, LEFT_EDGE, -1),
}
"""The figures of CiA 402-2: home switch, edge, side of the edge where the index pulse counts."""

STARTS = {
    "on the negative limit": NEGATIVE_AT - 1,
    "left": -70.0,
    "just left of the edge": LEFT_EDGE - 0.05,
    "on the switch": 155.0,
    "on its right edge": RIGHT_EDGE,
    "right": 330.0,
    "on the positive limit": POSITIVE_AT,
}


@pytest.mark.parametrize("start", STARTS.values(), ids=STARTS)
@pytest.mark.parametrize("method", HOMES)
def test_a_method_ends_at_its_index_pulse_from_everywhere(method: int, start: float) -> None:
    home, edge, direction = HOMES[method]
    phase, position = Axis(home, start).home_by(METHODS[method])
    assert phase is Phase.FOUND
    beyond = (position - next_index(edge, direction)) * direction
    assert 0 <= beyond <= TICK_WAY + 1e-6


@pytest.mark.unmeasured
@pytest.mark.parametrize("start", STARTS.values(), ids=STARTS)
@pytest.mark.parametrize("method", HOMES)
def test_the_method_16_later_ends_at_the_edge_from_everywhere(method: int, start: float) -> None:
    home, edge, direction = HOMES[method]
    phase, position = Axis(home, start).home_by(METHODS[method + 16])
    assert phase is Phase.FOUND
    beyond = (position - edge) * direction
    assert 0 <= beyond <= TICK_WAY + 1e-6


@pytest.mark.unmeasured
@given(
    st.sampled_from(sorted(HOMES)),
    st.floats(NEGATIVE_AT - 50, POSITIVE_AT + 50),
    st.floats(FAST / 1_000, 300),
)
def test_home_is_the_same_from_everywhere_with_any_switch(
    method: int, start: float, width: float
) -> None:
    home, edge, direction = HOMES[method]
    if home is MOMENTARY:
        home = (LEFT_EDGE, LEFT_EDGE + width)
        edge = home[0] if edge == LEFT_EDGE else home[1]
    phase, position = Axis(home, start).home_by(METHODS[method + 16])
    assert phase is Phase.FOUND
    assert 0 <= (position - edge) * direction <= TICK_WAY + 1e-6


@pytest.mark.parametrize(("method", "home"), [(33, 200.0), (34, 300.0)])
def test_33_and_34_take_the_next_index_pulse(method: int, home: float) -> None:
    phase, position = Axis(MOMENTARY, 250.0).home_by(METHODS[method])
    assert phase is Phase.FOUND
    assert position == pytest.approx(home, abs=TICK_WAY)


@pytest.mark.parametrize("method", [35, 37])
def test_35_and_37_do_not_move(method: int) -> None:
    assert Axis(MOMENTARY, 123.0).home_by(METHODS[method]) == (Phase.FOUND, 123.0)


@pytest.mark.parametrize("method", [3, 4, 19, 20, 33, 34])
def test_a_limit_switch_ahead_ends_a_method_that_does_not_use_it(method: int) -> None:
    axis = Axis((inf, inf), 50.0)
    axis.positive_at, axis.negative_at = 80.0, 20.0
    phase, position = axis.home_by(METHODS[method])
    assert phase is Phase.FAILED
    assert abs(position - 50.0) == pytest.approx(30.0, abs=FAST / 1_000)


@pytest.mark.unmeasured
@pytest.mark.parametrize("method", range(23, 31))
def test_a_home_switch_that_is_nowhere_is_looked_for_at_both_ends(method: int) -> None:
    first = METHODS[method].first
    phase, position = Axis((inf, inf), 0.0).home_by(METHODS[method])
    assert phase is Phase.FAILED
    assert position == pytest.approx(NEGATIVE_AT if first > 0 else POSITIVE_AT, abs=FAST / 1_000)


@pytest.mark.parametrize(("method", "wrong"), [(17, POSITIVE), (18, NEGATIVE)])
def test_a_limit_switch_of_the_other_end_ends_the_search(method: int, wrong: Switch) -> None:
    search = HomingSearch(METHODS[method], NONE)
    search.step(NONE, search.direction, crawling=True, index=False)
    search.step(wrong, search.direction, crawling=True, index=False)
    assert search.phase is Phase.FAILED


@pytest.mark.parametrize("method", sorted(set(METHODS) - {35, 37}))
def test_both_limit_switches_at_once_end_the_search(method: int) -> None:
    search = HomingSearch(METHODS[method], NEGATIVE)
    search.step(NEGATIVE | POSITIVE, 0, crawling=True, index=False)
    assert search.phase is Phase.FAILED


def test_an_axis_on_the_far_limit_switch_may_leave_it() -> None:
    search = HomingSearch(METHODS[17], POSITIVE)
    search.step(POSITIVE, -1, crawling=True, index=False)
    assert (search.phase, search.direction) == (Phase.SEEK, -1)


def test_an_index_pulse_counts_only_in_the_direction_of_the_approach() -> None:
    search = HomingSearch(METHODS[34], NONE)
    search.step(NONE, -1, crawling=True, index=True)
    assert not search.ended
    search.step(NONE, +1, crawling=True, index=True)
    assert search.ended
