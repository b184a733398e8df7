"""Structs to CDR and back.

>>> from tickrig.wire.rtc_types.basic import Time, TimedShort
>>> encode(TimedShort(Time(1, 2), -3)).hex()
'0100000002000000fdff'
>>> decode(TimedShort, bytes.fromhex("0000000100000002fffd"), Endian.BIG).data
-3
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from enum import IntEnum
from typing import Annotated, Any, Final, TypeVar, get_args, get_origin, get_type_hints

from tickrig.wire.errors import FieldError
from tickrig.wire.rtc_types.cdr_stream import ULONG, CdrReader, CdrWriter, Endian, Number
from tickrig.wire.rtc_types.idl import Primitive, Struct

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
    Primitive.ULONG: ULONG,
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
        writer.write(ULONG, len(values))
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
        number = reader.read(ULONG)
        try:
            return kind(number)
        except ValueError as error:
            raise FieldError(str(error)) from error

    return lambda writer, value: writer.write(ULONG, kind(value)), read


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
