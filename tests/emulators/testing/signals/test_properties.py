"""What all signals keep, whatever they are: the ticks that are run cannot be seen in them."""

from __future__ import annotations

import hashlib
import os
import pickle
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from tests.emulators.testing.signals.signal_bench import Meter, SignalBench, signals_of
from tests.soak import examples
from tickrig.emulators.testing.signals.driver import check_signals
from tickrig.emulators.testing.signals.sources import SignalMistake, SignalSpec
from tickrig.emulators.testing.signals.spec_reader import FORMS, read_signal_spec

ROOT = Path(__file__).parents[4]
TARGETS = ("a/volt", "a/count", "a/key", "b/volt", "b/count")
FREE = ("p", "q", "r")
RANGES = {"a/volt": 90, "b/volt": 90, "a/count": 40, "b/count": 40, "a/key": 1}

times = st.sampled_from(["300us", "4ms", "10ms", "13ms", "170ms", "1s"])
steps = st.fixed_dictionaries(
    {}, optional={"every": times, "step": st.sampled_from([0.1, 0.25, 7]), "from": times}
)


def within(limit: int) -> st.SearchStrategy[float]:
    low = 0 if limit == 1 else -limit
    return st.floats(low, limit) | st.integers(low, limit)


def of_time(limit: int) -> st.SearchStrategy[dict[str, Any]]:
    number = within(limit)
    pair = st.lists(number, min_size=2, max_size=2)
    points = st.lists(st.tuples(st.floats(0, 2), number).map(list), min_size=1, max_size=4)
    flags = st.booleans()
    return st.one_of(
        st.fixed_dictionaries({"ramp": pair, "over": times}, optional={"repeat": flags}),
        *(
            st.fixed_dictionaries({shape: pair, "period": times})
            for shape in ("sine", "square", "triangle")
        ),
        st.fixed_dictionaries({"noise": pair | st.floats(0, limit / 9)}),
        st.fixed_dictionaries(
            {"table": points.map(sorted)},
            optional={"repeat": flags, "interpolation": st.sampled_from(["linear", "hold"])},
        ),
    ).flatmap(lambda table: steps.map(lambda more: {**table, **more}))


TERMS = ("t", "p", "q", "r", "a.mean", "b.mean", "a.volt", "b.count", "2", "0.5")
FORMS_OF_TWO = ("{} + {}", "{} - {}", "{} * {} / 9", "max({}, {})", "{} / {}", "{} < {}", "{} % {}")

formulas = st.tuples(
    st.sampled_from(FORMS_OF_TWO), st.sampled_from(TERMS), st.sampled_from(TERMS)
).map(lambda parts: parts[0].format(*parts[1:]))


def of_others() -> st.SearchStrategy[dict[str, Any]]:
    return st.one_of(
        st.fixed_dictionaries({"formula": formulas}),
        st.fixed_dictionaries({"lag": formulas, "tau": times}, optional={"start": within(9)}),
        st.fixed_dictionaries({"integral": formulas}),
    ).flatmap(
        lambda table: steps.map(
            lambda more: {**table, **{k: v for k, v in more.items() if k != "from"}}
        )
    )


tables = st.fixed_dictionaries(
    {name: of_time(9) | of_others() for name in FREE},
    optional={name: of_time(RANGES[name]) | of_others() for name in TARGETS},
)


def usable(tables: dict[str, Any]) -> dict[str, SignalSpec]:
    """Read them, and leave formulas away that are in a circle."""
    signals = signals_of(tables)
    while mistakes := check_signals(signals, {"a": Meter(10_000), "b": Meter(4_000)}):
        signals[str(mistakes[0].keys[0])] = signals_of({"x": 1})["x"]
    return signals


