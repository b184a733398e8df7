"""Data types of ports and of objects (NEDO report, table 4; ours: K5).

A PDO has room for one 64-bit value: those have no sequence. INTEGER8, which RTC
has not, is a short. The canopen library reads A0h, VISIBLE_CHAR, as DOMAIN; no
other DOMAIN has 8 bits.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.rtc_types import basic
from tickrig.wire.rtc_types.idl import Struct
from tickrig.wire.rtc_types.long_long import TimedLongLong, TimedULongLong

Value = bool | int | float | str


@dataclass(frozen=True, slots=True)
class PortType:
    """How objects of a data type are seen at ports.

    Attributes:
        one: of a port for one object.
        many: of a port for several, None if two do not fit into a PDO.
        bits: of one object in a PDO.
        decode: makes a value of these bits.
        encode: makes these bits; ValueError or TypeError if the value does not fit.
    """

    one: type[Struct]
    many: type[Struct] | None
    bits: int
    decode: Callable[[int], Value]
    encode: Callable[[Value], int]


def _integer(
    one: type[Struct], many: type[Struct] | None, bits: int, *, signed: bool = False
) -> PortType:
    top = 1 << bits
    low, high = (-top // 2, top // 2) if signed else (0, top)

    def encode(value: Value) -> int:
        if not isinstance(value, int) or not low <= value < high:
            raise ValueError(f"{value!r} is not in {low}..{high - 1}")
        return value & top - 1

    def decode_signed(number: int) -> int:
        return number - top if number >= high else number

    return PortType(one, many, bits, decode_signed if signed else int, encode)


def _real(one: type[Struct], many: type[Struct] | None, layout: str) -> PortType:
    packer = struct.Struct(layout)

    def decode(number: int) -> float:
        value: float = packer.unpack(number.to_bytes(packer.size, "little"))[0]
        return value

    def encode(value: Value) -> int:
        try:
            return int.from_bytes(packer.pack(value), "little")
        except (struct.error, OverflowError) as error:
            raise ValueError(f"{value!r} is no real number of {8 * packer.size} bits") from error

    return PortType(one, many, 8 * packer.size, decode, encode)


def _encode_char(value: Value) -> int:
    if not isinstance(value, str) or len(value) != 1 or ord(value) > 0xFF:
        raise ValueError(f"{value!r} is not one character of 8 bits")
    return ord(value)


def _boolean(bits: int) -> PortType:
    return PortType(
        basic.TimedBoolean, basic.TimedBooleanSeq, bits, bool, lambda value: int(bool(value))
    )


PORT_TYPES: Final[Mapping[tuple[int, int], PortType]] = {
    (DataType.BOOLEAN, 1): _boolean(1),
    (DataType.BOOLEAN, 8): _boolean(8),
    (DataType.UNSIGNED8, 8): _integer(basic.TimedOctet, basic.TimedOctetSeq, 8),
    (DataType.DOMAIN, 8): PortType(basic.TimedChar, basic.TimedCharSeq, 8, chr, _encode_char),
    (DataType.INTEGER8, 8): _integer(basic.TimedShort, basic.TimedShortSeq, 8, signed=True),
    (DataType.INTEGER16, 16): _integer(basic.TimedShort, basic.TimedShortSeq, 16, signed=True),
    (DataType.UNSIGNED16, 16): _integer(basic.TimedUShort, basic.TimedUShortSeq, 16),
    (DataType.INTEGER32, 32): _integer(basic.TimedLong, basic.TimedLongSeq, 32, signed=True),
    (DataType.UNSIGNED32, 32): _integer(basic.TimedULong, basic.TimedULongSeq, 32),
    (DataType.REAL32, 32): _real(basic.TimedFloat, basic.TimedFloatSeq, "<f"),
    (DataType.REAL64, 64): _real(basic.TimedDouble, None, "<d"),
    (DataType.UNSIGNED64, 64): _integer(TimedULongLong, None, 64),
    (DataType.INTEGER64, 64): _integer(TimedLongLong, None, 64, signed=True),
}
"""By data type and bits in the PDO; strings are not among them."""
