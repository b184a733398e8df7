"""Error codes of a drive, and how it reacts to them (CiA 402-2, error codes)."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

from tickrig.wire.canopen.emcy import ErrorRegister


class ErrorCode(IntEnum):
    """What a drive can find wrong."""

    OVER_CURRENT = 0x2310
    OVER_VOLTAGE = 0x3210
    UNDER_VOLTAGE = 0x3220
    DRIVE_TEMPERATURE = 0x4310
    MOTOR_BLOCKED = 0x7121
    MOTOR_PHASE = 0x7122
    INCREMENTAL_SENSOR = 0x7305
    POSITION_SENSOR = 0x7320
    COMMUNICATION = 0x8100
    HEARTBEAT = 0x8130
    FOLLOWING_ERROR = 0x8611
    NEGATIVE_LIMIT = 0xFF06
    POSITIVE_LIMIT = 0xFF07
    SOFTWARE_LIMIT = 0xFF09


CONTROLLABLE: Final = frozenset(
    (
        *(ErrorCode.DRIVE_TEMPERATURE, ErrorCode.FOLLOWING_ERROR, ErrorCode.MOTOR_BLOCKED),
        *(ErrorCode.NEGATIVE_LIMIT, ErrorCode.POSITIVE_LIMIT, ErrorCode.SOFTWARE_LIMIT),
    )
)
"""Faults after which the motor can still be slowed down as 605Eh says; others switch it off."""

COMMUNICATION_ERRORS: Final = range(0x8100, 0x8200)

_REGISTERS: Final = {
    0x2: ErrorRegister.CURRENT,
    0x3: ErrorRegister.VOLTAGE,
    0x4: ErrorRegister.TEMPERATURE,
}
"""Bit of the error register by the first digit of the error code."""


def is_controllable(code: int) -> bool:
    """Return whether the motor can be slowed down after a fault."""
    return code in CONTROLLABLE or code in COMMUNICATION_ERRORS


def register_of(code: int) -> ErrorRegister:
    """Return the bit of the error register.

    >>> [register_of(code).name for code in (0x3220, 0x8130, 0x8611)]
    ['VOLTAGE', 'COMMUNICATION', 'DEVICE_PROFILE']
    """
    if code in COMMUNICATION_ERRORS:
        return ErrorRegister.COMMUNICATION
    return _REGISTERS.get(code >> 12, ErrorRegister.DEVICE_PROFILE)
