"""Structs to CDR and back.

>>> from tickrig.wire.rtc_types.basic import Time, TimedShort
>>> encode(TimedShort(Time(1, 2), -3)).hex()
'0100000002000000fdff'
>>> decode(TimedShort, bytes.fromhex("0000000100000002fffd"), Endian.BIG).data
-3
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from enum import IntEnum, StrEnum
from typing import Annotated, Any, Final, TypeVar, get_args, get_origin, get_type_hints

from tickrig.wire.errors import FieldError
from tickrig.wire.rtc_types.idl import Primitive, Struct

# Bytes of CDR with their alignment (CORBA 3.0, General Inter-ORB Protocol, CDR Transfer Syntax).
#
# A number stands at a multiple of its size, counted from the first byte. The
# bytes before it are padding: written as 0, not looked at.


class Endian(StrEnum):
    """Byte order, in the words of `serializer.cdr.endian`."""

    LITTLE = "little"
    BIG = "big"


_MARKS: Final = {Endian.LITTLE: "<", Endian.BIG: ">"}
_ZEROS: Final = tuple(bytes(count) for count in range(8))


class Number:
    """A kind of number: its letter in the struct module, its size, its layout by byte order."""

    __slots__ = ("layouts", "letter", "size")

    def __init__(self, letter: str) -> None:
        self.letter, self.size = letter, struct.calcsize(f"<{letter}")
        self.layouts = {endian: struct.Struct(mark + letter) for endian, mark in _MARKS.items()}


_ULONG: Final = Number("I")
"""What counts are written as."""


class CdrWriter:
    """Appends values to a stream; struct.error where one does not fit.

    Attributes:
        data: what was written.
    """

    __slots__ = ("_endian", "data")

    def __init__(self, endian: Endian) -> None:
        self._endian, self.data = endian, bytearray()

    def write(self, number: Number, value: object) -> None:
        """Write one number."""
        data = self.data
        data += _ZEROS[-len(data) % number.size]
        data += number.layouts[self._endian].pack(value)

    def write_all(self, number: Number, values: Sequence[object]) -> None:
        """Write a sequence of numbers, behind their count."""
        self.write(_ULONG, len(values))
        if values:
            self.data += _ZEROS[-len(self.data) % number.size]
            layout = f"{_MARKS[self._endian]}{len(values)}{number.letter}"
            self.data += struct.pack(layout, *values)

    def write_bytes(self, data: bytes) -> None:
        """Write bytes behind their count."""
        self.write(_ULONG, len(data))
        self.data += data


class CdrReader:
    """Takes values from a stream; FieldError where it ends too early."""

    __slots__ = ("_at", "_data", "_endian")

    def __init__(self, data: bytes, endian: Endian) -> None:
        self._data, self._at, self._endian = data, 0, endian

    @property
    def left(self) -> int:
        """Number of bytes that were not read."""
        return len(self._data) - self._at

    def read(self, number: Number) -> Any:
        """Read one number."""
        self._at += -self._at % number.size
        return number.layouts[self._endian].unpack(self.take(number.size))[0]

    def read_all(self, number: Number) -> tuple[Any, ...]:
        """Read a sequence of numbers."""
        if not (count := self.read_count()):
            return ()
        self._at += -self._at % number.size
        data = self.take(count * number.size)
        return struct.unpack(f"{_MARKS[self._endian]}{count}{number.letter}", data)

    def read_count(self) -> int:
        """Read the number of elements of a sequence, none of which is empty."""
        count: int = self.read(_ULONG)
        if count > self.left:
            raise FieldError(f"{count} elements announced, {self.left} bytes left")
        return count

    def take(self, count: int) -> bytes:
        """Read bytes as they are."""
        first, self._at = self._at, self._at + count
        if self._at > len(self._data):
            raise FieldError(f"{len(self._data)} bytes, at least {self._at} are needed")
        return self._data[first : self._at]


__all__ = ["Endian", "decode", "encode"]

S = TypeVar("S", bound=Struct)

_Write = Callable[[CdrWriter, Any], None]
_Read = Callable[[CdrReader], Any]
_Codec = tuple[_Write, _Read]


def encode(value: Struct, endian: Endian = Endian.LITTLE) -> bytes:
    """Return the bytes of a struct; FieldError if a field does not fit its IDL type."""
    writer = CdrWriter(endian)
    try:
        _struct(type(value))[0](writer, value)
    except (struct.error, OverflowError, TypeError, ValueError, AttributeError) as error:
        raise FieldError(f"{value!r} is no {type(value).idl_id()}: {error}") from error
    return bytes(writer.data)


def decode(kind: type[S], data: bytes, endian: Endian = Endian.LITTLE) -> S:
    """Return the struct that the bytes hold; FieldError if they hold none, or more."""
    reader = CdrReader(data, endian)
    try:
        value: S = _struct(kind)[1](reader)
    except UnicodeError as error:
        raise FieldError(f"text of {kind.idl_id()}: {error}") from error
    if reader.left:
        raise FieldError(f"{len(data)} bytes for {kind.idl_id()}, {reader.left} too many")
    return value


_CHAR: Final = Number("c")
_OCTET: Final = Number("B")
_NUMBERS: Final[Mapping[Primitive | None, Number]] = {
    Primitive.BOOLEAN: Number("?"),
    Primitive.OCTET: _OCTET,
    Primitive.SHORT: Number("h"),
    Primitive.USHORT: Number("H"),
    Primitive.LONG: Number("i"),
    Primitive.ULONG: _ULONG,
    Primitive.LONGLONG: Number("q"),
    Primitive.ULONGLONG: Number("Q"),
    Primitive.FLOAT: Number("f"),
    Primitive.DOUBLE: Number("d"),
}
_CODECS: Final[dict[type[Struct], _Codec]] = {}
"""Made when a type is first met."""


def _struct(kind: type[Struct]) -> _Codec:
    if kind not in _CODECS:
        _CODECS[kind] = _fields(kind)
    return _CODECS[kind]


def _fields(kind: type[Struct]) -> _Codec:
    hints = get_type_hints(kind, include_extras=True)
    codecs = [(name, *_codec(hints[name])) for name in kind.__match_args__]

    def write(writer: CdrWriter, value: object) -> None:
        for name, write_field, _ in codecs:
            write_field(writer, getattr(value, name))

    def read(reader: CdrReader) -> Struct:
        return kind(*[read_field(reader) for _, _, read_field in codecs])

    return write, read


def _codec(hint: object) -> _Codec:
    """Return how a field with this annotation is written and read."""
    if get_origin(hint) is Annotated:
        return _PRIMITIVES[get_args(hint)[1]]
    if get_origin(hint) is tuple:
        return _sequence(get_args(hint)[0])
    if isinstance(hint, type) and issubclass(hint, IntEnum):
        return _enum(hint)
    if isinstance(hint, type) and issubclass(hint, Struct):
        return _struct(hint)
    raise TypeError(f"{hint} is no IDL type")


def _sequence(hint: object) -> _Codec:
    primitive = get_args(hint)[1] if get_origin(hint) is Annotated else None
    if (number := _NUMBERS.get(primitive)) is not None:
        return (
            lambda writer, values: writer.write_all(number, values),
            lambda reader: reader.read_all(number),
        )
    write_one, read_one = _codec(hint)

    def write(writer: CdrWriter, values: tuple[object, ...]) -> None:
        writer.write(_ULONG, len(values))
        for value in values:
            write_one(writer, value)

    def read(reader: CdrReader) -> tuple[object, ...]:
        return tuple(read_one(reader) for _ in range(reader.read_count()))

    return write, read


def _number(number: Number) -> _Codec:
    return (
        lambda writer, value: writer.write(number, value),
        lambda reader: reader.read(number),
    )


def _enum(kind: type[IntEnum]) -> _Codec:
    def read(reader: CdrReader) -> IntEnum:
        number = reader.read(_ULONG)
        try:
            return kind(number)
        except ValueError as error:
            raise FieldError(str(error)) from error

    return lambda writer, value: writer.write(_ULONG, kind(value)), read


def _write_char(writer: CdrWriter, value: str) -> None:
    writer.write(_CHAR, value.encode("latin-1"))


def _read_char(reader: CdrReader) -> str:
    return reader.take(1).decode("latin-1")


def _write_string(writer: CdrWriter, value: str) -> None:
    if "\0" in value:
        raise TypeError("a string with NUL")
    writer.write_bytes(value.encode() + b"\0")


def _read_string(reader: CdrReader) -> str:
    text, end = (data := reader.take(reader.read_count()))[:-1], data[-1:]
    if end != b"\0" or b"\0" in text:
        raise FieldError(f"{data!r} is not a string that ends in NUL")
    return text.decode()


def _write_wchar(writer: CdrWriter, value: str) -> None:
    data = value.encode("utf-16-be")
    if len(data) != 2:
        raise TypeError(f"{value!r} is not one character of UTF-16")
    writer.write(_OCTET, len(data))
    writer.data += data


def _read_wchar(reader: CdrReader) -> str:
    text = _utf16(reader.take(reader.read(_OCTET)))
    if len(text) != 1 or ord(text) > 0xFFFF:
        raise FieldError(f"{text!r} is not one character of UTF-16")
    return text


def _write_wstring(writer: CdrWriter, value: str) -> None:
    writer.write_bytes(value.encode("utf-16-be"))


def _utf16(data: bytes) -> str:
    """Decode UTF-16; big-endian unless its byte order mark says otherwise (GIOP 1.2)."""
    return data.decode("utf-16" if data[:2] in (b"\xfe\xff", b"\xff\xfe") else "utf-16-be")


_PRIMITIVES: Final[dict[Primitive, _Codec]] = {
    **{primitive: _number(number) for primitive, number in _NUMBERS.items() if primitive},
    Primitive.CHAR: (_write_char, _read_char),
    Primitive.WCHAR: (_write_wchar, _read_wchar),
    Primitive.STRING: (_write_string, _read_string),
    Primitive.WSTRING: (
        _write_wstring,
        lambda reader: _utf16(reader.take(reader.read_count())),
    ),
    Primitive.OCTET_SEQ: (
        lambda writer, value: writer.write_bytes(value),
        lambda reader: reader.take(reader.read_count()),
    ),
}
