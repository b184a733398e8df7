"""Registers of the RH3 base's driver (rh3-control, drive protocol: register map A).

Numbers of 32 bits take two registers, the high half first.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum, IntFlag
from typing import Final, NamedTuple

DEVICE_ID: Final = 0x5248
VERSION: Final = 0x0100

_WORD: Final = 0x1_0000


class Address(IntEnum):
    """The first register of each number."""

    DEVICE_ID = 0x0000
    VERSION = 0x0001
    MODE = 0x0010
    COMMAND = 0x0011
    WATCHDOG_MS = 0x0012
    GAIN_P = 0x0020
    GAIN_I = 0x0021
    GAIN_D = 0x0022
    GAIN_VP = 0x0023
    GAIN_VI = 0x0024
    GAIN_VD = 0x0025
    SPEED_LIMIT = 0x0026
    ACCELERATION_LIMIT = 0x0028
    ENCODER_COUNTS = 0x002A
    DIRECTION = 0x002B
    TARGET_SPEED_LEFT = 0x0100
    TARGET_SPEED_RIGHT = 0x0102
    TARGET_POSITION_LEFT = 0x0104
    TARGET_POSITION_RIGHT = 0x0106
    STATUS = 0x0200
    FAULT_LEFT = 0x0201
    FAULT_RIGHT = 0x0202
    SAMPLE = 0x0203
    POSITION_LEFT = 0x0204
    POSITION_RIGHT = 0x0206
    SPEED_LEFT = 0x0208
    SPEED_RIGHT = 0x020A
    CURRENT_LEFT = 0x020C
    CURRENT_RIGHT = 0x020D


class Mode(IntEnum):
    """What the targets mean (0010h)."""

    FREE = 0
    VELOCITY = 1
    POSITION = 2


class Command(IntEnum):
    """What a master tells the driver (0011h)."""

    NONE = 0
    ENABLE = 1
    DISABLE = 2
    STOP = 3
    QUICK_STOP = 4
    CLEAR_FAULT = 5
    ZERO_COUNTERS = 6


class Status(IntFlag):
    """What the driver says of itself (0200h); bits 5 and 6 are ours."""

    ENABLED = 0x01
    MOVING = 0x02
    FAULT = 0x04
    WATCHDOG = 0x08
    CLIPPED = 0x10
    EMERGENCY_STOP = 0x20
    BUMPER = 0x40


class Fault(IntFlag):
    """Why a wheel has no power (0201h, 0202h); ours, the proposal names none."""

    OVER_CURRENT = 0x01
    ENCODER = 0x04
    STALL = 0x08
    EMERGENCY_STOP = 0x10


class Report(NamedTuple):
    """What a master reads each period: 12 registers from `Address.STATUS` on.

    Attributes:
        status: of the driver.
        fault_left: of the left wheel.
        fault_right: of the right wheel.
        sample: milliseconds since power-up, modulo 65536.
        left: position of the left wheel, counts.
        right: position of the right wheel, counts.
    """

    status: Status
    fault_left: Fault
    fault_right: Fault
    sample: int
    left: int
    right: int

    @classmethod
    def parse(cls, values: Sequence[int]) -> Report:
        """Read the registers."""
        status, fault_left, fault_right, sample, *rest = values
        left, right = signed(rest[0], rest[1]), signed(rest[2], rest[3])
        return cls(Status(status), Fault(fault_left), Fault(fault_right), sample, left, right)


REPORT: Final = (Address.STATUS.value, 12)
"""First register and number of them."""


def wide(value: int) -> tuple[int, int]:
    """Return the registers of a number of 32 bits, in two's complement.

    >>> wide(71_534), wide(-1)
    ((1, 5998), (65535, 65535))
    """
    return value >> 16 & 0xFFFF, value & 0xFFFF


def signed(high: int, low: int) -> int:
    """Return the number that two registers make.

    >>> signed(65_535, 65_535), signed(1, 5_998)
    (-1, 71534)
    """
    value = high * _WORD + low
    return value - _WORD * _WORD if high >= _WORD // 2 else value
