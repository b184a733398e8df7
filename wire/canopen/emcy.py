r"""EMCY codec: error codes, error register, message (CiA 301, emergency object).

>>> Emcy.parse(bytes.fromhex("3081110700000000"))
Emcy(code=33072, register=17, text=b'\x07\x00\x00\x00\x00')
>>> describe(0x8130), describe(0x2310)
('life guard error or heartbeat error', 'current, CANopen device output side')
"""

from __future__ import annotations

import struct
from enum import IntEnum, IntFlag
from typing import Final, NamedTuple

from tickrig.wire.errors import FramingError

TEXT_BYTES: Final = 5

# 30 81 11 07 00 00 00 00: error code 8130h, error register 11h, five manufacturer-specific
# bytes.
_LAYOUT: Final = struct.Struct("<HB5s")


class ErrorRegister(IntFlag):
    """Bits of the error register 1001h."""

    GENERIC = 0x01
    CURRENT = 0x02
    VOLTAGE = 0x04
    TEMPERATURE = 0x08
    COMMUNICATION = 0x10
    DEVICE_PROFILE = 0x20
    MANUFACTURER = 0x80


class EmcyCode(IntEnum):
    """Emergency error codes; those that end in 00h denote a class."""

    NO_ERROR = 0x0000
    GENERIC = 0x1000
    CURRENT = 0x2000
    CURRENT_INPUT = 0x2100
    CURRENT_INSIDE = 0x2200
    CURRENT_OUTPUT = 0x2300
    VOLTAGE = 0x3000
    VOLTAGE_MAINS = 0x3100
    VOLTAGE_INSIDE = 0x3200
    VOLTAGE_OUTPUT = 0x3300
    TEMPERATURE = 0x4000
    TEMPERATURE_AMBIENT = 0x4100
    TEMPERATURE_DEVICE = 0x4200
    HARDWARE = 0x5000
    SOFTWARE = 0x6000
    SOFTWARE_INTERNAL = 0x6100
    SOFTWARE_USER = 0x6200
    SOFTWARE_DATA = 0x6300
    MODULES = 0x7000
    MONITORING = 0x8000
    COMMUNICATION = 0x8100
    CAN_OVERRUN = 0x8110
    CAN_PASSIVE = 0x8120
    HEARTBEAT = 0x8130
    BUS_OFF_RECOVERED = 0x8140
    CAN_ID_COLLISION = 0x8150
    PROTOCOL = 0x8200
    PDO_TOO_SHORT = 0x8210
    PDO_TOO_LONG = 0x8220
    MPDO_NO_OBJECT = 0x8230
    SYNC_LENGTH = 0x8240
    RPDO_TIMEOUT = 0x8250
    EXTERNAL = 0x9000
    ADDITIONAL = 0xF000
    DEVICE_SPECIFIC = 0xFF00


_TEXTS: Final[dict[int, str]] = {
    EmcyCode.NO_ERROR: "error reset or no error",
    EmcyCode.GENERIC: "generic error",
    EmcyCode.CURRENT: "current, generic error",
    EmcyCode.CURRENT_INPUT: "current, CANopen device input side",
    EmcyCode.CURRENT_INSIDE: "current inside the CANopen device",
    EmcyCode.CURRENT_OUTPUT: "current, CANopen device output side",
    EmcyCode.VOLTAGE: "voltage, generic error",
    EmcyCode.VOLTAGE_MAINS: "mains voltage",
    EmcyCode.VOLTAGE_INSIDE: "voltage inside the CANopen device",
    EmcyCode.VOLTAGE_OUTPUT: "output voltage",
    EmcyCode.TEMPERATURE: "temperature, generic error",
    EmcyCode.TEMPERATURE_AMBIENT: "ambient temperature",
    EmcyCode.TEMPERATURE_DEVICE: "CANopen device temperature",
    EmcyCode.HARDWARE: "CANopen device hardware, generic error",
    EmcyCode.SOFTWARE: "CANopen device software, generic error",
    EmcyCode.SOFTWARE_INTERNAL: "internal software",
    EmcyCode.SOFTWARE_USER: "user software",
    EmcyCode.SOFTWARE_DATA: "data set",
    EmcyCode.MODULES: "additional modules, generic error",
    EmcyCode.MONITORING: "monitoring, generic error",
    EmcyCode.COMMUNICATION: "communication, generic error",
    EmcyCode.CAN_OVERRUN: "CAN overrun, objects lost",
    EmcyCode.CAN_PASSIVE: "CAN in error passive mode",
    EmcyCode.HEARTBEAT: "life guard error or heartbeat error",
    EmcyCode.BUS_OFF_RECOVERED: "recovered from bus off",
    EmcyCode.CAN_ID_COLLISION: "CAN-ID collision",
    EmcyCode.PROTOCOL: "protocol error, generic error",
    EmcyCode.PDO_TOO_SHORT: "PDO not processed due to length error",
    EmcyCode.PDO_TOO_LONG: "PDO length exceeded",
    EmcyCode.MPDO_NO_OBJECT: "DAM MPDO not processed, destination object not available",
    EmcyCode.SYNC_LENGTH: "unexpected SYNC data length",
    EmcyCode.RPDO_TIMEOUT: "RPDO timeout",
    EmcyCode.EXTERNAL: "external error, generic error",
    EmcyCode.ADDITIONAL: "additional functions, generic error",
    EmcyCode.DEVICE_SPECIFIC: "CANopen device specific, generic error",
}


def describe(code: int) -> str:
    """Return the text of an emergency error code, or of its class.

    >>> describe(0xFF01), describe(0x4711), describe(0x0001)
    ('CANopen device specific, generic error', 'temperature, generic error', 'unknown')
    """
    # From the code itself to its class: 8131h reads as 8130h, 8190h as 8100h. 0000h is no
    # class.
    for mask in (0xFFFF, 0xFFF0, 0xFF00, 0xF000):
        text = _TEXTS.get(code & mask)
        if text is not None and (code & mask or not code):
            return text
    return "unknown"


class Emcy(NamedTuple):
    """An EMCY message.

    Attributes:
        code: emergency error code, 0x0000 for the end of an error.
        register: the error register after it.
        text: five manufacturer-specific bytes.
    """

    code: int
    register: int
    text: bytes = bytes(TEXT_BYTES)

    @classmethod
    def parse(cls, data: bytes) -> Emcy:
        """Read the eight bytes; FramingError if there are more or fewer."""
        if len(data) != _LAYOUT.size:
            raise FramingError(f"an EMCY of {len(data)} bytes, it has {_LAYOUT.size}")
        return cls(*_LAYOUT.unpack(data))

    def encode(self) -> bytes:
        """Return the eight bytes; the text is truncated or padded with 00h."""
        return _LAYOUT.pack(self.code, self.register, self.text)
