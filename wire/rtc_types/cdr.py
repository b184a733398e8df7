"""Encode structs as CDR and decode them.

>>> from tickrig.wire.rtc_types.rtc import Time, TimedShort
>>> encode(TimedShort(Time(1, 2), -3)).hex()
'0100000002000000fdff'
>>> decode(TimedShort, bytes.fromhex("0000000100000002fffd"), Endian.BIG).data
-3
"""

# Theory of operation
#
# CDR (CORBA 3.0, chapter 15) writes the fields of a struct one after the other. A number starts at
# a multiple of its size, counted from the first byte of the encoding. The bytes before it are
# padding, written as 0 and ignored when read. A sequence is an unsigned long with the number of its
# elements, then the elements. A string is an unsigned long with its length, the bytes in UTF-8, and
# a NUL. The length includes the NUL.
#
# For each struct and byte order, `_Codec` writes the Python source of an encoder and a decoder at
# the first use. Both come from one walk through the fields, so that they cannot disagree:
#
# - Consecutive numbers are a *run*: one `struct.Struct`, with its padding as `x`. The fields of a
#   struct within the struct belong to the run of their neighbours.
# - A run ends where the position is no longer known. This happens at a string or a sequence. It
#   also happens where a number needs more alignment than the length of the last string or sequence
#   guarantees. `_aligned` and `_phase` hold the known part of the position: the next byte is at
#   `_phase` modulo `_aligned`. The first byte is at 0 modulo 8. After a string the position is 0
#   modulo 1, so nothing is known and the code pads at run time.
# - Elements that are numbers or structs of numbers, and need no padding among them (`Pose2D`), are
#   read and written by one call for the sequence or one for each element. Other elements need a
#   loop.
# - An enumerator ends its run, because it is checked. Of two faults in a message the first one is
#   reported, and the error of a run that is too short must not hide it.
#
# The source contains names of fields and classes, constants (`c0`) and variables (`v1`). Nothing in
# it comes from a message.

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from enum import IntEnum, StrEnum
from functools import cache
from typing import Annotated, Any, Final, TypeVar, cast, get_args, get_origin, get_type_hints

from tickrig.wire.errors import FieldError
from tickrig.wire.rtc_types.idl import Primitive, Struct, define


class Endian(StrEnum):
    """Byte order, in the words of `serializer.cdr.endian`."""

    LITTLE = "little"
    BIG = "big"


__all__ = ["Endian", "decode", "encode"]

S = TypeVar("S", bound=Struct)

_Encode = Callable[[Struct], bytes]
_Decode = Callable[[bytes], tuple[Any, int]]


def encode(value: Struct, endian: Endian = Endian.LITTLE) -> bytes:
    """Encode a struct of an IDL file as bytes in CDR, the format of CORBA.

    Raises:
        FieldError: a field does not fit its IDL type.
    """
    coder = _codec(type(value), endian)[0]
    try:
        return coder(value)
    except (struct.error, OverflowError, TypeError, ValueError, AttributeError) as error:
        raise FieldError(f"{value!r} is no {type(value).idl_id()}: {error}") from error


def decode(kind: type[S], data: bytes, endian: Endian = Endian.LITTLE) -> S:
    """Decode bytes in CDR, the format of CORBA, into a struct of an IDL file.

    Raises:
        FieldError: the bytes are not one struct of this kind.
    """
    try:
        value, end = _codec(kind, endian)[1](data)
    except UnicodeError as error:
        raise FieldError(f"text of {kind.idl_id()}: {error}") from error
    if left := len(data) - end:
        raise FieldError(f"{len(data)} bytes for {kind.idl_id()}, {left} too many")
    return cast(S, value)


@cache
def _codec(kind: type[Struct], endian: Endian) -> tuple[_Encode, _Decode]:
    """Compile the encoder and the decoder of a struct."""
    return _Codec(kind, _MARKS[endian]).compiled()


_MARKS: Final = {Endian.LITTLE: "<", Endian.BIG: ">"}
_NUMBERS: Final[Mapping[Primitive, str]] = {
    Primitive.BOOLEAN: "?",
    Primitive.OCTET: "B",
    Primitive.SHORT: "h",
    Primitive.USHORT: "H",
    Primitive.LONG: "i",
    Primitive.ULONG: "I",
    Primitive.LONGLONG: "q",
    Primitive.ULONGLONG: "Q",
    Primitive.FLOAT: "f",
    Primitive.DOUBLE: "d",
}
"""Formats of the struct module, by IDL type."""

