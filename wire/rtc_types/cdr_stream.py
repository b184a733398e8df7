"""Bytes of CDR with their alignment (CORBA 3.0, General Inter-ORB Protocol, CDR Transfer Syntax).

A number stands at a multiple of its size, counted from the first byte. The
bytes before it are padding: written as 0, not looked at.
"""

from __future__ import annotations

import struct
from enum import StrEnum
from typing import Any, Final

from tickrig.wire.errors import FieldError


class Endian(StrEnum):
    """Byte order, in the words of `serializer.cdr.endian`."""

    LITTLE = "little"
    BIG = "big"


_MARKS: Final = {Endian.LITTLE: "<", Endian.BIG: ">"}


class CdrWriter:
    """Appends values to a stream.

    Attributes:
        data: what was written.
    """

    __slots__ = ("_mark", "data")

    def __init__(self, endian: Endian) -> None:
        self._mark, self.data = _MARKS[endian], bytearray()

    def write(self, layout: str, size: int, *values: object) -> None:
        """Write numbers of one kind; struct.error if one does not fit.

        Args:
            layout: their letter in the struct module.
            size: size of one.
            values: the numbers.
        """
        data = self.data
        data += bytes(-len(data) % size) if values else b""
        data += struct.pack(f"{self._mark}{len(values)}{layout}", *values)

    def write_bytes(self, data: bytes) -> None:
        """Write bytes behind their number."""
        self.write("I", 4, len(data))
        self.data += data


class CdrReader:
    """Takes values from a stream; FieldError where it ends too early."""

    __slots__ = ("_at", "_data", "_mark")

    def __init__(self, data: bytes, endian: Endian) -> None:
        self._data, self._at, self._mark = data, 0, _MARKS[endian]

    @property
    def left(self) -> int:
        """Number of bytes that were not read."""
        return len(self._data) - self._at

    def read(self, layout: str, size: int, count: int) -> tuple[Any, ...]:
        """Read `count` numbers of one kind; see `CdrWriter.write`."""
        if count:
            self._at += -self._at % size
        return struct.unpack(f"{self._mark}{count}{layout}", self.take(count * size))

    def read_count(self) -> int:
        """Read the number of elements of a sequence, none of which is empty."""
        count: int = self.read("I", 4, 1)[0]
        if count > self.left:
            raise FieldError(f"{count} elements announced, {self.left} bytes left")
        return count

    def take(self, count: int) -> bytes:
        """Read bytes as they are."""
        first, self._at = self._at, self._at + count
        if self._at > len(self._data):
            raise FieldError(f"{len(self._data)} bytes, at least {self._at} are needed")
        return self._data[first : self._at]
