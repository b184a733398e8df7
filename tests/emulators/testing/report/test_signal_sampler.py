from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.emulators.lamp import Lamp
from tickrig.device.physical import InputSignal, OutputSignal, QuantityBank
from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.testing.bench.bench import Bench
from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.emulators.testing.plugin.bench_evidence import SignalSampler
from tickrig.emulators.testing.report.bench_report import SignalSeries, Value, thinned


class Heater:
    """A device whose only output goes where its input is."""

    tick_us = 1_000

    def __init__(self) -> None:
        self.inputs = QuantityBank((InputSignal("heat_w", "power", high=9, unit="W", real=True),))
        self.outputs = {"oven_c": OutputSignal("oven_c", "temperature", "degC")}

    def read(self, name: str, /) -> float:
        assert name == "oven_c"
        return 20.0 + self.inputs["heat_w"]


def test_what_stays_as_it_is_takes_no_room() -> None:
    lamp = Lamp()
    sampler = SignalSampler(lamp, ["state", "x_mm"], prefix="left/")
    for now_us in range(0, 10_000, 1_000):
        if now_us == 4_000:
            lamp.inputs.set("x_mm", 7)
            lamp.inputs.set("lamp", 0)
        sampler.take(now_us)
    assert sampler.series() == (
        SignalSeries("left/state", "", ((0, "Lit"), (4_000, "Dark"), (9_000, "Dark"))),
        SignalSeries("left/x_mm", "mm", ((0, 0), (4_000, 7), (9_000, 7))),
    )


def test_a_line_leaves_from_where_a_value_still_was() -> None:
    oven = Heater()
    sampler = SignalSampler(oven, ["oven_c"])
    for now_us, heat_w in ((0, 0), (1_000, 0), (2_000, 0), (3_000, 5), (4_000, 6)):
        oven.inputs.set("heat_w", heat_w)
        sampler.take(now_us)
    (series,) = sampler.series()
    assert series.points == ((0, 20.0), (2_000, 20.0), (3_000, 25.0), (4_000, 26.0))
    assert (series.unit, series.steps) == ("degC", False)


def test_a_long_run_keeps_its_spikes_and_takes_bounded_room() -> None:
    oven = Heater()
    sampler = SignalSampler(oven, ["oven_c"], most=50)
    for now_us in range(100_000):
        oven.inputs.set("heat_w", 9 if now_us == 31_415 else now_us % 3)
        sampler.take(now_us)
    (series,) = sampler.series()
    assert len(series.points) <= 50
    assert len(sampler._points["oven_c"]) <= 100
    assert (31_415, 29.0) in series.points
    assert series.points[-1][0] == 99_999


def test_a_signal_that_is_not_there_is_refused_at_once() -> None:
    with pytest.raises(ValueError, match="no input 'stat'"):
        SignalSampler(Lamp(), ["stat"])


def test_signals_of_a_bench_are_called_as_there() -> None:
    """As the plug-in takes them: after each step of the rig, whoever makes time pass."""
    with Bench(chair=Rrc(), spare=Rrc()) as bench:
        taken: list[SignalSampler] = []

        def begin(rig: BenchRig) -> None:
            sampler = SignalSampler(rig.device, ["chair/state", "spare/out_v_pct"])
            rig.rig.watchers.append(sampler.take)
            taken.append(sampler)

        bench._mode.act(begin)
        bench.run_for("100ms")
        bench["chair"].press("power_button")
        assert bench.wait_until(lambda: bench["chair"].get("state") == "Standby", within="1s")
    state, speed = taken[0].series()
    assert [word for _, word in state.points] == ["WaitPowerOn", "Standby"]
    assert (state.name, speed.name, speed.unit) == ("chair/state", "spare/out_v_pct", "%")


def test_nothing_was_taken() -> None:
    assert SignalSampler(Lamp(), ["state"]).series() == (SignalSeries("state"),)


VALUES: st.SearchStrategy[Value] = st.integers(-9, 9) | st.sampled_from(["a", "b", None])


@given(st.lists(VALUES), st.integers(4, 20))
def test_fewer_samples_are_some_of_them_in_their_order(values: list[Value], most: int) -> None:
    points = list(enumerate(values))
    kept = thinned(points, most)
    assert len(kept) <= most
    assert set(kept) <= set(points)
    assert kept == sorted(kept, key=lambda point: point[0])
    assert len(points) > most or kept == points
    numbers = [value for value in values if isinstance(value, int)]
    if numbers and len(numbers) == len(values):
        assert {min(numbers), max(numbers)} <= {value for _, value in kept}


def test_of_every_four_the_least_and_the_greatest_stay() -> None:
    values = [5, 1, 1, 9, 2, 7, 7, 7, 3, 8, 4, 4, 6, 0]
    points = list(enumerate(values))
    assert thinned(points, 9) == [(0, 5), (1, 1), (3, 9), (5, 7), (8, 3), (9, 8), (10, 4), (13, 0)]
    assert thinned(points, 14) == points


def test_of_words_the_first_and_the_last_of_four_stay() -> None:
    points: list[tuple[int, Value]] = list(enumerate(["x", "a", "b", "c", "d", 1, 2, "e", "y"]))
    assert [value for _, value in thinned(points, 8)] == ["x", "a", "d", 1, "e", "y"]
    alike: list[tuple[int, Value]] = list(enumerate([0, 4, 4, 4, 4, 4, 0]))
    assert thinned(alike, 6) == [(0, 0), (1, 4), (4, 4), (5, 4), (6, 0)]