@settings(max_examples=examples(25), deadline=None)
@given(tables, st.lists(st.sampled_from([1, 700, 4_000, 9_999, 250_000]), max_size=8))
def test_dense_and_sparse_ticks_and_pieces_of_time_make_no_difference(
    tables: dict[str, Any], pieces_us: list[int]
) -> None:
    signals = usable(tables)
    sparse, dense = SignalBench(signals, 3), SignalBench(signals, 3, dense=True)
    pieces = SignalBench(signals, 3)
    for piece_us in pieces_us:
        pieces.rig.run_for(piece_us)
        pieces.driver.value("p")
    for bench in (sparse, dense, pieces):
        bench.rig.run_to(1_500_000)
    assert sparse.seen == dense.seen == pieces.seen
    values = [[repr(bench.driver.value(name)) for name in signals] for bench in (sparse, dense)]
    assert values[0] == values[1]


@settings(max_examples=examples(15), deadline=None)
@given(tables, st.integers(0, 1_000_000))
def test_a_fork_goes_on_as_the_original(tables: dict[str, Any], at_us: int) -> None:
    signals = usable(tables)
    alone, original = SignalBench(signals, 3), SignalBench(signals, 3)
    alone.rig.run_to(1_200_000)
    original.rig.run_to(at_us)
    twin_rig, a, b = original.rig.fork(original.a, original.b)
    other_rig, other_a, _ = pickle.loads(pickle.dumps((original.rig, original.a, original.b)))
    other_a.inputs.set("volt", 1.0)
    other_rig.run_to(1_200_000)
    twin_rig.run_to(1_200_000)
    assert [*a.seen, *b.seen] == alone.seen
    original.rig.run_to(1_200_000)
    assert original.seen == alone.seen


TOML = """
"a/volt" = {noise = 2.0, mean = 5}
"a/count" = {formula = "10 * q + r * a.mean"}
p = {sine = [0, 3], period = "1.3s"}
q = {lag = "p * b.volt", tau = "200ms"}
r = {integral = "sin(t) - q / 20"}
"b/volt" = {formula = "clip(q, -9, 9)"}
"b/count" = {noise = [-40, 40], every = "30ms"}
"""


def run_of_noise() -> str:
    """Return the hash of what devices see."""
    bench = SignalBench(signals_of(tomllib.loads(TOML)), seed=5)
    bench.rig.run_for(3_000_000)
    return hashlib.sha256(repr(bench.seen).encode()).hexdigest()


def test_hash_seeds_make_no_difference() -> None:
    program = f"import {__name__} as module; print(module.run_of_noise())"
    said = {
        subprocess.run(
            [sys.executable, "-c", program],
            env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": f"{ROOT}:{ROOT / 'src'}"},
            capture_output=True,
            check=True,
            text=True,
        ).stdout.strip()
        for seed in ("1", "2")
    }
    assert said == {run_of_noise()}


json = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=6)
    | st.sampled_from(["1s", "10ms", "load", "t", "x.csv", "hold", [0, 1], [[0, 1]], 10**400]),
    lambda children: (
        st.lists(children, max_size=3) | st.dictionaries(st.text(max_size=6), children, max_size=3)
    ),
    max_leaves=6,
)
KEYS = sorted({key for form in FORMS.values() for key in form.keys})


@settings(max_examples=examples(150), deadline=None)
@given(
    json
    | st.sampled_from(sorted(FORMS)).flatmap(
        lambda name: st.dictionaries(
            st.sampled_from([name, *FORMS[name].keys, *KEYS]), json, max_size=5
        ).flatmap(lambda table: json.map(lambda value: {name: value, **table}))
    )
)
def test_anything_is_a_signal_or_has_mistakes_in_a_line_each(value: Any) -> None:
    found = read_signal_spec(value, ("x", 0), Path("/nowhere"))
    if isinstance(found, SignalSpec):
        bench = SignalBench({"p": found}) if not check_signals({"p": found}, {}) else None
        if bench is not None:
            bench.rig.run_for(20_000)
        return
    assert found
    for mistake in found:
        assert isinstance(mistake, SignalMistake)
        assert mistake.keys[:2] == ("x", 0)
        assert mistake.reason
        assert "\n" not in str(mistake.reason)
