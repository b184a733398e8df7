r"""Data types of ports and of the objects that carry them (NEDO report, 3.4.43.3, Table 4).

>>> SHORT.encode(-2), FLOAT.decode([bytes.fromhex("0000C03F")])
((b'\xfe\xff',), 1.5)
>>> SHORT.sequence(2).decode([b"\x01\x00", b"\xff\xff"])
(1, -1)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final, Generic, TypeVar, cast

from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.errors import FieldError

T = TypeVar("T")

MAX_TEXT: Final = 255
"""Characters that a text port holds; ours."""


@dataclass(frozen=True, slots=True)
class CanopenPortType(Generic[T]):
    """A data type of a port; each element of a value is an object of the dictionary.

    Attributes:
        name: the RTC name of Table 4.
        data_type: the CANopen data type of an element.
        kind: the Python type of an element.
        length: number of elements.
        many: a value is a tuple of its elements, always as many; else it is the one element.
        width: bits of an element where its data type leaves them open.

    Raises:
        ValueError: a sequence without elements.
    """

    name: str
    data_type: DataType
    kind: type[Any]
    length: int = 1
    many: bool = False
    width: int = 0

    def __post_init__(self) -> None:
        """Refuse an empty sequence."""
        if self.length < 1:
            raise ValueError(f"a sequence of {self.length} elements, at least 1 is needed")

    def sequence(self, length: int) -> CanopenPortType[tuple[T, ...]]:
        """Return the type of so many elements together (DECISION K3)."""
        return CanopenPortType(
            self.name, self.data_type, self.kind, length, many=True, width=self.width
        )

    @property
    def element_bits(self) -> int:
        """Bits of an element, as Table 4 has them; 0 for a text."""
        return self.width or self.data_type.bits

    @property
    def bits(self) -> int:
        """Bits of a value in a PDO; 0 for a text, which fits none."""
        return self.element_bits * self.length

    @property
    def max_bytes(self) -> int:
        """Largest size of an element in the dictionary."""
        if self.element_bits:
            return (self.element_bits + 7) // 8
        return len(self.data_type.encode(" " * MAX_TEXT))

    @property
    def default(self) -> bytes:
        """Bytes of an element at power-on: 0, or an empty text."""
        return bytes(self.max_bytes if self.element_bits else 0)

    def encode(self, value: T) -> tuple[bytes, ...]:
        """Return the bytes of each element; FieldError if the type has no such value."""
        items: Any = value if self.many else (value,)
        if len(items) != self.length:
            raise FieldError(f"{len(items)} elements of {self.name}, {self.length} are needed")
        elements = tuple(self.data_type.encode(item) for item in items)
        for item, data in zip(items, elements, strict=True):
            if len(data) > self.max_bytes or (self.width and len(data) != self.max_bytes):
                allowed = f"at most {MAX_TEXT} characters" if not self.width else "one of 16 bits"
                raise FieldError(f"{item!r} is no {self.name}, which has {allowed}")
        return elements

    def decode(self, elements: Sequence[bytes]) -> T:
        """Return the value of the bytes of all elements."""
        items = [self.data_type.decode(data) for data in elements]
        values = tuple(bool(item) if self.kind is bool else item for item in items)
        return cast(T, values if self.many else values[0])


def _row(name: str, data_type: DataType, kind: type[T], width: int = 0) -> CanopenPortType[T]:
    return CanopenPortType(name, data_type, kind, width=width)


BOOLEAN: Final = _row("Boolean", DataType.BOOLEAN, bool)
OCTET: Final = _row("Octet", DataType.UNSIGNED8, int)
CHARACTER: Final = _row("Character", DataType.VISIBLE_CHAR, str)
SHORT: Final = _row("Short", DataType.INTEGER16, int)
UNSIGNED_SHORT: Final = _row("UnsignedShort", DataType.UNSIGNED16, int)
FLOAT: Final = _row("Float", DataType.REAL32, float)
LONG: Final = _row("Long", DataType.INTEGER32, int)
UNSIGNED_LONG: Final = _row("UnsignedLong", DataType.UNSIGNED32, int)
DOUBLE: Final = _row("Double", DataType.REAL64, float)
UNSIGNED_LONG_LONG: Final = _row("UnsignedLongLong", DataType.UNSIGNED64, int)
LONG_LONG: Final = _row("LongLong", DataType.INTEGER64, int)
STRING: Final = _row("String", DataType.VISIBLE_STRING, str)
WIDE_CHARACTER: Final = _row("WideCharacter", DataType.UNICODE_STRING, str, width=16)
WIDE_STRING: Final = _row("WideString", DataType.UNICODE_STRING, str)

PORT_TYPES: Final[Mapping[str, CanopenPortType[Any]]] = MappingProxyType(
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


def integer(word_bits: int) -> CanopenPortType[int]:
    """Return Integer on a device whose words have so many bits (Table 4, note 1).

    Raises:
        ValueError: not 8, 16 or 32.
    """
    if word_bits not in _INTEGERS:
        raise ValueError(f"a word of {word_bits} bits; Integer has 8, 16 or 32")
    return CanopenPortType(INTEGER, _INTEGERS[word_bits], int)
