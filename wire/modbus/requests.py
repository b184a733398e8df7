r"""Requests on holding registers, and what answers them.

Sources: Modbus Application Protocol 1.1b3, functions 03, 06, 10h and 17h, and
MODBUS Exception Responses.

>>> parse_request(bytes.fromhex("17 02 00 00 0c 01 00 00 04 08 0001 0002 0003 0004"))
Request(function=23, read=(512, 12), write=(256, (1, 2, 3, 4)))
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from tickrig.wire.errors import WireError

READ: Final = 0x03
WRITE_ONE: Final = 0x06
WRITE: Final = 0x10
READ_WRITE: Final = 0x17
ERROR_BIT: Final = 0x80

MAX_READ: Final = 125
MAX_WRITE: Final = 123
MAX_WRITE_WHILE_READ: Final = 121
"""Most registers that a function carries."""

_PAIR: Final = struct.Struct(">HH")
_WRITE_HEAD: Final = struct.Struct(">HHB")


class ExceptionCode(IntEnum):
    """Why a slave did not do what it was asked for."""

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
    """A request; what it writes is written before it reads.

    Attributes:
        function: its code.
        read: first register and number of registers to be read.
        write: first register and values to be written.
    """

    function: int
    read: tuple[int, int] | None = None
    write: tuple[int, tuple[int, ...]] | None = None


def encode_request(request: Request) -> bytes:
    """Write a request as its function code tells."""
    out = bytes([request.function])
    if request.read is not None:
        out += _PAIR.pack(*request.read)
    if request.write is not None:
        first, values = request.write
        if request.function == WRITE_ONE:
            return out + _PAIR.pack(first, *values)
        out += _WRITE_HEAD.pack(first, len(values), 2 * len(values)) + pack_registers(values)
    return out


def parse_request(message: bytes) -> Request:
    """Read a request.

    Raises:
        Refusal: a function that is not here, or numbers that it cannot have.
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
    """Write the answer to a request that was done; `values` are those that were read."""
    out = bytes([request.function])
    if request.read is not None:
        return out + bytes([2 * len(values)]) + pack_registers(values)
    assert request.write is not None
    first, written = request.write
    return out + _PAIR.pack(first, written[0] if request.function == WRITE_ONE else len(written))


def encode_exception(function: int, code: ExceptionCode) -> bytes:
    """Write the answer to a request that was not done."""
    return bytes([function | ERROR_BIT, code])


def pack_registers(values: Sequence[int]) -> bytes:
    """Write registers, high byte first."""
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
    if not size == 2 * count == len(data) - _WRITE_HEAD.size:
        raise Refusal(ExceptionCode.ILLEGAL_DATA_VALUE)
    _checked(first, count, most)
    return first, struct.unpack_from(f">{count}H", data, _WRITE_HEAD.size)


def _checked(first: int, count: int, most: int) -> int:
    if not 1 <= count <= most:
        raise Refusal(ExceptionCode.ILLEGAL_DATA_VALUE)
    if first + count > 0x1_0000:
        raise Refusal(ExceptionCode.ILLEGAL_DATA_ADDRESS)
    return count
