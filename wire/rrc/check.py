"""The CHECK digit of a line.

The manual says "the sum from the head of the command to just before CHECK";
its nine samples show that the low nibble of the sum of the character codes is
meant. Letter case and exchanged characters are not seen by it.
"""

from __future__ import annotations

from tickrig.wire.errors import ChecksumError
from tickrig.wire.rrc.hexdigits import HEX_DIGITS, UPPER_DIGITS


def check_digit(message: bytes) -> bytes:
    """Return CHECK for a message without LF, as an upper-case digit.

    >>> check_digit(b"beep646464640a0a0a0a0a0a")
    b'A'
    """
    return UPPER_DIGITS[sum(message) & 0xF]


def strip_check(line: bytes) -> bytes:
    """Return a line without the CHECK digit at its end.

    Raises:
        ChecksumError: CHECK is missing, wrong or not a hex digit.
    """
    message, digit = line[:-1], line[-1:]
    if digit not in HEX_DIGITS or int(digit, 16) != sum(message) & 0xF:
        raise ChecksumError(f"CHECK {digit!r} of {line!r}, expected {check_digit(message)!r}")
    return message
