"""Values of time alone, beside what they are computed of here."""

from __future__ import annotations

from math import isclose, pi, sin

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tickrig.emulators.testing.signals.sources import (
    Constant,
    Noise,
    RampSource,
    SignalSource,
    ValueTable,
    Wave,
)
from tickrig.wire.instant import NEVER

S = 1_000_000


@pytest.mark.parametrize(
    ("source", "values", "next_us"),
    [
        (Constant(3), {0: 3, 9 * S: 3}, {0: NEVER}),
        (RampSource(0, 8, 4 * S), {0: 0, S: 2, 4 * S: 8, 9 * S: 8}, {0: 1, 4 * S: NEVER}),
        (RampSource(5, 5, S), {S // 2: 5}, {0: NEVER}),
        (RampSource(0, 8, 4 * S, repeat=True), {5 * S: 2, 8 * S: 0}, {8 * S: 8 * S + 1}),
        (Wave("triangle", 1, 3, 4 * S), {0: 1, S: 2, 2 * S: 3, 3 * S: 2, 4 * S: 1}, {5: 6}),
        (
            Wave("square", 1, 3, 4 * S, 0, 0.25),
            {0: 1, 3 * S - 1: 1, 3 * S: 3, 4 * S - 1: 3, 4 * S: 1},
            {0: 3 * S, 3 * S: 4 * S, 4 * S - 1: 4 * S, 4 * S: 7 * S},
        ),
        (Wave("square", 1, 3, 4 * S, 2 * S), {0: 3, 2 * S: 1}, {0: 2 * S}),
        (
            ValueTable((S, 2 * S, 2 * S, 4 * S), (1, 3, 9, 9)),
            {0: 1, S: 1, 3 * S // 2: 2, 2 * S - 1: 3 - 2e-6, 2 * S: 9, 3 * S: 9, 8 * S: 9},
            {0: S, S: S + 1, 2 * S: 4 * S, 4 * S: NEVER},
        ),
        (ValueTable((S, 2 * S), (1, 3), linear=False), {0: 1, S: 1, 2 * S: 3}, {0: S, S: 2 * S}),
        (
            ValueTable((0, S, 2 * S), (1, 3, 1), repeat=True),
            {S: 3, 2 * S: 1, 5 * S // 2: 2, 3 * S: 3},
            {S: S + 1},
        ),
        (
            ValueTable((0, S, 2 * S), (1, 3, 1), linear=False, repeat=True),
            {3 * S: 3, 4 * S: 1},
            {S: 2 * S, 7 * S // 2: 4 * S},
        ),
        (ValueTable((0,), (4,), repeat=True), {9: 4}, {9: NEVER}),
    ],
)
def test_values_and_when_they_change(
    source: SignalSource, values: dict[int, float], next_us: dict[int, int]
) -> None:
    for at_us, value in values.items():
        assert isclose(float(source.value(at_us)), value, rel_tol=1e-12)
    assert {at_us: source.next_us(at_us) for at_us in next_us} == next_us


@given(st.integers(0, 10**12), st.integers(100, 10**9), st.integers(0, 360))
def test_a_sine_is_one(at_us: int, period_us: int, phase_deg: int) -> None:
    wave = Wave("sine", 2, 6, period_us, round(phase_deg / 360 * period_us))
    turns = at_us % period_us / period_us + wave.phase_us / period_us
    assert isclose(wave.value(at_us), 4 + 2 * sin(2 * pi * turns), rel_tol=1e-9)


numbers = st.floats(-1e6, 1e6)
periods = st.integers(100, 5_000)
sources = st.one_of(
    st.builds(Constant, numbers),
    st.builds(RampSource, numbers, numbers, periods, st.booleans()),
    st.builds(
        Wave, st.sampled_from(["sine", "square", "triangle"]), numbers, numbers, periods, periods
    ),
    st.builds(Noise, numbers, st.floats(0, 10), st.booleans(), periods, st.integers(0, 9)),
    st.builds(
        lambda steps, values, linear, repeat: ValueTable(
            tuple(sum(steps[: i + 1]) for i in range(len(steps))),
            values[: len(steps)],
            linear,
            repeat,
        ),
        st.lists(st.integers(0, 3_000), min_size=1, max_size=6),
        st.tuples(*[numbers] * 6),
        st.booleans(),
        st.booleans(),
    ),
)


@settings(max_examples=300)
@given(sources, st.integers(0, 20_000))
@example(ValueTable((0, 375), (77.0, 77.0)), 0)
def test_nothing_changes_before_it_says_so(source: SignalSource, at_us: int) -> None:
    next_us = source.next_us(at_us)
    assert next_us > at_us
    value = source.value(at_us)
    for later_us in {at_us + 1, (at_us + min(next_us, 10**6)) // 2, min(next_us, 10**6) - 1}:
        if at_us <= later_us < next_us:
            assert source.value(later_us) == value


@settings(max_examples=300)
@given(sources, st.integers(0, 10**12))
def test_values_stay_within_their_ends(source: SignalSource, at_us: int) -> None:
    if ends := source.ends:
        margin = 1e-9 * max(map(abs, ends))
        assert min(ends) - margin <= float(source.value(at_us)) <= max(ends) + margin
