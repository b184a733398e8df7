"""Formulas: what they come to, what is refused, and that nothing raises."""

from __future__ import annotations

from math import cos, exp, floor, inf, isnan, nan, pi, sin, sqrt
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tickrig.emulators.testing.signals.formula import parse_formula

VALUES = {"t": 1.5, "x": 3.0, "y": -2.0, "left.current_a": 0.5, "5/0x6064": 4096.0, "z": 0.0}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1 + 2 * 3 - 4 / 8", 6.5),
        ("-x + +y", -5.0),
        ("(x - 1) * (y + 1)", -2.0),
        ("t * 2", 3.0),
        ("1e3 + 0x10", 1016.0),
        ("-7 % 5", 3.0),
        ("x > 2", 1.0),
        ("x < 2", 0.0),
        ("1 <= x <= 3", 1.0),
        ("1 < x < 3", 0.0),
        ("x == 3", 1.0),
        ("x != 3 or y >= -2", 1.0),
        ("not x and y", 0.0),
        ("x if y < 0 else 9", 3.0),
        ("abs(y) + sqrt(16) + floor(-0.5)", 5.0),
        ("sin(pi / 6)", sin(pi / 6)),
        ("cos(x) * exp(y)", cos(3) * exp(-2)),
        ("min(x, y, 1) + max(x, y)", 1.0),
        ("clip(x, 0, 2) + clip(y, 0, 2)", 2.0),
        ("left.current_a * 4", 2.0),
        ("'5/0x6064' / 4096", 1.0),
        ("\n  x +\n  y\n", 1.0),
        ("1 / z", inf),
        ("-1 / z", -inf),
        ("exp(1000)", inf),
        ("floor(1 / z)", inf),
        ("min(1 / z, 5)", 5.0),
    ],
)
def test_the_value_of_a_formula(text: str, value: float) -> None:
    assert parse_formula(text).value(VALUES) == value


@pytest.mark.parametrize("text", ["sqrt(y)", "z / z", "x % z", "sin(1 / z)", "1/z - 1/z"])
def test_where_it_has_no_value(text: str) -> None:
    assert isnan(parse_formula(text).value(VALUES))


def test_names_are_told_in_order_and_time_apart() -> None:
    formula = parse_formula("t * 'a/b' + c.d - x * 'a/b'")
    assert (formula.names, formula.timed) == (("a/b", "c.d", "x"), True)
    assert not parse_formula("x").timed


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "'' is no formula: invalid syntax"),
        ("1 +", "'1 +' is no formula: invalid syntax"),
        ("x y", "'x y' is no formula: invalid syntax"),
        ("a) + (b", "'a) + (b' is no formula: unmatched ')'"),
        ("(" * 500, f"'{'(' * 59} is no formula: too many nested parentheses"),
        ("open('/etc/passwd')", "no function open; known: abs, sqrt,"),
        ("sin(1, 2)", "sin takes 1 values, not 2"),
        ("max(1)", "max takes 2 or more values, not 1"),
        ("x.real()", "'x.real()' is not known in formulas; known: + - *"),
        ("x ** 2", "'x ** 2' is not known in formulas"),
        ("x[0]", "'x[0]' is not known in formulas"),
        ("[1, 2]", "'[1, 2]' is not known in formulas"),
        ("(lambda: 1)()", "'(lambda: 1)()' is not known in formulas"),
        ("x is y", "'x is y' is not known in formulas"),
        ("True", "'True' is not known in formulas"),
        ("1j", "'1j' is not known in formulas"),
        ("b'x'", "\"b'x'\" is not known in formulas"),
        ("f'{x}'", "\"f'{x}'\" is not known in formulas"),
        ("(x := 1)", "'(x := 1)' is not known in formulas"),
        ("~1", "'~1' is not known in formulas"),
        ("max(*x)", "max takes 2 or more values, not 1"),
        ("clip(x, low=1)", "'clip(x, low=1)' is not known in formulas"),
        ("1().x", "'1()' is not known in formulas"),
        ("1e999", "a number in the formula is too large"),
        ("9" * 400, "a number in the formula is too large"),
        ("-" * 150 + "1", "the formula is nested more than 100 deep"),
        ("+".join("x" * 150), "the formula is nested more than 100 deep"),
        ("x" * 2_001, "a formula of 2001 characters; at most 2000 are taken"),
    ],
)
def test_what_is_refused(text: str, reason: str) -> None:
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - its text is compared
        parse_formula(text)
    assert str(caught.value).startswith(reason)
    assert "\n" not in str(caught.value)


WORDS = st.sampled_from(
    [*"txyz0123456789+-*/%<>=()., '\"[]", "sin", "max", " if ", " else ", " and ", "not ", "lambda"]
)


@settings(max_examples=500)
@given(st.text(max_size=40) | st.lists(WORDS, max_size=30).map("".join))
@example("\x00")
@example("\ud800")
@example("x\\")
@example("'\\d'")
@example("5if x else y")
def test_any_text_is_a_formula_or_a_line_why_not(text: str) -> None:
    try:
        formula = parse_formula(text)
    except ValueError as error:
        assert "\n" not in str(error)  # noqa: PT017 - one line
        return
    formula.value(dict.fromkeys((*formula.names, "t"), 1.0))


NUMBERS = st.floats() | st.sampled_from([0.0, -0.0, inf, -inf, nan, 1e308])


TWO = ("({} + {})", "({} - {})", "({} * {})", "({} / {})", "({} % {})", "({} < {})")
MORE = ("clip({}, {}, x)", "({} if {} else y)")
ONE = ("abs({})", "sqrt({})", "sin({})", "exp({})", "floor({})")


def trees(children: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    pairs = st.tuples(st.sampled_from((*TWO, *MORE)), children, children)
    single = st.tuples(st.sampled_from(ONE), children)
    return (pairs | single).map(lambda parts: parts[0].format(*parts[1:]))


@settings(max_examples=300)
@given(
    st.recursive(st.sampled_from(["x", "y", "t", "2", "0.5"]), trees, max_leaves=12),
    NUMBERS,
    NUMBERS,
)
def test_no_value_makes_it_raise(text: str, x: float, y: float) -> None:
    assert isinstance(parse_formula(text).value({"x": x, "y": y, "t": 1.0}), float)


@settings(max_examples=200)
@given(
    st.recursive(st.sampled_from(["x", "y", "2"]), trees, max_leaves=8),
    st.floats(0.5, 3),
    st.floats(0.5, 3),
)
def test_it_is_what_python_computes(text: str, x: float, y: float) -> None:
    known: dict[str, Any] = {"abs": abs, "sqrt": sqrt, "sin": sin, "exp": exp, "floor": floor}
    known["clip"] = lambda value, low, high: min(max(value, low), high)
    try:
        wanted = float(eval(text, {"__builtins__": {}}, {**known, "x": x, "y": y}))
    except (ArithmeticError, ValueError):
        return
    assert parse_formula(text).value({"x": x, "y": y, "t": 0.0}) == wanted
