r"""Modbus RTU: frames and their CRC, requests, registers of the RH3 motor driver.

Frames of Modbus RTU: an address, a message, and a CRC with its low byte first.

>>> encode_frame(1, b"\x03\x02\x00\x00\x01").hex(" ")
'01 03 02 00 00 01 85 b2'
>>> parse_frame(bytes.fromhex("01 03 02 00 00 01 85 b2"))
(1, b'\x03\x02\x00\x00\x01')
>>> f"{_crc16(b'123456789'):04X}"
'4B37'

Requests on holding registers, and their responses.

Sources: Modbus Application Protocol 1.1b3, functions 03, 06, 10h and 17h, and
MODBUS Exception Responses.

>>> parse_request(bytes.fromhex("17 02 00 00 0c 01 00 00 04 08 0001 0002 0003 0004"))
Request(function=23, read=(512, 12), write=(256, (1, 2, 3, 4)))
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import Final, NamedTuple

import crcmod

from tickrig.wire.errors import ChecksumError, FramingError, WireError

_crc16: Final[Callable[[bytes], int]] = crcmod.mkCrcFun(0x1_8005, 0xFFFF, rev=True, xorOut=0)
"""Function for the CRC over address, function code and data, with polynomial 8005h, reflected, and
initial value FFFFh (Modbus over Serial Line 1.02, CRC Checking)."""

MAX_FRAME_BYTES: Final = 256
_MIN_FRAME_BYTES: Final = 4
BROADCAST: Final = 0
"""Broadcast address, to which no slave answers."""
ADDRESSES: Final = range(1, 248)
"""Addresses of individual slaves."""

SHORTEST_SILENCE_US: Final = 1_750
"""Silence between frames above 19200 bit/s (Modbus over Serial Line 1.02, RTU framing)."""


def silence_us(baud: int, frame_bits: int = 10) -> int:
    """Return the silence between two frames: 3.5 characters, or 1.75 ms above 19200 bit/s.

    >>> silence_us(9_600), silence_us(115_200)
    (3646, 1750)
    """
    if baud > 19_200:
        return SHORTEST_SILENCE_US
    # 3.5 characters, rounded up: 7/2 in whole numbers.
    return -(-7 * frame_bits * 1_000_000 // (2 * baud))


def encode_frame(address: int, message: bytes) -> bytes:
    """Write a frame."""
    body = bytes([address]) + message
    return body + _crc16(body).to_bytes(2, "little")


def parse_frame(frame: bytes) -> tuple[int, bytes]:
    """Check the CRC of a Modbus RTU frame, and return its address and its message.

    Raises:
        FramingError: the length is invalid.
        ChecksumError: the CRC is wrong.
    """
    if not _MIN_FRAME_BYTES <= len(frame) <= MAX_FRAME_BYTES:
        raise FramingError(f"{len(frame)} bytes, a frame has {_MIN_FRAME_BYTES}..{MAX_FRAME_BYTES}")
    if _crc16(frame[:-2]) != int.from_bytes(frame[-2:], "little"):
        raise ChecksumError(f"wrong CRC in {frame.hex(' ')}")
    return frame[0], frame[1:-2]


READ: Final = 0x03
WRITE_ONE: Final = 0x06
WRITE: Final = 0x10
READ_WRITE: Final = 0x17
ERROR_BIT: Final = 0x80

MAX_READ: Final = 125
MAX_WRITE: Final = 123
MAX_WRITE_WHILE_READ: Final = 121
"""Largest number of registers by function."""

_PAIR: Final = struct.Struct(">HH")
_WRITE_HEAD: Final = struct.Struct(">HHB")


class ExceptionCode(IntEnum):
    """Exception codes, which say why a slave has refused a request."""

    ILLEGAL_FUNCTION = 1
    ILLEGAL_DATA_ADDRESS = 2
    ILLEGAL_DATA_VALUE = 3
    SERVER_DEVICE_FAILURE = 4
    SERVER_DEVICE_BUSY = 6


class Refusal(WireError):  # noqa: N818 - what the slave does
    """A request that is answered with an exception code."""

    def __init__(self, code: ExceptionCode) -> None:
        super().__init__(code.name)
        self.code = code


@dataclass(frozen=True, slots=True)
class Request:
    """A Modbus request to read registers, to write registers, or both.

    If it does both, the registers are written before the others are read.

    Attributes:
        function: function code.
        read: first register and number of registers to read, or None.
        write: first register and values to write, or None.
    """

    function: int
    read: tuple[int, int] | None = None
    write: tuple[int, tuple[int, ...]] | None = None


def encode_request(request: Request) -> bytes:
    """Return the bytes of a request, in the format of its function code."""
    out = bytes([request.function])
    if request.read is not None:
        out += _PAIR.pack(*request.read)
    if request.write is not None:
        first, values = request.write
        if request.function == WRITE_ONE:
            return out + _PAIR.pack(first, *values)
        # 10h: 01 00 00 04 08, values: first register, number, bytes. 17h: the same fields after 02
        # 00 00 0C.
        out += _WRITE_HEAD.pack(first, len(values), 2 * len(values)) + _pack_registers(values)
    return out


def parse_request(message: bytes) -> Request:
    """Read the message of a Modbus request.

    Raises:
        Refusal: the function is unknown, or a number is out of range.
    """
    function, data = message[0], message[1:]
    if function == READ:
        return Request(function, _read(data, MAX_READ))
    if function == WRITE_ONE:
        first, value = _pair(data)
        return Request(function, write=(first, (value,)))
    if function == WRITE:
        return Request(function, write=_write(data, MAX_WRITE))
    if function == READ_WRITE:
        read = _read(data[:4], MAX_READ)
        return Request(function, read, _write(data[4:], MAX_WRITE_WHILE_READ))
    raise Refusal(ExceptionCode.ILLEGAL_FUNCTION)


def encode_response(request: Request, values: Sequence[int] = ()) -> bytes:
    """Return the message of the response to a successful Modbus request.

    Args:
        request: the request.
        values: values of the registers that were read.
    """
    out = bytes([request.function])
    if request.read is not None:
        return out + bytes([2 * len(values)]) + _pack_registers(values)
    assert request.write is not None
    first, written = request.write
    # The response to 06 repeats the request (01 06 00 11 00 01). 10h answers with first register
    # and number (01 10 01 00 00 04), 17h only with the values that it read.
    return out + _PAIR.pack(first, written[0] if request.function == WRITE_ONE else len(written))


def encode_exception(function: int, code: ExceptionCode) -> bytes:
    """Write the response to a refused request."""
    return bytes([function | ERROR_BIT, code])


def _pack_registers(values: Sequence[int]) -> bytes:
    """Write registers, with the high byte first."""
    return struct.pack(f">{len(values)}H", *values)


def _pair(data: bytes) -> tuple[int, int]:
    if len(data) != _PAIR.size:
        raise Refusal(ExceptionCode.ILLEGAL_DATA_VALUE)
    first, second = _PAIR.unpack(data)
    return first, second


def _read(data: bytes, most: int) -> tuple[int, int]:
    first, count = _pair(data)
    return first, _checked(first, count, most)


def _write(data: bytes, most: int) -> tuple[int, tuple[int, ...]]:
    if len(data) < _WRITE_HEAD.size:
        raise Refusal(ExceptionCode.ILLEGAL_DATA_VALUE)
    first, count, size = _WRITE_HEAD.unpack_from(data)
    # A wrong byte count is an illegal value (03), whatever the registers are: the standard checks
    # the numbers of a request before it checks the addresses.
    if not size == 2 * count == len(data) - _WRITE_HEAD.size:
        raise Refusal(ExceptionCode.ILLEGAL_DATA_VALUE)
    _checked(first, count, most)
    return first, struct.unpack_from(f">{count}H", data, _WRITE_HEAD.size)


def _checked(first: int, count: int, most: int) -> int:
    if not 1 <= count <= most:
        raise Refusal(ExceptionCode.ILLEGAL_DATA_VALUE)
    # Register FFFFh is the last one; a range does not go round to 0000h.
    if first + count > 0x1_0000:
        raise Refusal(ExceptionCode.ILLEGAL_DATA_ADDRESS)
    return count


# Registers of the driver of the RH3 base (rh3-control, drive protocol: register map A).
#
# Numbers of 32 bits take two registers, the high half first.

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
    """Meaning of the targets (0010h)."""

    FREE = 0
    VELOCITY = 1
    POSITION = 2


class Command(IntEnum):
    """Commands of a master to the driver (0011h)."""

    NONE = 0
    ENABLE = 1
    DISABLE = 2
    STOP = 3
    QUICK_STOP = 4
    CLEAR_FAULT = 5
    ZERO_COUNTERS = 6


class Status(IntFlag):
    """Status of the driver (0200h). Bits 5 and 6 are our addition."""

    ENABLED = 0x01
    MOVING = 0x02
    FAULT = 0x04
    WATCHDOG = 0x08
    CLIPPED = 0x10
    EMERGENCY_STOP = 0x20
    BUMPER = 0x40


class Fault(IntFlag):
    """Reasons for which the driver of a two-wheeled base has switched a wheel off, as bits.

    The registers 0201h and 0202h contain these bits. The protocol of the driver was never
    published, so tickrig has chosen the bits.
    """

    OVER_CURRENT = 0x01
    ENCODER = 0x04
    STALL = 0x08
    EMERGENCY_STOP = 0x10


class Report(NamedTuple):
    """The 12 Modbus registers that a master reads from a two-wheeled base in each period.

    They begin at `Address.STATUS`.

    Attributes:
        status: status of the driver.
        fault_left: reason for which the left wheel is off.
        fault_right: reason for which the right wheel is off.
        sample: number of milliseconds since power-up, modulo 65536.
        left: position of the left wheel, in counts.
        right: position of the right wheel, in counts.
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
        left, right = _signed(rest[0], rest[1]), _signed(rest[2], rest[3])
        return cls(Status(status), Fault(fault_left), Fault(fault_right), sample, left, right)


REPORT: Final = (Address.STATUS.value, 12)
"""First register and number of registers of a report."""


def wide(value: int) -> tuple[int, int]:
    """Return the registers of a number of 32 bits, in two's complement.

    >>> wide(71_534), wide(-1)
    ((1, 5998), (65535, 65535))
    """
    return value >> 16 & 0xFFFF, value & 0xFFFF


def _signed(high: int, low: int) -> int:
    """Return the number in two registers.

    >>> _signed(65_535, 65_535), _signed(1, 5_998)
    (-1, 71534)
    """
    value = high * _WORD + low
    return value - _WORD * _WORD if high >= _WORD // 2 else value
