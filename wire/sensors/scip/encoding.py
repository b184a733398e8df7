r"""Numbers as characters of 6 bits, and the sum behind each line (SCIP 2.0, data encoding).

>>> encode_number(1_234, 2), encode_number(5_432, 3), encode_number(16_000_000, 4)
(b'CB', b'1Dh', b'm2@0')
>>> with_sum(b"DMIN:20;", b"DMIN:20")
b'DMIN:20;4'
"""

from __future__ import annotations

import struct
from binascii import a2b_base64, b2a_base64
from collections.abc import Sequence
from typing import Final

from tickrig.wire.errors import ChecksumError, FieldError, FramingError

BITS: Final = 6
MASK: Final = 0x3F
ZERO: Final = 0x30
CHARACTERS: Final = bytes(range(ZERO, ZERO + MASK + 1))

BASE64: Final = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"
"""Other characters of 6 bits, four for three bytes: a fifth of the time of shifts and masks."""

_FROM_BASE64: Final = bytes.maketrans(BASE64, CHARACTERS)
_TO_BASE64: Final = bytes.maketrans(CHARACTERS, BASE64)
_MOST: Final = 4
"""Characters of a number."""


def encode_numbers(values: Sequence[int], width: int) -> bytes:
    """Return numbers in `width` characters each, 1 to 4, one behind the other.

    Raises:
        FieldError: one needs more.
    """
    for value in (min(values, default=0), max(values, default=0)):
        if not 0 <= value < 1 << BITS * width:
            raise FieldError(f"{value} does not fit into {width} characters of 6 bits")
    words = bytearray(struct.pack(f">{len(values)}I", *values))
    del words[::_MOST]
    characters = b2a_base64(words, newline=False).translate(_FROM_BASE64)
    out = bytearray(len(values) * width)
    for place in range(width):
        out[place::width] = characters[_MOST - width + place :: _MOST]
    return bytes(out)


def parse_numbers(data: bytes, width: int) -> tuple[int, ...]:
    """Return the numbers that characters make, `width` each, 1 to 4.

    Raises:
        FieldError: a character that carries none.
        FramingError: half a number at the end.
    """
    if strange := data.translate(None, CHARACTERS):
        raise FieldError(f"character {strange[0]:#04x} is not in 0x30..0x6f")
    if len(data) % width:
        raise FramingError(f"{len(data)} characters are no numbers of {width}")
    count = len(data) // width
    characters = bytearray(BASE64[:1] * (_MOST * count))
    for place in range(width):
        characters[_MOST - width + place :: _MOST] = data[place::width].translate(_TO_BASE64)
    words, bytes_of_three = bytearray(_MOST * count), a2b_base64(characters)
    for place in range(3):
        words[place + 1 :: _MOST] = bytes_of_three[place::3]
    return struct.unpack(f">{count}I", words)


def encode_number(value: int, width: int) -> bytes:
    """Return a number in `width` characters; FieldError if it needs more."""
    return encode_numbers((value,), width)


def parse_number(data: bytes) -> int:
    """Return the number that all characters make; FieldError if one carries none."""
    return parse_numbers(data, len(data))[0]


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
