"""Bytes of CDR with their alignment (CORBA 3.0, General Inter-ORB Protocol, CDR Transfer Syntax).

A number stands at a multiple of its size, counted from the first byte. The
bytes before it are padding: written as 0, not looked at.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from enum import StrEnum
from typing import Any, Final

from tickrig.wire.errors import FieldError


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


ULONG: Final = Number("I")
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
        self.write(ULONG, len(values))
        if values:
            self.data += _ZEROS[-len(self.data) % number.size]
            layout = f"{_MARKS[self._endian]}{len(values)}{number.letter}"
            self.data += struct.pack(layout, *values)

    def write_bytes(self, data: bytes) -> None:
        """Write bytes behind their count."""
        self.write(ULONG, len(data))
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
        count: int = self.read(ULONG)
        if count > self.left:
            raise FieldError(f"{count} elements announced, {self.left} bytes left")
        return count

    def take(self, count: int) -> bytes:
        """Read bytes as they are."""
        first, self._at = self._at, self._at + count
        if self._at > len(self._data):
            raise FieldError(f"{len(self._data)} bytes, at least {self._at} are needed")
        return self._data[first : self._at]
