"""Data types of CANopen: numbers, strings and their little-endian bytes (CiA 301, data types).

TIME stamp object: milliseconds since midnight and days since 1984 (CiA 301, TIME_OF_DAY).

>>> TimeOfDay.parse(bytes.fromhex("B0A429043143"))
TimeOfDay(ms=69838000, days=17201)
>>> TimeOfDay(69838000, 17201).encode().hex().upper()
'B0A429043143'
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from enum import IntEnum
from typing import Final, NamedTuple

from tickrig.wire.errors import FieldError, FramingError

Value = bool | int | float | str | bytes
"""The value of an object. Strings are str, and octet strings and domains are bytes."""


class DataType(IntEnum):
    """Data type by its index in the dictionary, as in an EDS."""

    BOOLEAN = 0x01
    INTEGER8 = 0x02
    INTEGER16 = 0x03
    INTEGER32 = 0x04
    UNSIGNED8 = 0x05
    UNSIGNED16 = 0x06
    UNSIGNED32 = 0x07
    REAL32 = 0x08
    VISIBLE_STRING = 0x09
    OCTET_STRING = 0x0A
    UNICODE_STRING = 0x0B
    TIME_OF_DAY = 0x0C
    TIME_DIFFERENCE = 0x0D
    DOMAIN = 0x0F
    INTEGER24 = 0x10
    REAL64 = 0x11
    INTEGER40 = 0x12
    INTEGER48 = 0x13
    INTEGER56 = 0x14
    INTEGER64 = 0x15
    UNSIGNED24 = 0x16
    UNSIGNED40 = 0x18
    UNSIGNED48 = 0x19
    UNSIGNED56 = 0x1A
    UNSIGNED64 = 0x1B
    VISIBLE_CHAR = 0xA0
    """Type of one character, which is not in CiA 301, but in Table 4 of RTC-CANopen (NEDO report,
    3.4.43.3)."""

    @property
    def bits(self) -> int:
        """Size in bits, or 0 if the size varies."""
        return _BITS.get(self, 0)

    @property
    def size(self) -> int:
        """Size in bytes, or 0 if the size varies."""
        return (self.bits + 7) // 8

    @property
    def signed(self) -> bool:
        """Whether the type is a signed integer."""
        return self in _SIGNED

    @property
    def is_integer(self) -> bool:
        """Whether values of this data type are whole numbers.

        BOOLEAN counts as a number of one bit.
        """
        return self in _SIGNED or self in _UNSIGNED

    @property
    def limits(self) -> tuple[int, int]:
        """The smallest and the largest number of an integer."""
        lowest = -(1 << self.bits - 1) if self.signed else 0
        return lowest, lowest + (1 << self.bits) - 1

    def encode(self, value: Value) -> bytes:
        """Encode a value of this data type as bytes, little endian (CiA 301, 7.1.4).

        Args:
            value: number in the range of this type, or a text, or bytes.

        Raises:
            FieldError: the value does not fit the data type.
        """
        try:
            return _encode(self, value)
        except (struct.error, OverflowError, TypeError, UnicodeError, AttributeError) as error:
            raise FieldError(f"{value!r} is no {self.name}") from error

    def decode(self, data: bytes) -> Value:
        """Decode bytes into a value of this data type.

        Args:
            data: bytes, as in an SDO or a PDO.

        Raises:
            FieldError: the number of bytes does not fit this type.
        """
        size, decode = _DECODERS[self]
        if size and len(data) != size:
            raise FieldError(f"{len(data)} bytes for {self.name}, which has {size}")
        return decode(data)


_SIGNED: Final = {
    DataType.INTEGER8: 8,
    DataType.INTEGER16: 16,
    DataType.INTEGER24: 24,
    DataType.INTEGER32: 32,
    DataType.INTEGER40: 40,
    DataType.INTEGER48: 48,
    DataType.INTEGER56: 56,
    DataType.INTEGER64: 64,
}
_UNSIGNED: Final = {
    DataType.BOOLEAN: 1,
    DataType.UNSIGNED8: 8,
    DataType.UNSIGNED16: 16,
    DataType.UNSIGNED24: 24,
    DataType.UNSIGNED32: 32,
    DataType.UNSIGNED40: 40,
    DataType.UNSIGNED48: 48,
    DataType.UNSIGNED56: 56,
    DataType.UNSIGNED64: 64,
}
_OTHER: Final = {
    DataType.REAL32: 32,
    DataType.REAL64: 64,
    DataType.TIME_OF_DAY: 48,
    DataType.TIME_DIFFERENCE: 48,
    DataType.VISIBLE_CHAR: 8,
}
_BITS: Final = {**_SIGNED, **_UNSIGNED, **_OTHER}
_FLOATS: Final = {DataType.REAL32: "<f", DataType.REAL64: "<d"}
_TEXTS: Final = {
    DataType.VISIBLE_STRING: "latin-1",
    DataType.UNICODE_STRING: "utf-16-le",
    DataType.VISIBLE_CHAR: "latin-1",
}


def _float_decoder(layout: str) -> Callable[[bytes], float]:
    def decode(data: bytes) -> float:
        value: float = struct.unpack(layout, data)[0]
        return value

    return decode


def _integer_decoder(signed: bool) -> Callable[[bytes], int]:
    return lambda data: int.from_bytes(data, "little", signed=signed)


_DECODE: Final[dict[DataType, Callable[[bytes], Value]]] = {
    **{kind: _integer_decoder(kind.signed) for kind in (*_SIGNED, *_UNSIGNED)},
    **{kind: _float_decoder(layout) for kind, layout in _FLOATS.items()},
    DataType.VISIBLE_STRING: lambda data: data.decode("latin-1"),
    DataType.VISIBLE_CHAR: lambda data: data.decode("latin-1"),
    DataType.UNICODE_STRING: lambda data: data.decode("utf-16-le", "replace"),
}

_DECODERS: Final = {kind: (kind.size, _DECODE.get(kind, bytes)) for kind in DataType}
"""Size in bytes and reader, by data type, for a single look-up."""


def _encode(kind: DataType, value: Value) -> bytes:
    if kind.is_integer:
        if not isinstance(value, int):
            raise TypeError
        if kind is DataType.BOOLEAN:
            value = int(bool(value))
        return value.to_bytes(kind.size, "little", signed=kind.signed)
    if kind in _FLOATS:
        return struct.pack(_FLOATS[kind], value)
    if isinstance(value, str):
        value = value.encode(_TEXTS.get(kind, "ascii"))
    if not isinstance(value, bytes) or (kind.size and len(value) != kind.size):
        raise TypeError
    return value


DAY_MS: Final = 86_400_000
_MAX_DAYS: Final = 0xFFFF

# B0 A4 29 04 31 43: 28 bits of milliseconds, 4 reserved, 16 bits of days.
_LAYOUT: Final = struct.Struct("<IH")
_MS_MASK: Final = 0x0FFF_FFFF
"""Mask of the milliseconds, whose upper four bits are reserved."""


class TimeOfDay(NamedTuple):
    """A time of day with its date, as in a TIME message of CANopen.

    Attributes:
        ms: number of milliseconds after midnight, 0 to 86 399 999.
        days: number of days since 1 January 1984, 0 to 65 535.
    """

    ms: int
    days: int

    @classmethod
    def parse(cls, data: bytes) -> TimeOfDay:
        """Read a time of day from the bytes of a TIME message.

        Raises:
            FramingError: the data do not have 6 bytes.
            FieldError: the time is invalid.
        """
        if len(data) != _LAYOUT.size:
            raise FramingError(f"a TIME stamp of {len(data)} bytes, it has {_LAYOUT.size}")
        ms, days = _LAYOUT.unpack(data)
        return cls(ms & _MS_MASK, days).checked()

    def checked(self) -> TimeOfDay:
        """Return the time itself; raise FieldError if it is invalid."""
        if not 0 <= self.ms < DAY_MS:
            raise FieldError(f"{self.ms} ms after midnight, a day has {DAY_MS}")
        if not 0 <= self.days <= _MAX_DAYS:
            raise FieldError(f"{self.days} days, 0 to {_MAX_DAYS} fit")
        return self

    def encode(self) -> bytes:
        """Return the six bytes; raise FieldError if the time is invalid."""
        return _LAYOUT.pack(*self.checked())

    def after(self, elapsed_us: int) -> TimeOfDay:
        """Return the time some microseconds later; the days wrap after 65 535.

        >>> TimeOfDay(DAY_MS - 1, 7).after(1_500)
        TimeOfDay(ms=0, days=8)
        """
        days, ms = divmod(self.ms + elapsed_us // 1_000, DAY_MS)
        return TimeOfDay(ms, (self.days + days) & _MAX_DAYS)