_COUNT: Final = "I"
"""Format of counts and enumerators."""


class _Codec:
    """Generates the source of the encoder and the decoder of a struct."""

    def __init__(self, kind: type[Struct], mark: str) -> None:
        self._kind, self._mark = kind, mark
        self._scope: dict[str, Any] = dict(_HELPERS)
        self._encoder, self._decoder = list[str](), list[str]()
        self._indent, self._names = " ", 0
        self._aligned, self._phase = 8, 0
        self._format, self._values, self._targets = "", list[str](), list[str]()
        self._making = list[str]()

    def compiled(self) -> tuple[_Encode, _Decode]:
        """Return the functions."""
        value = self._field(self._kind, "value")
        if self._encoder or not self._targets:
            self._flush()
            encoder = [" out = bytearray()", *self._encoder, " return bytes(out)"]
        else:  # a single run
            self._flush()
            encoder = [self._encoder[0].replace("out +=", "return")]
        making = [f" {line}" for line in self._making]
        decoder = [" at, size = 0, len(data)", *self._decoder, *making, f" return {value}, at"]
        source = "\n".join(["def encode(value):", *encoder, "def decode(data):", *decoder])
        define(source, self._scope)
        return self._scope["encode"], self._scope["decode"]

    def _field(self, hint: Any, path: str) -> str:
        """Generate the code of one field.

        Args:
            hint: annotation of the field.
            path: expression of the encoder for the value of the field.

        Returns:
            The decoder's expression for the value. The names in the expression are set before it.
        """
        if get_origin(hint) is Annotated:
            return self._primitive(get_args(hint)[1], path)
        if get_origin(hint) is tuple:
            return self._sequence(get_args(hint)[0], path)
        if isinstance(hint, type) and issubclass(hint, IntEnum):
            kind = self._constant(hint)
            number = self._number(_COUNT, f"{kind}({path})")
            self._flush()
            return self._read(f"enumerator({kind}, {number})")
        if isinstance(hint, type) and issubclass(hint, Struct):
            hints = get_type_hints(hint, include_extras=True)
            fields = hint.__match_args__
            return self._made(hint, [self._field(hints[name], f"{path}.{name}") for name in fields])
        raise TypeError(f"{hint} is no IDL type")

    def _made(self, kind: type[Struct], parts: list[str]) -> str:
        """Build a struct from its parts, a third faster than by a call of its class."""
        made = self._name()
        self._making.append(f"{made} = new({self._constant(kind)})")
        for name, part in zip(kind.__match_args__, parts, strict=True):
            put = self._constant(getattr(kind, name).__set__)
            self._making.append(f"{put}({made}, {part})")
        return made

    def _primitive(self, kind: Primitive, path: str) -> str:
        match kind:
            case Primitive.CHAR:
                return self._number("c", f"{path}.encode('latin-1')") + ".decode('latin-1')"
            case Primitive.WCHAR:
                return self._read(f"wchar({self._bytes(f'wchar_bytes({path})', 'B')})")
            case Primitive.STRING:
                return self._read(f"string({self._bytes(f'string_bytes({path})')})")
            case Primitive.WSTRING:
                return self._read(f"utf16({self._bytes(f'{path}.encode({_UTF16!r})')})")
            case Primitive.OCTET_SEQ:
                return self._bytes(path)
            case _:
                return self._number(_NUMBERS[kind], path)

    def _number(self, letter: str, value: str, name: str = "") -> str:
        """Add a number to the run; start a new run if its alignment is not known."""
        name = name or self._name()
        size = struct.calcsize(f"={letter}")
        if self._aligned < size:
            self._flush()
            self._pad(size)
        padding = -self._phase % size
        self._format += "x" * padding + letter
        self._phase = (self._phase + padding + size) % self._aligned
        self._values.append(value)
        self._targets.append(name)
        return name

    def _pad(self, size: int) -> None:
        self._write(f"out += zeros[-len(out) % {size}]")
        self._take(f"at += -at % {size}")
        self._aligned, self._phase = size, 0

    def _flush(self) -> None:
        """Generate the code of the run."""
        if self._targets:
            run = self._constant(layout := struct.Struct(self._mark + self._format))
            ends, size = self._constant(_ends(self._format)), layout.size
            self._write(f"out += {run}.pack({', '.join(self._values)})")
            self._take(f"if at + {size} > size: too_short(at, size, {ends})")
            self._take(f"{', '.join(self._targets)}, = {run}.unpack_from(data, at)")
            self._take(f"at += {size}")
        self._format, self._values, self._targets = "", [], []

    def _count(self, value: str, letter: str = _COUNT) -> str:
        """Generate the code of a sequence length, and return its variable."""
        name = self._name()
        self._write(f"{name} = len({value})")
        self._number(letter, name, name)
        self._flush()
        return name

    def _bytes(self, value: str, letter: str = _COUNT) -> str:
        """Generate the code of bytes after their count."""
        data = self._name()
        self._write(f"{data} = {value}")
        count = self._count(data, letter)
        self._write(f"out += {data}")
        refusal = f"too_many(at, size, {count})"
        if letter != _COUNT:
            refusal = f"too_short(at, size, ({count},))"
        self._take(f"if at + {count} > size: {refusal}")
        self._take(f"{data} = data[at : at + {count}]; at += {count}")
        self._aligned, self._phase = 1, 0
        return data

    def _sequence(self, hint: Any, path: str) -> str:
        count = self._count(path)
        self._take(f"if at + {count} > size: too_many(at, size, {count})")
        if not _is_tight(letters := _letters(hint)):
            return self._loop(hint, path, count)
        made, size = self._name(), struct.calcsize(f"={letters[0]}")
        self._write(f"if {count}:")
        self._take(f"{made} = ()")
        self._take(f"if {count}:")
        self._indent += " "
        self._pad(size)
        if get_origin(hint) is Annotated:
            self._numbers(letters, path, count, made)
        else:
            self._structs(hint, path, count, made)
        self._indent = self._indent[:-1]
        self._aligned, self._phase = min(size, 4), 0
        return made

    def _numbers(self, letter: str, path: str, count: str, made: str) -> None:
        """Generate the code of all numbers of a sequence at once."""
        layout, length = f"f'{self._mark}{{{count}}}{letter}'", self._name()
        self._write(f"out += pack({layout}, *{path})")
        self._take(f"{length} = {count} * {struct.calcsize(f'={letter}')}")
        self._take(f"if at + {length} > size: too_short(at, size, ({length},))")
        self._take(f"{made} = unpack_from({layout}, data, at)")
        self._take(f"at += {length}")

    def _structs(self, hint: Any, path: str, count: str, made: str) -> None:
        """Generate one run for each struct of numbers, 2 to 4 times as fast as a loop."""
        element, end = self._name(), self._name()
        outer, self._making = self._making, []
        value = self._field(hint, element)  # only adds to the run, for its size is fixed
        run = self._constant(layout := struct.Struct(self._mark + self._format))
        ends = self._constant(_ends(self._format))
        values, targets = ", ".join(self._values), ", ".join(self._targets)
        self._write(f"out += b''.join([{run}.pack({values}) for {element} in {path}])")
        self._take(f"{end} = at + {count} * {layout.size}")
        self._take(f"if {end} > size: too_short(at, size, {ends})")
        self._take(f"{made} = []")
        self._take(f"for {targets}, in {run}.iter_unpack(data[at:{end}]):")
        self._append(made, value)
        self._take(f"at = {end}")
        self._format, self._values, self._targets, self._making = "", [], [], outer

    def _loop(self, hint: Any, path: str, count: str) -> str:
        """Generate a loop over the elements."""
        made, element = self._name(), self._name()
        self._write(f"for {element} in {path}:")
        self._take(f"{made} = []")
        self._take(f"for {element} in range({count}):")
        self._indent += " "
        self._aligned, self._phase = 1, 0
        outer, self._making = self._making, []
        value = self._field(hint, element)
        self._flush()
        self._write("pass")  # an element may be empty
        self._indent = self._indent[:-1]
        self._append(made, value)
        self._making = outer
        self._aligned, self._phase = 1, 0
        return made

    def _append(self, made: str, value: str) -> None:
        """End the decoder's loop over the elements of a sequence."""
        for line in (*self._making, f"{made}.append({value})"):
            self._take(f" {line}")
        self._take(f"{made} = tuple({made})")

    def _write(self, line: str) -> None:
        self._encoder.append(self._indent + line)

    def _take(self, line: str) -> None:
        self._decoder.append(self._indent + line)

    def _read(self, expression: str) -> str:
        """Make the decoder check a value at once, so that the decoder reports the first fault."""
        name = self._name()
        self._take(f"{name} = {expression}")
        return name

    def _name(self) -> str:
        self._names += 1
        return f"v{self._names}"

    def _constant(self, value: object) -> str:
        name = f"c{len(self._scope)}"
        self._scope[name] = value
        return name


