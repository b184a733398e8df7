r"""EMCY codec: error codes, error register, message (CiA 301, emergency object).

>>> Emcy.parse(bytes.fromhex("3081110700000000"))
Emcy(code=33072, register=17, text=b'\x07\x00\x00\x00\x00')
>>> describe(0x8130), describe(0x2310)
('life guard error or heartbeat error', 'current, CANopen device output side')
"""

from __future__ import annotations

import struct
from enum import IntFlag
from typing import Final, NamedTuple

from tickrig.wire.canopen.described_code import DescribedCode
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


class EmcyCode(DescribedCode):
    """Emergency error codes; codes that end in 00h denote a class."""

    NO_ERROR = 0x0000, "error reset or no error"
    GENERIC = 0x1000, "generic error"
    CURRENT = 0x2000, "current, generic error"
    CURRENT_INPUT = 0x2100, "current, CANopen device input side"
    CURRENT_INSIDE = 0x2200, "current inside the CANopen device"
    CURRENT_OUTPUT = 0x2300, "current, CANopen device output side"
    VOLTAGE = 0x3000, "voltage, generic error"
    VOLTAGE_MAINS = 0x3100, "mains voltage"
    VOLTAGE_INSIDE = 0x3200, "voltage inside the CANopen device"
    VOLTAGE_OUTPUT = 0x3300, "output voltage"
    TEMPERATURE = 0x4000, "temperature, generic error"
    TEMPERATURE_AMBIENT = 0x4100, "ambient temperature"
    TEMPERATURE_DEVICE = 0x4200, "CANopen device temperature"
    HARDWARE = 0x5000, "CANopen device hardware, generic error"
    SOFTWARE = 0x6000, "CANopen device software, generic error"
    SOFTWARE_INTERNAL = 0x6100, "internal software"
    SOFTWARE_USER = 0x6200, "user software"
    SOFTWARE_DATA = 0x6300, "data set"
    MODULES = 0x7000, "additional modules, generic error"
    MONITORING = 0x8000, "monitoring, generic error"
    COMMUNICATION = 0x8100, "communication, generic error"
    CAN_OVERRUN = 0x8110, "CAN overrun, objects lost"
    CAN_PASSIVE = 0x8120, "CAN in error passive mode"
    HEARTBEAT = 0x8130, "life guard error or heartbeat error"
    BUS_OFF_RECOVERED = 0x8140, "recovered from bus off"
    CAN_ID_COLLISION = 0x8150, "CAN-ID collision"
    PROTOCOL = 0x8200, "protocol error, generic error"
    PDO_TOO_SHORT = 0x8210, "PDO not processed due to length error"
    PDO_TOO_LONG = 0x8220, "PDO length exceeded"
    MPDO_NO_OBJECT = 0x8230, "DAM MPDO not processed, destination object not available"
    SYNC_LENGTH = 0x8240, "unexpected SYNC data length"
    RPDO_TIMEOUT = 0x8250, "RPDO timeout"
    EXTERNAL = 0x9000, "external error, generic error"
    ADDITIONAL = 0xF000, "additional functions, generic error"
    DEVICE_SPECIFIC = 0xFF00, "CANopen device specific, generic error"


_TEXTS: Final = {int(code): code.text for code in EmcyCode}
_OF_DRIVES: Final = {
    0x5100: "hardware, supply",
    0x5200: "hardware, control",
    0x5300: "hardware, operating unit",
    0x5400: "hardware, power section",
    0x5500: "hardware, data storage",
    0x7100: "power modules",
    0x7110: "brake chopper",
    0x7120: "motor",
    0x7121: "motor blocked",
    0x7122: "motor error or wrong commutation",
    0x7123: "motor tilted",
    0x7200: "measurement circuit",
    0x7300: "sensor",
    0x7301: "tacho fault",
    0x7302: "wrong polarity of the tacho",
    0x7303: "resolver 1 fault",
    0x7304: "resolver 2 fault",
    0x7305: "incremental sensor 1 fault",
    0x7306: "incremental sensor 2 fault",
    0x7307: "incremental sensor 3 fault",
    0x7310: "speed sensor",
    0x7320: "position sensor",
    0x7400: "computation circuit",
    0x7500: "communication module",
    0x7600: "data storage module",
    0x8300: "torque control",
    0x8311: "excess torque",
    0x8400: "velocity controller",
    0x8500: "position controller",
    0x8600: "positioning controller",
    0x8611: "following error",
    0x8612: "reference limit",
    0x8700: "sync controller",
}
"""Texts of codes that CiA 402 adds for drives, where CiA 301 has only a class such as 7000h."""


def describe(code: int) -> str:
    """Return the text of an emergency error code, or of its class.

    For some codes, CiA 301 defines only a class, and CiA 402 (drives) defines the code itself. The
    result is then the text of CiA 402, with `(CiA 402)` at its end.

    >>> describe(0xFF01), describe(0x4711), describe(0x0001)
    ('CANopen device specific, generic error', 'temperature, generic error', 'unknown')
    >>> describe(0x7320), describe(0x8611)
    ('position sensor (CiA 402)', 'following error (CiA 402)')
    """
    # From the code itself to its class: 8131h reads as 8130h, 8190h as 8100h. 0000h is no
    # class.
    for mask in (0xFFFF, 0xFFF0, 0xFF00, 0xF000):
        kind = code & mask
        if kind in _OF_DRIVES:
            return f"{_OF_DRIVES[kind]} (CiA 402)"
        if kind in _TEXTS and (kind or not code):
            return _TEXTS[kind]
    return "unknown"


class Emcy(NamedTuple):
    """An EMCY message, with which a node reports the beginning or the end of an error.

    Attributes:
        code: emergency error code, or 0x0000 for the end of an error.
        register: value of the error register 1001h after the change.
        text: five bytes that are manufacturer-specific.
    """

    code: int
    register: int
    text: bytes = bytes(TEXT_BYTES)

    @classmethod
    def parse(cls, data: bytes) -> Emcy:
        """Read the eight bytes; raise FramingError if there are more or fewer bytes."""
        if len(data) != _LAYOUT.size:
            raise FramingError(f"an EMCY of {len(data)} bytes, it has {_LAYOUT.size}")
        return cls(*_LAYOUT.unpack(data))

    def encode(self) -> bytes:
        """Return the eight bytes; the text is truncated or padded with 00h."""
        return _LAYOUT.pack(self.code, self.register, self.text)
