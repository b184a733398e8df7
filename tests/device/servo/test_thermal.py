"""Winding and housing against closed forms."""

from __future__ import annotations

from dataclasses import replace
from math import exp

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.device.servo.parameters import RE_30
from tickrig.device.servo.readings import COPPER_PER_K, HOTTEST_C, ThermalModel

COLD = (25.0, 25.0)
AGES_S = 1e6


def test_the_final_temperatures_are_those_of_the_thermal_resistances() -> None:
    square_a2 = 3.0**2
    winding_c, housing_c = ThermalModel(RE_30).after(COLD, AGES_S, square_a2, 25.0)
    heat_w = square_a2 * RE_30.resistance_ohm * (1 + COPPER_PER_K * (winding_c - 25))
    assert housing_c - 25 == pytest.approx(heat_w * RE_30.housing_ambient_k_w)
    assert winding_c - housing_c == pytest.approx(heat_w * RE_30.winding_housing_k_w)


def test_a_winding_in_a_heavy_housing_warms_with_its_time_constant() -> None:
    model = ThermalModel(replace(RE_30, housing_s=1e12))
    winding_c, _ = model.after(COLD, RE_30.winding_s, 1e-3, 25.0)
    rise_k = winding_c - 25
    final_k = 1e-3 * RE_30.resistance_ohm * RE_30.winding_housing_k_w
    assert rise_k / final_k == pytest.approx(1 - exp(-1), rel=1e-4)


def test_a_motor_without_current_cools_with_the_time_constant_of_its_housing() -> None:
    even = ThermalModel(replace(RE_30, winding_s=1e-3))  # a winding without mass
    winding_c, housing_c = even.after((85.0, 85.0), RE_30.housing_s, 0.0, 25.0)
    assert housing_c - 25 == pytest.approx(60 * exp(-1), rel=1e-4)
    assert winding_c == pytest.approx(housing_c, rel=1e-4)


@given(
    st.floats(20, 120), st.floats(20, 120), st.floats(0, 40), st.floats(0, 2_000), st.floats(0, 1)
)
def test_time_in_two_pieces_is_time_in_one(
    winding_c: float, housing_c: float, square_a2: float, seconds: float, part: float
) -> None:
    model, start = ThermalModel(RE_30), (winding_c, housing_c)
    middle = model.after(start, seconds * part, square_a2, 20.0)
    end = model.after(middle, seconds * (1 - part), square_a2, 20.0)
    once = model.after(start, seconds, square_a2, 20.0)
    assert end == pytest.approx(once, rel=1e-9)


def test_no_time_changes_nothing() -> None:
    start = (80.0, 40.0)
    assert ThermalModel(RE_30).after(start, 0.0, 9.0, 25.0) == start


def test_copper_that_warms_itself_runs_away_to_the_hottest_and_stays() -> None:
    end = ThermalModel(RE_30).after(COLD, AGES_S, 10.0**2, 25.0)
    assert end == (HOTTEST_C, HOTTEST_C)


def test_resistance_grows_with_the_temperature() -> None:
    assert ThermalModel(RE_30).resistance_ohm(125.0) == pytest.approx(0.611 * 1.39)
