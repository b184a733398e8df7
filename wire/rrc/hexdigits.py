"""Numbers as the RRC writes them: `2hex` and `1hex`, negative ones in two's complement."""

from __future__ import annotations

from itertools import product
from typing import Final

from tickrig.wire.errors import FieldError

UPPER_DIGITS: Final = tuple(b"%X" % n for n in range(16))
HEX_DIGITS: Final = frozenset(bytes([code]) for code in b"0123456789ABCDEFabcdef")


def all_digits(width: int) -> list[bytes]:
    """Return all numbers of so many hex digits, in every mixture of cases."""
    return [b"".join(digits) for digits in product(sorted(HEX_DIGITS), repeat=width)]


def read_hex(digits: bytes) -> int:
    """Read one or two hex digits of either case.

    Raises:
        FieldError: a character that is not a hex digit.
    """
    if not all(digits[n : n + 1] in HEX_DIGITS for n in range(len(digits))):
        raise FieldError(f"{digits!r} is not hexadecimal")
    return int(digits, 16)


def read_signed(digits: bytes) -> int:
    """Read two hex digits as an 8-bit two's complement number.

    >>> read_signed(b"9c"), read_signed(b"64")
    (-100, 100)
    """
    value = read_hex(digits)
    return value - 0x100 if value >= 0x80 else value
