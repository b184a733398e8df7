r"""Numbers as characters of 6 bits, and the sum behind each line (SCIP 2.0, data encoding).

>>> encode_number(1_234, 2), encode_number(5_432, 3), encode_number(16_000_000, 4)
(b'CB', b'1Dh', b'm2@0')
>>> with_sum(b"DMIN:20;", b"DMIN:20")
b'DMIN:20;4'
"""

from __future__ import annotations

from typing import Final

from tickrig.wire.errors import ChecksumError, FieldError

BITS: Final = 6
MASK: Final = 0x3F
ZERO: Final = 0x30


def encode_number(value: int, width: int) -> bytes:
    """Return a number in `width` characters.

    Raises:
        FieldError: it needs more.
    """
    if not 0 <= value < 1 << BITS * width:
        raise FieldError(f"{value} does not fit into {width} characters of 6 bits")
    shifts = range(BITS * (width - 1), -1, -BITS)
    return bytes(ZERO + (value >> shift & MASK) for shift in shifts)


def parse_number(data: bytes) -> int:
    """Return the number that characters make.

    Raises:
        FieldError: a character that carries none.
    """
    value = 0
    for code in data:
        if not ZERO <= code <= ZERO + MASK:
            raise FieldError(f"character {code:#04x} is not in 0x30..0x6f")
        value = value << BITS | code - ZERO
    return value


def line_sum(data: bytes) -> bytes:
    """Return the character that sums a line up."""
    return bytes((ZERO + (sum(data) & MASK),))


def with_sum(line: bytes, summed: bytes | None = None) -> bytes:
    """Return a line with its sum behind it, the sum of `summed` if that is given."""
    return line + line_sum(line if summed is None else summed)


def without_sum(line: bytes) -> bytes:
    """Return a line without its sum.

    Raises:
        ChecksumError: the sum does not match.
    """
    data, came = line[:-1], line[-1:]
    if not came or came != line_sum(data):
        raise ChecksumError(f"line {line!r}: its sum is {line_sum(data)!r}")
    return data
