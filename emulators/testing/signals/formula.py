"""Formulas over signals: their parts, and their values.

>>> Formula("t + load", _Call("+", (_Name("t"), _Name("load"))), ("load",), True).value(
...     {"t": 1.5, "load": 3.0}
... )
4.5

Arithmetic over other signals, as text: it is parsed into a tree, and no code is executed.

>>> parse_formula("12.6 - 0.1 * left.current_a").names
('left.current_a',)
>>> parse_formula("clip(2 * t, 0, 5) if load > 1 else 0").value({"t": 1.5, "load": 3})
3.0
>>> parse_formula("__import__('os')")
Traceback (most recent call last):
    ...
ValueError: no function __import__; known: abs, sqrt, sin, cos, exp, floor, min, max, clip
"""

from __future__ import annotations

import ast
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from math import copysign, cos, exp, floor, inf, isfinite, nan, pi, sin, sqrt
from typing import Final

from tickrig.device.twin import Immutable
from tickrig.host.text.names import near

TIME: Final = "t"


@dataclass(frozen=True, slots=True)
class _FormulaNumber(Immutable):
    """A number."""

    number: float


@dataclass(frozen=True, slots=True)
class _Name(Immutable):
    """The value of another signal, or the time."""

    name: str


@dataclass(frozen=True, slots=True)
class _Call(Immutable):
    """A function or an operator with its arguments."""

    function: str
    terms: tuple[_Term, ...]


_Term = _FormulaNumber | _Name | _Call


@dataclass(frozen=True, slots=True)
class Formula(Immutable):
    """A parsed formula that computes a signal from other signals and the time.

    Attributes:
        text: the formula as written.
        term: the parsed formula.
        names: names of the signals in the formula, in order, without the time `t`.
        timed: whether the formula contains the time `t`.
    """

    text: str
    term: _Term
    names: tuple[str, ...]
    timed: bool

    def value(self, values: Mapping[str, float]) -> float:
        """Return the value of the formula, which is `nan` or `inf` (IEEE 754) if it is not finite.

        Args:
            values: values of the names in the formula, and of the time `t` in seconds.
        """
        return _value(self.term, values)


def _value(term: _Term, values: Mapping[str, float]) -> float:
    match term:
        case _FormulaNumber(number):
            return number
        case _Name(name):
            return values[name]
        case _Call(function, terms):
            try:
                return _FUNCTIONS[function][0](*(_value(each, values) for each in terms))
            except ValueError:
                return nan
            except OverflowError:
                return inf


def _divided(x: float, y: float) -> float:
    if y:
        return x / y
    return copysign(inf, x) * copysign(1, y) if x and x == x else nan  # noqa: PLR0124 - no nan


def _clipped(x: float, low: float, high: float) -> float:
    return min(max(x, low), high)


_MANY: Final = 99

_FUNCTIONS: Final[dict[str, tuple[Callable[..., float], int, int]]] = {
    "abs": (abs, 1, 1),
    "sqrt": (sqrt, 1, 1),
    "sin": (sin, 1, 1),
    "cos": (cos, 1, 1),
    "exp": (exp, 1, 1),
    "floor": (lambda x: float(floor(x)) if isfinite(x) else x, 1, 1),
    "min": (min, 2, _MANY),
    "max": (max, 2, _MANY),
    "clip": (_clipped, 3, 3),
    "+": (lambda x, y: x + y, 2, 2),
    "-": (lambda x, y: x - y, 2, 2),
    "*": (lambda x, y: x * y, 2, 2),
    "/": (_divided, 2, 2),
    "%": (lambda x, y: x % y if y else nan, 2, 2),
    "negative": (lambda x: -x, 1, 1),
    "positive": (lambda x: x, 1, 1),
    "<": (lambda x, y: float(x < y), 2, 2),
    "<=": (lambda x, y: float(x <= y), 2, 2),
    ">": (lambda x, y: float(x > y), 2, 2),
    ">=": (lambda x, y: float(x >= y), 2, 2),
    "==": (lambda x, y: float(x == y), 2, 2),
    "!=": (lambda x, y: float(x != y), 2, 2),
    "and": (lambda *x: float(all(x)), 2, _MANY),
    "or": (lambda *x: float(any(x)), 2, _MANY),
    "not": (lambda x: float(not x), 1, 1),
    "if": (lambda condition, x, y: x if condition else y, 3, 3),
}
"""The functions, with the least and the greatest number of their arguments."""


_LONGEST: Final = 2_000
_DEEPEST: Final = 100