def _letters(hint: Any) -> str:
    """Return the formats of all numbers in an element, or nothing if it has other parts."""
    if get_origin(hint) is Annotated:
        return _NUMBERS.get(get_args(hint)[1], "")
    if not (isinstance(hint, type) and issubclass(hint, Struct)):
        return ""
    hints = get_type_hints(hint, include_extras=True)
    parts = [_letters(hints[name]) for name in hint.__match_args__]
    return "".join(parts) if all(parts) else ""


def _is_tight(letters: str) -> bool:
    """Return whether elements follow each other without padding from any position."""
    sizes = [struct.calcsize(f"={letter}") for letter in letters]
    end = 0
    for size in sizes:
        end += -end % size + size
    return bool(sizes) and sizes[0] == max(sizes) and not end % sizes[0]


def _ends(layout: str) -> tuple[int, ...]:
    """Return the position of the end of each number of a run."""
    return tuple(
        struct.calcsize(f"={layout[: n + 1]}") for n, letter in enumerate(layout) if letter != "x"
    )


# Helpers of the functions: refusals, strings and characters.

_UTF16: Final = "utf-16-be"


def _too_short(at: int, size: int, ends: tuple[int, ...]) -> None:
    """Raise FieldError for a run, or several runs, at the first missing number."""
    at += max(size - at, 0) // ends[-1] * ends[-1]
    needed = next(at + end for end in ends if at + end > size)
    raise FieldError(f"{size} bytes, at least {needed} are needed")


