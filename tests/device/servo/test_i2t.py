"""The overload of a power stage."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tickrig.device.servo.parameters import EPOS_24_5
from tickrig.device.servo.readings import I2t

PEAK, CONTINUOUS = 10.0, 5.0


@pytest.fixture
def i2t() -> I2t:
    return I2t(EPOS_24_5)


def let(i2t: I2t, current_a: float, seconds: float) -> None:
    for _ in range(round(seconds / 0.02)):
        i2t.pass_time(0.02, current_a**2 * 0.02)


def test_the_peak_current_flows_for_its_time_and_no_longer(i2t: I2t) -> None:
    let(i2t, PEAK, 0.98)
    assert (i2t.limit_a, i2t.reduced) == (PEAK, False)
    let(i2t, PEAK, 0.04)
    assert (i2t.limit_a, i2t.reduced) == (CONTINUOUS, True)


def test_less_than_the_peak_flows_longer(i2t: I2t) -> None:
    let(i2t, 7.0, 75 / 24 - 0.05)  # (10^2 - 5^2) 1 s / (7^2 - 5^2)
    assert not i2t.reduced
    let(i2t, 7.0, 0.1)
    assert i2t.reduced


def test_the_continuous_current_flows_for_ever(i2t: I2t) -> None:
    let(i2t, CONTINUOUS, 100.0)
    assert i2t.filled_a2s == pytest.approx(0.0, abs=1e-9)


def test_the_peak_comes_back_when_the_budget_is_empty(i2t: I2t) -> None:
    let(i2t, PEAK, 1.1)
    let(i2t, 0.0, 2.98)  # 75 A2s at 25 A2
    assert i2t.reduced
    let(i2t, 0.0, 0.04)
    assert (i2t.reduced, i2t.limit_a) == (False, PEAK)


@pytest.mark.parametrize(
    ("before", "current_a", "settled"),
    [
        ("empty", 0.0, True),
        ("empty", CONTINUOUS, True),
        ("empty", PEAK, False),
        ("half", 0.0, False),
        ("half", CONTINUOUS, True),
        ("full", 0.0, False),
        ("full", CONTINUOUS, True),
        ("full", PEAK, True),
    ],
)
def test_it_is_settled_when_the_current_changes_nothing(
    i2t: I2t, before: str, current_a: float, settled: bool
) -> None:
    let(i2t, PEAK, {"empty": 0.0, "half": 0.5, "full": 1.1}[before])
    assert i2t.settled(current_a) is settled


def test_a_stage_without_a_peak_is_never_reduced() -> None:
    i2t = I2t(replace(EPOS_24_5, peak_a=CONTINUOUS))
    let(i2t, CONTINUOUS, 1.0)
    assert (i2t.limit_a, i2t.reduced, i2t.settled(0.0)) == (CONTINUOUS, False, True)
