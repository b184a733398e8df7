from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.emulators.record.comparison import (
    NumberRule,
    Pair,
    Said,
    Tolerance,
    compare,
    parse_number_rule,
)

STRICT = Tolerance(20_000)
END_US = 10_000_000


def said(text: str) -> list[Said]:
    """Read `1.5 OK:a; 2 EV:b`, times in seconds."""
    words = [word.split(" ", 1) for word in text.split("; ") if word]
    return [Said(round(float(at) * 1e6), what) for at, what in words]


def differences(old: str, new: str, tolerance: Tolerance = STRICT) -> list[tuple[float, str]]:
    pairs = compare(said(old), said(new), END_US, tolerance)
    return [(pair.at_us / 1e6, pair.difference) for pair in pairs if pair.difference]


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("1 OK:a; 2 OK:b", "1.02 OK:a; 1.98 OK:b", []),
        ("1 OK:a", "1.03 OK:a", [(1.0, "the emulator is 30.0 ms later")]),
        ("1 OK:a; 2 OK:b", "1 OK:a; 1.5 OK:b", [(2.0, "the emulator is 500.0 ms earlier")]),
        ("1 OK:a; 2 OK:b", "1 OK:a", [(2.0, "the emulator does not send it")]),
        ("1 OK:a", "1 OK:a; 2 OK:b", [(2.0, "only the emulator sends it")]),
        ("1 OK:a", "1 OK:b", [(1.0, "the emulator answers differently")]),
        ("1 OK:a; 1.001 OK:b; 1.002 OK:c", "1 OK:a; 1.002 OK:c", [
            (1.001, "the emulator does not send it"),
        ]),
        ("1 OK:a; 1.002 OK:c", "1 OK:a; 1.001 OK:b; 1.002 OK:c", [
            (1.001, "only the emulator sends it"),
        ]),
        ("1 OK:a; 1.001 OK:b", "1 OK:b; 1.001 OK:a", [
            (1.0, "only the emulator sends it"), (1.001, "the emulator does not send it"),
        ]),
        ("1 OK:a; 1.001 EV:b", "1 EV:b; 1.001 OK:a", []),
        ("1 705#05; 2 705#05; 4 705#05", "1 705#05; 2 705#05; 3 705#05; 4 705#05", [
            (3.0, "only the emulator sends it"),
        ]),
        ("1 a", "1 a; 9.999 late", []),
        ("1 a", "0.01 early; 1 a", []),
        ("9 a", "9.024 a", []),
    ],
)  # fmt: skip
def test_differences_are_found(old: str, new: str, expected: list[tuple[float, str]]) -> None:
    assert differences(old, new) == expected


@pytest.mark.parametrize(
    ("rule", "old", "new", "same"),
    [
        ("EV:batt*=5", "EV:batt 98", "EV:batt 93", True),
        ("EV:batt*=5", "EV:batt 98", "EV:batt 92", False),
        ("EV:batt*=5", "EV:batt 98 a", "EV:batt 98 b", False),
        ("EV:batt*=5", "EV:bat 98", "EV:bat 97", False),
        ("T*=0.5", "T -1.5 20", "T -1.1 20.4", True),
        ("T*=10%", "T 200", "T 181", True),
        ("T*=10%", "T 200", "T 179", False),
        ("ST*[2:4]=2", "ST0F9", "ST119", True),
        ("ST*[2:4]=2", "ST0F9", "ST129", False),
        ("ST*[2:4]=2", "ST0F9", "ST0FA", False),
        ("ST*[2:4]=2", "STxyz", "STxyw", False),
        ("181#*[2:4]=50", "181#3702E803", "181#37020004", True),
        ("181#*[2:4]=50", "181#3702E803", "181#37030004", False),
        ("181#*[0:2]=3", "181#FFFF", "181#0200", True),
        ("181#*[4:8]=3", "181#FF", "181#FE", False),
    ],
)
def test_numbers_may_differ_by_a_rule(rule: str, old: str, new: str, same: bool) -> None:
    tolerance = Tolerance(0, [parse_number_rule(rule)])
    assert tolerance.same(old, new) is same


@pytest.mark.parametrize("text", ["", "a", "a=", "=5", "a=x", "a[2:2]=5", "a=-1", "a=5%%"])
def test_what_is_no_rule_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="is not PATTERN=TOLERANCE"):
        parse_number_rule(text)


def test_lines_are_left_out_or_independent_by_pattern() -> None:
    assert differences("1 v1.0; 2 a", "1 v2.0; 2 a", Tolerance(20_000, ignored=("v*",))) == []
    old, new = "1 temp 5; 1.001 ok", "1 ok; 1.001 temp 5"
    assert differences(old, new)
    assert differences(old, new, Tolerance(20_000, kinds=("temp*",))) == []


RUNS = st.lists(st.tuples(st.integers(0, END_US), st.sampled_from("abc")), max_size=20)


@given(RUNS, st.lists(st.integers(-9_000, 9_000), min_size=20, max_size=20))
def test_a_run_with_jitter_is_the_same(run: list[tuple[int, str]], jitter: list[int]) -> None:
    spread = [(at * 7 + n * 50_000, f"{what}{n}") for n, (at, what) in enumerate(sorted(run))]
    old = [Said(at, text) for at, text in spread]
    new = [Said(at + late, text) for (at, text), late in zip(spread, jitter, strict=False)]
    assert not [x for x in compare(old, new, 10**8, STRICT) if x.difference]


@given(RUNS, RUNS)
def test_nothing_is_lost_and_nothing_invented(
    old: list[tuple[int, str]], new: list[tuple[int, str]]
) -> None:
    then, now = [[Said(*each) for each in sorted(run)] for run in (old, new)]
    pairs: list[Pair] = compare(then, now, END_US, STRICT)
    assert [pair.recorded for pair in pairs if pair.recorded] == then
    shown = [pair.emulated for pair in pairs if pair.emulated]
    assert set(shown) <= set(now)
    assert all(said in shown for said in now if 20_000 <= said.at_us <= END_US - 25_000)


def test_a_field_of_a_rule_is_kept() -> None:
    assert parse_number_rule("a*[0:2]=5%") == NumberRule("a*", 5, True, (0, 2))
