"""Variables in the text of a sequence: `{id}`, `{0x600+id:3}`, `{speed:i16}`, `{n:d}`.

>>> fill_in("{0x600+id:3}#2B{index:u16}00", {"id": 3, "index": 0x6040})
'603#2B406000'
>>> fill_in("123#{-2:i16}{id}", {"id": 16}), fill_in("{id}.rpdo1", {"id": 16})
('123#FEFF10', '16.rpdo1')
"""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Mapping
from typing import Final

_FIELD: Final = re.compile(r"\{([^{}:]*)(?::([^{}]*))?\}")
_FORM: Final = re.compile(r"([1-8])|([ui])(8|16|24|32|40|48|56|64)|d")
_BINARY: Final[dict[type[ast.operator], Callable[[int, int], int]]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.BitOr: operator.or_,
    ast.BitAnd: operator.and_,
    ast.BitXor: operator.xor,
    ast.LShift: operator.lshift,
    ast.RShift: operator.rshift,
}
_MOST_BITS: Final = 64
_LONGEST: Final = 1_000
"""Characters of an expression."""


def fill_in(text: str, variables: Mapping[str, int]) -> str:
    """Replace each field by its number.

    In a frame, which has a `#`, that is two hex digits, else a decimal number. `:3` is three hex
    digits, `:i16` two bytes, the lowest first, `:d` a decimal number.

    Raises:
        ValueError: an unknown variable, no whole number, or one that does not fit.
    """
    usual = "2" if "#" in text else "d"
    return _FIELD.sub(lambda match: _written(match[1], match[2] or usual, variables), text)


def parse_variable(text: str) -> tuple[str, int]:
    """Read `NAME=NUMBER` of a command line; ValueError if it is not that."""
    name, _, number = text.partition("=")
    try:
        if not name.isidentifier():
            raise ValueError
        return name, int(number, 0)
    except ValueError:
        raise ValueError(f"{text!r} is not NAME=NUMBER, as id=3 or index=0x6040") from None


def evaluate(text: str, variables: Mapping[str, int]) -> int:
    """Return what whole numbers and variables come to.

    Raises:
        ValueError: something else, or more than 64 bits.
    """
    try:
        if len(text) > _LONGEST:
            raise SyntaxError
        number = _number(ast.parse(text.strip(), mode="eval").body, variables)
    except (SyntaxError, ZeroDivisionError, RecursionError, MemoryError):
        raise ValueError(f"{text!r:.60} is no whole number: write 3, 0x600+id or 2*n") from None
    return number


def _number(node: ast.expr, variables: Mapping[str, int]) -> int:
    match node:
        case ast.Constant(value=int() as value) if not isinstance(value, bool):
            number = value
        case ast.Name(id=name):
            if name not in variables:
                known = ", ".join(variables) or "none; give --var NAME=NUMBER"
                raise ValueError(f"no variable {name!r}; known: {known}")
            number = variables[name]
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            number = -_number(operand, variables)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
            number = _BINARY[type(op)](_number(left, variables), _count(right, op, variables))
        case _:
            text = ast.unparse(node)
            raise ValueError(f"{text!r:.60} is no whole number: write 3, 0x600+id or 2*n")
    if abs(number) >> _MOST_BITS:
        raise ValueError(f"{ast.unparse(node)!r} has more than {_MOST_BITS} bits")
    return number


def _count(node: ast.expr, op: ast.operator, variables: Mapping[str, int]) -> int:
    number = _number(node, variables)
    if isinstance(op, ast.LShift | ast.RShift) and not 0 <= number <= _MOST_BITS:
        raise ValueError(f"{ast.unparse(node)!r} is no shift; 0 to {_MOST_BITS} is")
    return number


def _written(text: str, form: str, variables: Mapping[str, int]) -> str:
    number = evaluate(text, variables)
    match = _FORM.fullmatch(form)
    if match is None:
        raise ValueError(f"{{{text}:{form:.20}}}: 1 to 8 hex digits, u8 to u64, i8 to i64, or d")
    digits, sign, bits = match.groups()
    if form == "d":
        return str(number)
    try:
        if digits:
            return _digits(number, int(digits))
        return number.to_bytes(int(bits) // 8, "little", signed=sign == "i").hex().upper()
    except OverflowError:
        raise ValueError(f"{text} = {number} does not fit {form!r}") from None


def _digits(number: int, digits: int) -> str:
    if not 0 <= number < 1 << 4 * digits:
        raise OverflowError
    return f"{number:0{digits}X}"
