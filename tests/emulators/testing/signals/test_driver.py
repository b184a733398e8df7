"""Signals drive inputs of devices on a rig."""

from __future__ import annotations

import tomllib
from math import exp, isclose, isnan

import pytest

from tests.emulators.testing.signals.signal_bench import Meter, SignalBench, signals_of
from tickrig.device.canopen.models.f_palette import make_f_palette
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.node import Node, NodeSide
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.testing.signals.driver import SignalDriver, check_signals
from tickrig.wire.instant import NEVER


def test_an_input_has_the_value_of_now() -> None:
    bench = SignalBench.of('"a/volt" = {ramp = [12.0, 9.5], over = "10s"}')
    assert bench.a.inputs["volt"] == 12.0
    bench.rig.run_for(4_000_000)
    assert bench.a.inputs["volt"] == 11.0
    assert bench.a.seen[-1][:2] == (4_000_000, 12.0 - 2.5 * 0.3998)
    bench.rig.run_for(60_000_000)
    assert (bench.a.inputs["volt"], bench.driver.due_us) == (9.5, NEVER)


def test_time_jumps_where_nothing_changes() -> None:
    bench = SignalBench.of('"b/count" = {table = [[0, 1], [60, 2]], interpolation = "hold"}')
    steps = []
    while bench.rig.next_us != NEVER:
        bench.rig.step()
        steps.append(bench.rig.now_us)
    assert steps == [4_000, 10_000, 60_000_000, 60_004_000]
    assert [seen[2] for seen in bench.b.seen] == [1, 2]


def test_an_input_takes_what_it_can() -> None:
    bench = SignalBench.of(
        """
        "a/count" = {formula = "10 * t + 0.6"}
        "a/key" = {square = [0, 1], period = "2s"}
        "a/label" = "ready"
        "b/volt" = {formula = "1 / (3 - t)"}
        "b/count" = {formula = "1000 * t"}
        """
    )
    assert bench.a.inputs["label"] == "ready"
    bench.rig.run_for(1_500_000)
    assert (bench.a.inputs["count"], bench.a.inputs["key"]) == (16, 1)
    assert bench.b.inputs["count"] == 50  # as far as it goes
    bench.rig.run_for(1_500_000)
    assert bench.b.inputs["volt"] == 100  # 1/0 is without end
    assert bench.driver.problems == {}


def test_what_is_no_number_leaves_an_input_as_it_is() -> None:
    bench = SignalBench.of('"a/volt" = {formula = "sqrt(1 - t)"}')
    bench.rig.run_for(2_000_000)
    assert bench.a.inputs["volt"] == 0.0
    assert bench.driver.problems == {"a/volt": "a/volt: nan is no value at 1.002000 s"}


def test_objects_of_a_node_are_driven_too() -> None:
    wire = CanWire()
    node = Node("fp", make_f_palette(), wire)
    devices = {"fp": NodeSide(node)}
    assert [str(m) for m in check_signals(signals_of({"fp/0x1000": -1}), devices)] == [
        "fp/0x1000: 0x1000 -1 is not in 0..4294967295"
    ]
    signals = signals_of(
        {
            "fp/0x1017": {"ramp": [500, 70_000], "over": "1s", "max": 65_535},
            "fp/0x1A00:0": {"table": [[0, 2], [1, 200]], "interpolation": "hold"},
            "fp/ai1_v": {"formula": "'fp/0x1017' / 20000"},
        }
    )
    driver = SignalDriver(signals, devices)
    rig = Rig(Station(node, node.port), couplings=[driver])
    rig.run_for(2_000_000)
    assert devices["fp"].inputs["0x1017"] == 65_535
    assert devices["fp"].inputs["ai1_v"] == 3.27675
    refused = "0x1A00:0 200: refused, UNSUPPORTED_ACCESS (0x06010000) at 1.000000 s"
    assert driver.problems == {"fp/0x1A00:0": f"fp/0x1A00:0: {refused}"}


def test_formulas_follow_each_other_at_once() -> None:
    bench = SignalBench.of(
        """
        "a/volt" = {formula = "twice + 1"}
        twice = {formula = "2 * base"}
        base = {table = [[0, 1], [1, 5]], interpolation = "hold"}
        "b/volt" = {formula = "a.volt + 'a/volt'"}
        "a/count" = {formula = "volt"}
        """
    )
    bench.rig.run_for(1_000_000)
    assert bench.driver.value("a/volt") == 11.0
    assert (bench.a.inputs["volt"], bench.b.inputs["volt"]) == (11.0, 22.0)
    assert bench.a.inputs["count"] == 11