def _too_many(at: int, size: int, count: int) -> None:
    raise FieldError(f"{count} elements announced, {size - at} bytes left")


def _enumerator(kind: type[IntEnum], number: int) -> IntEnum:
    try:
        return kind(number)
    except ValueError as error:
        raise FieldError(str(error)) from error


def _string_bytes(value: str) -> bytes:
    if "\0" in value:
        raise TypeError("a string with NUL")
    return value.encode() + b"\0"


def _string(data: bytes) -> str:
    text, end = data[:-1], data[-1:]
    if end != b"\0" or b"\0" in text:
        raise FieldError(f"{data!r} is not a string that ends in NUL")
    return text.decode()


def _wchar_bytes(value: str) -> bytes:
    data = value.encode(_UTF16)
    if len(data) != 2:
        raise TypeError(f"{value!r} is not one character of UTF-16")
    return data


def _wchar(data: bytes) -> str:
    text = _utf16(data)
    if len(text) != 1 or ord(text) > 0xFFFF:
        raise FieldError(f"{text!r} is not one character of UTF-16")
    return text


def _utf16(data: bytes) -> str:
    """Decode UTF-16, which is big-endian without a byte order mark (GIOP 1.2)."""
    return data.decode("utf-16" if data[:2] in (b"\xfe\xff", b"\xff\xfe") else _UTF16)


_HELPERS: Final[Mapping[str, object]] = {
    "new": object.__new__,
    "pack": struct.pack,
    "unpack_from": struct.unpack_from,
    "zeros": tuple(bytes(count) for count in range(8)),
    "too_short": _too_short,
    "too_many": _too_many,
    "enumerator": _enumerator,
    "string_bytes": _string_bytes,
    "string": _string,
    "wchar_bytes": _wchar_bytes,
    "wchar": _wchar,
    "utf16": _utf16,
}
