"""SDO abort codes (CiA 301, table of SDO abort codes).

>>> describe_abort(0x0602_0000), describe_abort(0x0601_0003)
('object does not exist (06020000h)', 'unknown (06010003h)')
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final


class AbortCode(IntEnum):
    """Why an SDO transfer was aborted."""

    TOGGLE_BIT = 0x0503_0000
    TIMEOUT = 0x0504_0000
    COMMAND_SPECIFIER = 0x0504_0001
    BLOCK_SIZE = 0x0504_0002
    SEQUENCE_NUMBER = 0x0504_0003
    CRC = 0x0504_0004
    OUT_OF_MEMORY = 0x0504_0005
    UNSUPPORTED_ACCESS = 0x0601_0000
    WRITE_ONLY = 0x0601_0001
    READ_ONLY = 0x0601_0002
    NO_OBJECT = 0x0602_0000
    NOT_MAPPABLE = 0x0604_0041
    PDO_LENGTH = 0x0604_0042
    PARAMETER_INCOMPATIBLE = 0x0604_0043
    INTERNAL_INCOMPATIBLE = 0x0604_0047
    HARDWARE = 0x0606_0000
    LENGTH = 0x0607_0010
    TOO_LONG = 0x0607_0012
    TOO_SHORT = 0x0607_0013
    NO_SUBINDEX = 0x0609_0011
    VALUE_RANGE = 0x0609_0030
    VALUE_TOO_HIGH = 0x0609_0031
    VALUE_TOO_LOW = 0x0609_0032
    MAXIMUM_BELOW_MINIMUM = 0x0609_0036
    NO_RESOURCE = 0x060A_0023
    GENERAL = 0x0800_0000
    NOT_STORED = 0x0800_0020
    LOCAL_CONTROL = 0x0800_0021
    DEVICE_STATE = 0x0800_0022
    NO_DICTIONARY = 0x0800_0023
    NO_DATA = 0x0800_0024


_TEXTS: Final[dict[int, str]] = {
    AbortCode.TOGGLE_BIT: "toggle bit not alternated",
    AbortCode.TIMEOUT: "SDO protocol timed out",
    AbortCode.COMMAND_SPECIFIER: "command specifier not valid",
    AbortCode.BLOCK_SIZE: "invalid block size",
    AbortCode.SEQUENCE_NUMBER: "invalid sequence number",
    AbortCode.CRC: "CRC error",
    AbortCode.OUT_OF_MEMORY: "out of memory",
    AbortCode.UNSUPPORTED_ACCESS: "unsupported access",
    AbortCode.WRITE_ONLY: "object is write only",
    AbortCode.READ_ONLY: "object is read only",
    AbortCode.NO_OBJECT: "object does not exist",
    AbortCode.NOT_MAPPABLE: "object cannot be mapped",
    AbortCode.PDO_LENGTH: "mapped objects exceed the PDO length",
    AbortCode.PARAMETER_INCOMPATIBLE: "parameters are incompatible",
    AbortCode.INTERNAL_INCOMPATIBLE: "internal incompatibility",
    AbortCode.HARDWARE: "hardware error",
    AbortCode.LENGTH: "length does not match",
    AbortCode.TOO_LONG: "too long",
    AbortCode.TOO_SHORT: "too short",
    AbortCode.NO_SUBINDEX: "sub-index does not exist",
    AbortCode.VALUE_RANGE: "invalid value",
    AbortCode.VALUE_TOO_HIGH: "value too high",
    AbortCode.VALUE_TOO_LOW: "value too low",
    AbortCode.MAXIMUM_BELOW_MINIMUM: "maximum below minimum",
    AbortCode.NO_RESOURCE: "resource not available",
    AbortCode.GENERAL: "general error",
    AbortCode.NOT_STORED: "cannot be transferred or stored",
    AbortCode.LOCAL_CONTROL: "not possible under local control",
    AbortCode.DEVICE_STATE: "not possible in this device state",
    AbortCode.NO_DICTIONARY: "no object dictionary",
    AbortCode.NO_DATA: "no data available",
}


def describe_abort(code: int) -> str:
    """Return the text of an abort code with its number."""
    return f"{_TEXTS.get(code, 'unknown')} ({code:08X}h)"
