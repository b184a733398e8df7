r"""The data types of ports and their bytes (DECISION L8, L10).

Little-endian; the time of a Timed type is not on the wire. A double has 4
bytes, as on AVR: values lose precision. A sequence is its elements; their
number follows from the size.

>>> LONG.encode(-2), LONG.decode(b"\x2a\x00\x00\x00")
(b'\xfe\xff\xff\xff', 42)
>>> SHORT_SEQ.encode((1, -1)).hex(" "), CHAR_SEQ.decode(b"RT")
('01 00 ff ff', 'RT')
"""

from __future__ import annotations

import struct
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final, Generic, TypeVar

from tickrig.wire.errors import FieldError

MAX_NAME_BYTES: Final = 15


def encode_name(name: str) -> bytes:
    """Write a name of 1 to 15 printable ASCII characters without blanks (DECISION L6).

    Raises:
        FieldError: it is empty, too long, or has other characters.
    """
    if not 1 <= len(name) <= MAX_NAME_BYTES:
        raise FieldError(f"name {name!r} has {len(name)} characters, 1..{MAX_NAME_BYTES} fit")
    if not all("!" <= character <= "~" for character in name):
        raise FieldError(f"name {name!r} is not printable ASCII without blanks")
    return name.encode("ascii")


T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class LitePortType(ABC, Generic[T]):
    """A data type of a port.

    Attributes:
        code: its letter; upper case for a sequence.
        name: the type of the port at the proxy, as `TimedLong`.
        size: bytes of a value, of an element in a sequence.
    """

    code: str
    name: str
    size: int

    @property
    def sequence(self) -> bool:
        """Whether a value is any number of elements."""
        return self.code.isupper()

    @property
    @abstractmethod
    def initial(self) -> T:
        """The value before any was written."""

    @abstractmethod
    def encode(self, value: T) -> bytes:
        """Write a value; FieldError if the type does not have it."""

    @abstractmethod
    def decode(self, data: bytes) -> T:
        """Read a value; FieldError if the bytes are not of this type."""

    def check_size(self, data: bytes) -> None:
        """Raise FieldError unless so many bytes can be a value."""
        whole = len(data) % self.size == 0 if self.sequence else len(data) == self.size
        if not whole:
            unit = "bytes each" if self.sequence else "bytes"
            raise FieldError(f"{self.name} of {len(data)} bytes: it has {self.size} {unit}")


@dataclass(frozen=True, slots=True)
class _Scalar(LitePortType[T]):
    format: str
    zero: T

    @property
    def initial(self) -> T:
        return self.zero

    def encode(self, value: T) -> bytes:
        return _pack(self, self.format, (value,))

    def decode(self, data: bytes) -> T:
        self.check_size(data)
        value: T = struct.unpack(f"<{self.format}", data)[0]
        return value


@dataclass(frozen=True, slots=True)
class _Sequence(LitePortType[tuple[T, ...]]):
    format: str

    @property
    def initial(self) -> tuple[T, ...]:
        return ()

    def encode(self, value: tuple[T, ...]) -> bytes:
        return _pack(self, f"{len(value)}{self.format}", value)

    def decode(self, data: bytes) -> tuple[T, ...]:
        self.check_size(data)
        return struct.unpack(f"<{len(data) // self.size}{self.format}", data)


@dataclass(frozen=True, slots=True)
class _Text(LitePortType[str]):
    """Characters of Latin-1: one, or any number."""

    @property
    def initial(self) -> str:
        return "" if self.sequence else "\0"

    def encode(self, value: str) -> bytes:
        try:
            data = value.encode("latin-1")
        except UnicodeEncodeError:
            raise FieldError(f"{self.name} {value!r} has a character beyond Latin-1") from None
        self.check_size(data)
        return data

    def decode(self, data: bytes) -> str:
        self.check_size(data)
        return data.decode("latin-1")


def _pack(port_type: LitePortType[Any], layout: str, values: tuple[object, ...]) -> bytes:
    try:
        return struct.pack(f"<{layout}", *values)
    except (struct.error, OverflowError) as error:
        raise FieldError(f"{port_type.name} cannot be {values}: {error}") from None


BOOLEAN: Final = _Scalar("b", "TimedBoolean", 1, "?", zero=False)
CHAR: Final = _Text("c", "TimedChar", 1)
OCTET: Final = _Scalar("o", "TimedOctet", 1, "B", 0)
SHORT: Final = _Scalar("s", "TimedShort", 2, "h", 0)
LONG: Final = _Scalar("l", "TimedLong", 4, "i", 0)
FLOAT: Final = _Scalar("f", "TimedFloat", 4, "f", 0.0)
DOUBLE: Final = _Scalar("d", "TimedDouble", 4, "f", 0.0)
BOOLEAN_SEQ: Final[LitePortType[tuple[bool, ...]]] = _Sequence("B", "TimedBooleanSeq", 1, "?")
CHAR_SEQ: Final = _Text("C", "TimedCharSeq", 1)
OCTET_SEQ: Final[LitePortType[tuple[int, ...]]] = _Sequence("O", "TimedOctetSeq", 1, "B")
SHORT_SEQ: Final[LitePortType[tuple[int, ...]]] = _Sequence("S", "TimedShortSeq", 2, "h")
LONG_SEQ: Final[LitePortType[tuple[int, ...]]] = _Sequence("L", "TimedLongSeq", 4, "i")
FLOAT_SEQ: Final[LitePortType[tuple[float, ...]]] = _Sequence("F", "TimedFloatSeq", 4, "f")
DOUBLE_SEQ: Final[LitePortType[tuple[float, ...]]] = _Sequence("D", "TimedDoubleSeq", 4, "f")

PORT_TYPES: Final[Mapping[str, LitePortType[Any]]] = MappingProxyType(
    {
        port_type.code: port_type
        for port_type in (
            *(BOOLEAN, CHAR, OCTET, SHORT, LONG, FLOAT, DOUBLE),
            *(BOOLEAN_SEQ, CHAR_SEQ, OCTET_SEQ, SHORT_SEQ, LONG_SEQ, FLOAT_SEQ, DOUBLE_SEQ),
        )
    }
)
"""All types by their letter."""
