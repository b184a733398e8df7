"""Arithmetic over other signals, as text: a syntax tree is looked at, nothing is executed.

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
from collections.abc import Iterator
from math import isfinite, pi
from typing import Final

from tickrig.emulators.testing.signals.formula import (
    FUNCTIONS,
    MANY,
    TIME,
    Call,
    Formula,
    Name,
    Number,
    Term,
)
from tickrig.host.text.names import near

LONGEST: Final = 2_000
DEEPEST: Final = 100

CALLED: Final = ("abs", "sqrt", "sin", "cos", "exp", "floor", "min", "max", "clip")
"""What is written as NAME(...)."""

OPERATORS: Final[dict[type[ast.AST], str]] = {
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
    """Read a formula.

    Raises:
        ValueError: it is none, it is too long, or something in it is not known here.
    """
    if len(text) > LONGEST:
        raise ValueError(f"a formula of {len(text)} characters; at most {LONGEST} are taken")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tree = ast.parse(" ".join(text.split()), mode="eval")
        return _formula(text, _read(tree.body, DEEPEST))
    except SyntaxError as error:
        raise ValueError(f"{text!r:.60} is no formula: {error.msg}") from None
    except (MemoryError, RecursionError):
        raise ValueError(f"the formula is nested more than {DEEPEST} deep") from None


def _formula(text: str, term: Term) -> Formula:
    names = tuple(dict.fromkeys(_names(term)))
    return Formula(text, term, tuple(name for name in names if name != TIME), TIME in names)


def _names(term: Term) -> Iterator[str]:
    if isinstance(term, Name):
        yield term.name
    elif isinstance(term, Call):
        for each in term.terms:
            yield from _names(each)


def _read(node: ast.expr, deep: int) -> Term:
    if not deep:
        raise ValueError(f"the formula is nested more than {DEEPEST} deep")
    if isinstance(node, ast.Constant):
        return _constant(node)
    if isinstance(node, ast.Name | ast.Attribute):
        name = _dotted(node)
        return Number(pi) if name == "pi" else Name(name)
    if isinstance(node, ast.Compare):
        return _compared(node, deep)
    function, operands = _call(node)
    return Call(function, tuple(_read(operand, deep - 1) for operand in operands))


def _call(node: ast.expr) -> tuple[str, list[ast.expr]]:
    """Return a function, or the operator that stands for it, and what it is of."""
    match node:
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
            return OPERATORS[type(op)], [left, right]
        case ast.UnaryOp(op=op, operand=operand) if type(op) in OPERATORS:
            return OPERATORS[type(op)], [operand]
        case ast.BoolOp(op=op, values=operands):
            return OPERATORS[type(op)], operands
        case ast.IfExp(test=test, body=body, orelse=otherwise):
            return "if", [test, body, otherwise]
        case ast.Call(func=ast.Name(id=name), args=operands, keywords=[]):
            return _function(name, len(operands)), operands
    raise _unknown(node)


def _compared(node: ast.Compare, deep: int) -> Term:
    """Return `0 < x < 5` as `0 < x and x < 5`."""
    if not all(type(op) in OPERATORS for op in node.ops):
        raise _unknown(node)
    terms = [_read(each, deep - 1) for each in (node.left, *node.comparators)]
    calls = [
        Call(OPERATORS[type(op)], (left, right))
        for op, left, right in zip(node.ops, terms, terms[1:], strict=False)
    ]
    return calls[0] if len(calls) == 1 else Call("and", tuple(calls))


def _constant(node: ast.Constant) -> Term:
    """Return a number, or the signal whose name is in quotes."""
    if isinstance(node.value, str):
        return Name(node.value)
    if isinstance(node.value, bool) or not isinstance(node.value, int | float):
        raise _unknown(node)
    try:
        if isfinite(node.value):
            return Number(float(node.value))
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
    _, least, most = FUNCTIONS[name]
    if not least <= count <= most:
        wanted = f"{least} or more" if most == MANY else str(least)
        raise ValueError(f"{name} takes {wanted} values, not {count}")
    return name


def _unknown(node: ast.expr) -> ValueError:
    return ValueError(
        f"{ast.unparse(node)!r:.60} is not known in formulas; known: + - * / % < <= > >= == !="
        f" and, or, not, x if condition else y, t, pi, {', '.join(CALLED)}"
    )