CALLED: Final = ("abs", "sqrt", "sin", "cos", "exp", "floor", "min", "max", "clip")
"""Functions that are written as NAME(...)."""

_OPERATORS: Final[dict[type[ast.AST], str]] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.Mod: "%",
    ast.USub: "negative",
    ast.UAdd: "positive",
    ast.Not: "not",
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
    ast.And: "and",
    ast.Or: "or",
}


def parse_formula(text: str) -> Formula:
    """Parse the text of a formula that computes a signal.

    Raises:
        ValueError: the text is not a formula, is too long, or has an unknown name or function.
    """
    if len(text) > _LONGEST:
        raise ValueError(f"a formula of {len(text)} characters; at most {_LONGEST} are taken")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tree = ast.parse(" ".join(text.split()), mode="eval")
        return _formula(text, _read(tree.body, _DEEPEST))
    except SyntaxError as error:
        raise ValueError(f"{text!r:.60} is no formula: {error.msg}") from None
    except (MemoryError, RecursionError):
        raise ValueError(f"the formula is nested more than {_DEEPEST} deep") from None


def _formula(text: str, term: _Term) -> Formula:
    names = tuple(dict.fromkeys(_names(term)))
    return Formula(text, term, tuple(name for name in names if name != TIME), TIME in names)


def _names(term: _Term) -> Iterator[str]:
    if isinstance(term, _Name):
        yield term.name
    elif isinstance(term, _Call):
        for each in term.terms:
            yield from _names(each)


def _read(node: ast.expr, deep: int) -> _Term:
    if not deep:
        raise ValueError(f"the formula is nested more than {_DEEPEST} deep")
    if isinstance(node, ast.Constant):
        return _constant(node)
    if isinstance(node, ast.Name | ast.Attribute):
        name = _dotted(node)
        return _FormulaNumber(pi) if name == "pi" else _Name(name)
    if isinstance(node, ast.Compare):
        return _compared(node, deep)
    function, operands = _call(node)
    return _Call(function, tuple(_read(operand, deep - 1) for operand in operands))


def _call(node: ast.expr) -> tuple[str, list[ast.expr]]:
    """Return a function or the function of an operator, and its arguments."""
    match node:
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
            return _OPERATORS[type(op)], [left, right]
        case ast.UnaryOp(op=op, operand=operand) if type(op) in _OPERATORS:
            return _OPERATORS[type(op)], [operand]
        case ast.BoolOp(op=op, values=operands):
            return _OPERATORS[type(op)], operands
        case ast.IfExp(test=test, body=body, orelse=otherwise):
            return "if", [test, body, otherwise]
        case ast.Call(func=ast.Name(id=name), args=operands, keywords=[]):
            return _function(name, len(operands)), operands
    raise _unknown(node)


def _compared(node: ast.Compare, deep: int) -> _Term:
    """Return `0 < x < 5` as `0 < x and x < 5`."""
    if not all(type(op) in _OPERATORS for op in node.ops):
        raise _unknown(node)
    terms = [_read(each, deep - 1) for each in (node.left, *node.comparators)]
    calls = [
        _Call(_OPERATORS[type(op)], (left, right))
        for op, left, right in zip(node.ops, terms, terms[1:], strict=False)
    ]
    return calls[0] if len(calls) == 1 else _Call("and", tuple(calls))


def _constant(node: ast.Constant) -> _Term:
    """Return a number, or the signal whose name is in quotes."""
    if isinstance(node.value, str):
        return _Name(node.value)
    if isinstance(node.value, bool) or not isinstance(node.value, int | float):
        raise _unknown(node)
    try:
        if isfinite(node.value):
            return _FormulaNumber(float(node.value))
    except OverflowError:
        pass
    raise ValueError("a number in the formula is too large")


def _dotted(node: ast.expr) -> str:
    match node:
        case ast.Name(id=name):
            return name
        case ast.Attribute(value=value, attr=name):
            return f"{_dotted(value)}.{name}"
    raise _unknown(node)


def _function(name: str, count: int) -> str:
    if name not in CALLED:
        raise ValueError(f"no function {name}; {near(name, CALLED)}")
    _, least, most = _FUNCTIONS[name]
    if not least <= count <= most:
        wanted = f"{least} or more" if most == _MANY else str(least)
        raise ValueError(f"{name} takes {wanted} values, not {count}")
    return name


def _unknown(node: ast.expr) -> ValueError:
    return ValueError(
        f"{ast.unparse(node)!r:.60} is not known in formulas; known: + - * / % < <= > >= == !="
        f" and, or, not, x if condition else y, t, pi, {', '.join(CALLED)}"
    )