def test_outputs_come_back_at_the_next_tick() -> None:
    bench = SignalBench.of(
        """
        "a/volt" = {formula = "10 - b.mean"}
        "b/volt" = {formula = "a.mean"}
        """
    )
    bench.rig.run_for(5_000_000)
    assert isclose(bench.a.inputs["volt"], 5.0, abs_tol=1e-9)
    assert bench.driver.due_us == NEVER


def test_a_hand_holds_until_the_signal_changes_or_for_good() -> None:
    bench = SignalBench.of('"a/volt" = {table = [[0, 1], [1, 2], [2, 3]], interpolation = "hold"}')
    bench.a.inputs.set("volt", 9.0)
    bench.rig.run_for(500_000)
    assert bench.a.inputs["volt"] == 9.0
    bench.rig.run_for(500_000)
    assert bench.a.inputs["volt"] == 2.0
    bench.driver.release("a/volt")
    bench.a.inputs.set("volt", 9.0)
    bench.rig.run_for(5_000_000)
    assert bench.a.inputs["volt"] == 9.0


def test_a_lag_goes_as_the_first_order_says() -> None:
    bench = SignalBench.of('"a/volt" = {lag = "50", tau = "2s", start = 20}')
    for _ in range(8):
        bench.rig.run_for(500_000)
        wanted = 50 - 30 * exp(-bench.rig.now_us / 2e6)
        assert isclose(bench.a.inputs["volt"], wanted, rel_tol=1e-12)
    bench.rig.run_for(100_000_000)
    assert (bench.a.inputs["volt"], bench.driver.due_us) == (50.0, NEVER)


def test_a_lag_begins_where_its_source_is() -> None:
    bench = SignalBench.of(
        """
        "a/volt" = {lag = "inner", tau = "1s"}
        inner = {lag = "7 + b.volt", tau = "1s"}
        "b/count" = {formula = "a.volt"}
        """
    )
    assert (bench.a.inputs["volt"], bench.b.inputs["count"]) == (7.0, 7)
    assert bench.driver.problems == {}


def test_an_integral_is_a_sum_between_its_limits() -> None:
    bench = SignalBench.of(
        'used = {integral = "2 if t < 10 else -1", max = 15}\n"a/volt" = {formula = "used"}'
    )
    bench.rig.run_for(5_000_000)
    assert isclose(bench.a.inputs["volt"], 10.0)
    bench.rig.run_for(7_000_000)
    assert isclose(bench.a.inputs["volt"], 13.0)  # from 15 on down, 2 s long


def test_every_holds_a_value() -> None:
    bench = SignalBench.of(
        """
        "a/volt" = {ramp = [0, 100], over = "100s", every = "1s", from = "500ms"}
        "b/volt" = {formula = "t", every = "2s"}
        """
    )
    bench.rig.run_for(3_400_000)
    assert (bench.a.inputs["volt"], bench.b.inputs["volt"]) == (2.0, 2.0)
    assert len(bench.a.seen) == 3
    assert bench.a.seen[-1][0] == 2_510_000


def test_limits_and_steps() -> None:
    bench = SignalBench.of(
        """
        "a/volt" = {ramp = [0, 1], over = "1s", step = 0.1, max = 0.75}
        "b/volt" = {ramp = [0, 10], over = "1s", step = 4}
        """
    )
    seen = []
    for _ in range(10):
        bench.rig.run_for(100_000)
        seen.append((bench.a.inputs["volt"], bench.b.inputs["volt"]))
    assert [volt for volt, _ in seen] == [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.75, 0.75, 0.75]
    assert [volt for _, volt in seen] == [0.0, 0.0, 4.0, 4.0, 4.0, 8.0, 8.0, 8.0, 8.0, 8.0]


def test_noise_is_that_of_its_seed_and_name() -> None:
    toml = """
    "a/volt" = {noise = 0.5, mean = 12.0}
    "b/volt" = {noise = 0.5, mean = 12.0}
    x = {noise = [-3, 3], seed = 4}
    "b/count" = {formula = "x"}
    """
    first, same, other = (SignalBench.of(toml, seed=seed) for seed in (1, 1, 2))
    for bench in (first, same, other):
        bench.rig.run_for(20_000_000)
    assert first.seen == same.seen
    assert first.a.seen != other.a.seen
    assert [seen[2] for seen in first.b.seen] == [seen[2] for seen in other.b.seen]
    volts = [float(str(seen[1])) for seen in first.a.seen]
    assert len(volts) == 2_000
    assert abs(sum(volts) / len(volts) - 12) < 0.05
    assert abs(sum((volt - 12) ** 2 for volt in volts) / len(volts) - 0.25) < 0.03
    assert {seen[2] for seen in first.b.seen} == {-3, -2, -1, 0, 1, 2, 3}
    assert [seen[1] for seen in first.b.seen[:50]] != volts[:50]


