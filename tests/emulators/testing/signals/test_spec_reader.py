"""What TOML gives becomes a signal, or all its mistakes."""

from __future__ import annotations

import tomllib
from math import exp, inf, isclose
from pathlib import Path

import pytest

from tickrig.emulators.testing.signals.sources import (
    Constant,
    Lag,
    Noise,
    RampSource,
    SignalMistake,
    SignalSpec,
    ValueTable,
    Wave,
)
from tickrig.emulators.testing.signals.spec_reader import read_signal_spec

S = 1_000_000


def read(toml: str, folder: Path | None = None) -> SignalSpec | list[SignalMistake]:
    return read_signal_spec(tomllib.loads(f"x = {toml}")["x"], ("x",), folder)


def spec(toml: str, folder: Path | None = None) -> SignalSpec:
    found = read(toml, folder)
    assert isinstance(found, SignalSpec), found
    return found


@pytest.mark.parametrize(
    ("toml", "source"),
    [
        ("12.5", Constant(12.5)),
        ("7", Constant(7)),
        ("true", Constant(1)),
        ('"ready"', Constant("ready")),
        ('{ramp = [12.0, 9.5], over = "10s"}', RampSource(12.0, 9.5, 10 * S)),
        ('{ramp = [0, 360], over = "2s", repeat = true}', RampSource(0, 360, 2 * S, repeat=True)),
        ('{sine = [11, 13], period = "2s"}', Wave("sine", 11, 13, 2 * S)),
        ('{sine = [11, 13], period = "2s", phase_deg = 90}', Wave("sine", 11, 13, 2 * S, S // 2)),
        ('{triangle = [0, 1], period = "8ms"}', Wave("triangle", 0, 1, 8_000)),
        ('{square = [0, 1], period = "1s", duty = 0.25}', Wave("square", 0, 1, S, 0, 0.25)),
        ("{noise = 0.1, mean = 12.0}", Noise(12.0, 0.1, False, 10_000)),
        ('{noise = [-1, 1], every = "1ms", seed = 3}', Noise(-1, 1, True, 1_000, 3)),
        ('{table = [[0, 12.0], ["5s", 9.5]]}', ValueTable((0, 5 * S), (12.0, 9.5))),
        (
            '{table = [[0.5, 1]], interpolation = "hold", repeat = true}',
            ValueTable((S // 2,), (1,), False, True),
        ),
    ],
)
def test_a_value_is_read(toml: str, source: object) -> None:
    assert spec(toml).source == source


def test_keys_of_every_table() -> None:
    found = spec('{ramp = [0, 1], over = "1s", from = "2s", every = "20ms", min = 0.1, step = 0.2}')
    assert (found.from_us, found.every_us, found.low, found.step) == (2 * S, 20_000, 0.1, 0.2)


def test_formulas_and_what_holds_state() -> None:
    lag = spec('{lag = "load * 2", tau = "30s", start = 20}')
    assert isinstance(lag.source, Lag)
    assert (lag.source.formula.names, lag.source.start, lag.every_us) == (("load",), 20, 10_000)
    assert isclose(lag.source.gain(30 * S), 1 - exp(-1))
    assert spec('{formula = "t + 1", every = "1s"}').every_us == S
    assert spec('{integral = "left.current_a / 3600"}').every_us == 10_000


@pytest.mark.parametrize(
    ("toml", "mistakes"),
    [
        ("nan", ["x: it takes a number, as 12.5, not nan"]),
        (f"1{'0' * 400}", [f"x: it takes a number, as 12.5, not 1{'0' * 59}"]),
        (
            "[1, 2]",
            [
                "x: it is a number, a text, or a table with one of ramp, sine, triangle, square,"
                " noise, table, formula, lag, integral; not [1, 2]"
            ],
        ),
        (
            '{ramp = [0, 1], sine = [0, 1], over = "1s"}',
            [
                "x: it is a number, a text, or a table with one of ramp, sine, triangle, square,"
                " noise, table, formula, lag, integral; not ramp and sine"
            ],
        ),
        ("{ramp = [0, 1]}", ["x.over: it is missing"]),
        (
            '{ramp = [0, "1"], over = 10, from = "soon", step = 0}',
            [
                "x.ramp: it takes a number, as 12.5, not '1'",
                'x.over: it takes a time with its unit, as "1.5s" or "20ms", not 10',
                "x.from: 'soon' is not a time: write 1.5s, 200ms or 250us",
                "x.step: it takes a number from 1e-12 on, as 0.01, not 0",
            ],
        ),
        (
            '{sine = [0, 1], period = "1us", duty = 0.5}',
            [
                "x.period: it takes a time from \"100us\" on, not '1us'",
                "x.duty: not a key of sine; known: period, phase_deg, from, every, min, max, step",
            ],
        ),
        (
            '{square = [0, 1], period = "1s", duty = 1}',
            ["x.duty: it takes a number between 0 and 1, as 0.25, not 1"],
        ),
        (
            "{noise = -1, seed = -1}",
            [
                "x.noise: it takes a standard deviation from 0 on, not -1",
                "x.seed: it takes a whole number from 0 on, not -1",
            ],
        ),
        (
            "{noise = [0, 1], mean = 3}",
            ["x.noise: mean belongs to gaussian noise, as {noise = 0.1, mean = 12.0}"],
        ),
        (
            '{ramp = [0, 1], over = "1s", min = 2, max = 1}',
            ["x.ramp: min 2 is above max 1"],
        ),
        (
            '{ramp = [0, 1], over = "1s", repeat = 3}',
            ["x.repeat: it takes true or false, not 3"],
        ),
        (
            '{formula = "t", from = "1s"}',
            ["x.from: not a key of formula; known: every, min, max, step"],
        ),
        ("{formula = [1]}", ['x.formula: it takes a formula, as "2 * load + 1", not [1]']),
        ('{lag = "load"}', ["x.tau: it is missing"]),
        (
            "{table = [[0, 1], [-1, 2]]}",
            ["x.table: -1 is no time from 0 on"],
        ),
        ("{table = [[2, 1], [1, 2]]}", ["x.table: 1 s comes after 2 s"]),
        (
            "{table = [[2, 1], 5]}",
            [
                'x.table: it is a list of times and values, as [[0, 12.0], ["5s", 9.5]],'
                " or the name of a file; 5 is no time and value"
            ],
        ),
        (
            "{table = []}",
            [
                'x.table: it is a list of times and values, as [[0, 12.0], ["5s", 9.5]],'
                " or the name of a file; not []"
            ],
        ),
        (
            '{table = [[0, 1]], interpolation = "cubic"}',
            ["x.table: interpolation is linear or hold, not 'cubic'"],
        ),
        (
            '{table = [[0, 1]], column = "v"}',
            ["x.table: column belongs to a table in a file"],
        ),
        ("{table = [[0, 1]], column = 1}", ["x.column: it takes a text, not 1"]),
    ],
)
def test_all_mistakes_are_found_at_once(toml: str, mistakes: list[str]) -> None:
    found = read(toml)
    assert isinstance(found, list)
    assert [str(mistake) for mistake in found] == mistakes


@pytest.mark.parametrize("limit", [{"max": -5}, {"min": 5}, {"min": -1, "max": -1}])
def test_a_limit_may_stand_alone(limit: dict[str, int]) -> None:
    found = read_signal_spec({"ramp": [0, 1], "over": "1s", **limit})
    assert isinstance(found, SignalSpec)
    assert (found.low, found.high) == (limit.get("min", -inf), limit.get("max", inf))
