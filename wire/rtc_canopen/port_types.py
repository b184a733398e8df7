r"""Data types of ports and of the objects that carry them (NEDO report, 3.4.43.3, Table 4).

>>> SHORT.encode(-2), FLOAT.decode([bytes.fromhex("0000C03F")])
((b'\xfe\xff',), 1.5)
>>> SHORT.sequence(2).decode([b"\x01\x00", b"\xff\xff"])
(1, -1)
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final, Generic, TypeVar, cast

from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.errors import FieldError

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class CanopenPortType(ABC, Generic[T]):
    """A data type of a port; each element of a value is an object of the dictionary.

    Attributes:
        name: the RTC name of Table 4.
        data_type: the CANopen data type of an element.
    """

    name: str
    data_type: DataType

    @property
    @abstractmethod
    def length(self) -> int:
        """Number of elements."""

    @abstractmethod
    def encode(self, value: T) -> tuple[bytes, ...]:
        """Return the bytes of each element; FieldError if the type has no such value."""

    @abstractmethod
    def decode(self, elements: Sequence[bytes]) -> T:
        """Return the value of the bytes of all elements."""

    @property
    def bits(self) -> int:
        """Bits in a PDO, where BOOLEAN takes a byte (DECISION K5); 0 for a text."""
        return 8 * self.data_type.size * self.length


@dataclass(frozen=True, slots=True)
class Scalar(CanopenPortType[T]):
    """A row of Table 4: one element."""

    kind: type[T]

    @property
    def length(self) -> int:
        """One."""
        return 1

    def sequence(self, length: int) -> SequenceType[T]:
        """Return the type of so many elements together (DECISION K3)."""
        return SequenceType(self.name, self.data_type, self, length)

    def encode(self, value: T) -> tuple[bytes, ...]:
        """Return the bytes of the element."""
        return (self.data_type.encode(cast(Value, value)),)  # Table 4 has these alone

    def decode(self, elements: Sequence[bytes]) -> T:
        """Return the value."""
        value = self.data_type.decode(elements[0])
        return cast(T, bool(value) if self.kind is bool else value)


@dataclass(frozen=True, slots=True)
class SequenceType(CanopenPortType[tuple[T, ...]]):
    """Several elements of one type, always as many; a value is a tuple."""

    element: Scalar[T]
    count: int

    def __post_init__(self) -> None:
        """Refuse an empty sequence."""
        if self.count < 1:
            raise ValueError(f"a sequence of {self.count} elements, at least 1 is needed")

    @property
    def length(self) -> int:
        """Number of elements."""
        return self.count

    def encode(self, value: tuple[T, ...]) -> tuple[bytes, ...]:
        """Return the bytes of each element; FieldError if there are more or fewer."""
        if len(value) != self.count:
            raise FieldError(f"{len(value)} elements of {self.name}, {self.count} are needed")
        return tuple(self.element.encode(item)[0] for item in value)

    def decode(self, elements: Sequence[bytes]) -> tuple[T, ...]:
        """Return all values."""
        return tuple(self.element.decode([data]) for data in elements)


BOOLEAN: Final = Scalar("Boolean", DataType.BOOLEAN, bool)
OCTET: Final = Scalar("Octet", DataType.UNSIGNED8, int)
CHARACTER: Final = Scalar("Character", DataType.VISIBLE_CHAR, str)
SHORT: Final = Scalar("Short", DataType.INTEGER16, int)
UNSIGNED_SHORT: Final = Scalar("UnsignedShort", DataType.UNSIGNED16, int)
FLOAT: Final = Scalar("Float", DataType.REAL32, float)
LONG: Final = Scalar("Long", DataType.INTEGER32, int)
UNSIGNED_LONG: Final = Scalar("UnsignedLong", DataType.UNSIGNED32, int)
DOUBLE: Final = Scalar("Double", DataType.REAL64, float)
UNSIGNED_LONG_LONG: Final = Scalar("UnsignedLongLong", DataType.UNSIGNED64, int)
LONG_LONG: Final = Scalar("LongLong", DataType.INTEGER64, int)
STRING: Final = Scalar("String", DataType.VISIBLE_STRING, str)
WIDE_CHARACTER: Final = Scalar("WideCharacter", DataType.UNICODE_STRING, str)
WIDE_STRING: Final = Scalar("WideString", DataType.UNICODE_STRING, str)

PORT_TYPES: Final[Mapping[str, Scalar[Any]]] = MappingProxyType(
    {
        row.name: row
        for row in (
            *(BOOLEAN, OCTET, CHARACTER, SHORT, UNSIGNED_SHORT, FLOAT, LONG, UNSIGNED_LONG),
            *(DOUBLE, UNSIGNED_LONG_LONG, LONG_LONG, STRING, WIDE_CHARACTER, WIDE_STRING),
        )
    }
)
"""Table 4 by RTC name, but for Integer; LongLong is ours (DECISION K5)."""

INTEGER: Final = "Integer"
_INTEGERS: Final = {8: DataType.INTEGER8, 16: DataType.INTEGER16, 32: DataType.INTEGER32}


def integer(word_bits: int) -> Scalar[int]:
    """Return Integer on a device whose words have so many bits (Table 4, note 1).

    Raises:
        ValueError: not 8, 16 or 32.
    """
    if word_bits not in _INTEGERS:
        raise ValueError(f"a word of {word_bits} bits; Integer has 8, 16 or 32")
    return Scalar(INTEGER, _INTEGERS[word_bits], int)
