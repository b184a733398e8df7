"""Parts of commands and replies: hex numbers, the CHECK digit, and the cost of traffic."""

from __future__ import annotations

from itertools import product
from typing import Final

from tickrig.wire.errors import ChecksumError, FieldError

# Numbers as the RRC writes them: `2hex` and `1hex`, negative ones in two's complement.

_UPPER_DIGITS: Final = tuple(b"%X" % n for n in range(16))
_HEX_DIGITS: Final = {bytes([code]): int(chr(code), 16) for code in b"0123456789ABCDEFabcdef"}


def all_digits(width: int) -> list[bytes]:
    """Return all texts of a given number of hex digits, in upper, lower and mixed case.

    These texts are used to make tables of all valid parameters.
    """
    return [b"".join(digits) for digits in product(sorted(_HEX_DIGITS), repeat=width)]


def read_hex(digits: bytes) -> int:
    """Return the number that one or two hex digits stand for, in upper or lower case.

    Raises:
        FieldError: a character is not a hex digit.
    """
    if not all(digits[n : n + 1] in _HEX_DIGITS for n in range(len(digits))):
        raise FieldError(f"{digits!r} is not hexadecimal")
    return int(digits, 16)


def read_signed(digits: bytes) -> int:
    """Read two hex digits as an 8-bit two's complement number.

    >>> read_signed(b"9c"), read_signed(b"64")
    (-100, 100)
    """
    value = read_hex(digits)
    return value - 0x100 if value >= 0x80 else value


# The CHECK digit of a line.
#
# The manual says "the sum from the head of the command to just before CHECK". Its nine samples show
# that it means the low nibble of the sum of the character codes. CHECK does not detect exchanged
# characters or a different letter case.


def check_digit(message: bytes) -> bytes:
    """Return CHECK for a message without LF, as an upper-case digit.

    >>> check_digit(b"beep646464640a0a0a0a0a0a")
    b'A'
    """
    return _UPPER_DIGITS[sum(message) & 0xF]


def strip_check(line: bytes) -> bytes:
    """Verify the checksum digit CHECK at the end of an RRC line, and return the line without it.

    Raises:
        ChecksumError: CHECK is missing, wrong or not a hex digit.
    """
    # The last character is always taken as CHECK. So a line without CHECK loses its last digit here
    # and is refused because of a wrong CHECK (vector C02).
    message, digit = line[:-1], line[-1:]
    total: int = sum(message)
    if _HEX_DIGITS.get(digit) != total & 0xF:
        raise ChecksumError(f"CHECK {digit!r} of {line!r}, expected {check_digit(message)!r}")
    return message


# Cost of traffic for the RRC, and how much a host may send (DECISION R27).
#
# Costs are in per cent of the RRC's period of 10 ms. Above 100 % the RRC falls behind; when it is
# 300 % behind, VR2 stops. At exactly 100 % the backlog never drains: a host whose clock is 0.1 %
# fast stops VR2 after 60 s. So a host should use at most `SAFE_PCT`.

BASE_PCT: Final = 30
STATUS_PCT: Final = 20
LINE_FEED_PCT: Final = 25
REPLY_PCT: Final = 15
OVERFLOW_PCT: Final = 150
PERIOD_PCT: Final = 100
TOO_FAR_BEHIND_PCT: Final = 300
SAFE_PCT: Final = 90

PERIOD_US: Final = 10_000
PERIODS_A_SECOND: Final = 100

LINES_A_PERIOD: Final = 2
"""Number of lines processed in a period while VR2 runs. Otherwise one line is processed in two
periods."""

PACE_WITHOUT_VR2: Final = PERIODS_A_SECOND // 2 * SAFE_PCT // PERIOD_PCT
"""Number of lines per second that a host may send while VR2 does not run."""


def pace_lines_s(*, stable: bool, status: bool, extra_pct: int = 0) -> int:
    """Return the number of lines per second that a host may send to an RRC wheelchair controller.

    The RRC controls the wheelchair VR2. The number applies while VR2 runs. If the RRC receives more
    lines than it can process, it stops VR2.

    Args:
        stable: whether OK lines are omitted (stablemode).
        status: whether the RRC sends a status line in each of its periods of 10 ms.
        extra_pct: share of these periods that the RRC needs for other work, in per cent.

    >>> pace_lines_s(stable=True, status=True), pace_lines_s(stable=False, status=True)
    (160, 100)
    """
    left_pct = SAFE_PCT - BASE_PCT - extra_pct - (STATUS_PCT if status else 0)
    line_pct = LINE_FEED_PCT + (0 if stable else REPLY_PCT)
    # Two limits apply: the work that fits into a period, and the two lines that a period takes at
    # most. With stablemode and without SA the second limit is the smaller one: 180 lines a second.
    most = LINES_A_PERIOD * PERIODS_A_SECOND * SAFE_PCT // PERIOD_PCT
    return max(0, min(most, left_pct * PERIODS_A_SECOND // line_pct))