def test_a_text_is_no_number() -> None:
    bench = SignalBench.of('x = {formula = "a.state + 1"}\ny = "words"\nz = {formula = "y"}')
    assert isnan(float(bench.driver.value("x")))
    assert isnan(float(bench.driver.value("z")))
    assert bench.driver.names == ("x", "y", "z")


@pytest.mark.parametrize(
    ("toml", "mistakes"),
    [
        ('x = {formula = "x"}', ["x: a circle: x -> x"]),
        (
            'p = 1\n"a/volt" = {formula = "y"}\ny = {formula = "z"}\nz = {formula = "a.volt + p"}',
            ["a/volt: a circle: a/volt -> y -> z -> a/volt"],
        ),
        (
            'pi = 3\nt = {formula = "t"}',
            [
                f"{name}: no signal can be called so: in formulas {name} is something else"
                for name in ("pi", "t")
            ],
        ),
        (
            '"c/volt" = 1\n"a/amps" = 2\n"a/count" = 1.5',
            [
                "c/volt: no device c; known: a, b",
                "a/amps: no input amps; known: volt, count, key, label",
                "a/count: count takes a whole number, not 1.5",
            ],
        ),
        (
            '"a/volt" = {ramp = [12, 900], over = "1s"}\n"a/label" = {sine = [0, 1], period="1s"}',
            [
                "a/volt: it reaches 900, and volt takes -100..100 V",
                "a/label: label takes a text, and only a text that stays drives it",
            ],
        ),
        (
            'x = {lag = "gone + a.zzz", tau = "1s"}',
            [
                f"x: no signal, input or output {name}; known: x, a.mean, a.state, a.volt,"
                " a.count, a.key, a.label, b.mean, b.state, b.volt, b.count, b.key, b.label"
                for name in ("gone", "a.zzz")
            ],
        ),
    ],
)
def test_all_mistakes_on_a_bench_are_found_at_once(toml: str, mistakes: list[str]) -> None:
    signals = signals_of(tomllib.loads(toml))
    found = check_signals(signals, {"a": Meter(10_000), "b": Meter(4_000)})
    assert [str(mistake) for mistake in found] == mistakes
    with pytest.raises(ValueError, match="; " if len(mistakes) > 1 else "circle"):
        SignalBench(signals)


def test_a_row_of_signals_has_its_limit() -> None:
    rows = {f"s{n}": {"formula": f"s{n + 1}"} for n in range(2_000)}
    found = check_signals(signals_of({**rows, "s2000": 1}), {})
    assert [str(mistake) for mistake in found] == ["s0: it needs more than 100 others in a row"]


def test_huge_values_are_as_far_as_an_input_goes() -> None:
    bench = SignalBench.of(
        """
        "a/volt" = {formula = "1e308 * 10 * t", step = 1e-12}
        "b/volt" = {formula = "x * 1e300", step = 0.1}
        x = {integral = "1e308"}
        """
    )
    bench.rig.run_for(1_000_000)
    assert (bench.a.inputs["volt"], bench.b.inputs["volt"]) == (100, 100)


def test_what_is_within_its_limits_may_reach_further() -> None:
    bench = SignalBench.of('"a/volt" = {ramp = [12, 900], over = "1s", max = 99}')
    bench.rig.run_for(1_000_000)
    assert bench.a.inputs["volt"] == 99


def test_memory_breaks_a_circle() -> None:
    bench = SignalBench.of(
        """
        "a/volt" = {formula = "speed"}
        speed = {integral = "10 - 2 * speed"}
        """
    )
    bench.rig.run_for(20_000_000)
    assert isclose(bench.a.inputs["volt"], 5.0, rel_tol=1e-9)


def test_a_driver_without_devices() -> None:
    driver = SignalDriver(signals_of({"x": {"ramp": [0, 4], "over": "4s"}}), {})
    Rig(couplings=[driver]).run_for(3_000_000)
    assert driver.value("x") == 3.0
