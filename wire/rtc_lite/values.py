r"""The data types of ports and their encoding (DECISION L8, L10).

Values are little-endian. The time of a Timed type is not sent. A double has 4 bytes, as on AVR, so
values lose precision. A sequence is sent as the series of its elements; their number follows from
the size.

>>> LONG.encode(-2), LONG.decode(b"\x2a\x00\x00\x00")
(b'\xfe\xff\xff\xff', 42)
>>> SHORT_SEQ.encode((1, -1)).hex(" "), CHAR_SEQ.decode(b"RT")
('01 00 ff ff', 'RT')
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final, Generic, TypeVar, cast

from tickrig.wire.errors import FieldError

_MAX_NAME_BYTES: Final = 15


def encode_name(name: str) -> bytes:
    """Return the bytes of the name of a port or a component type.

    A name has 1 to 15 printable ASCII characters without blanks (DECISION L6).

    Raises:
        FieldError: the name is empty, is too long, or has other characters.
    """
    if not 1 <= len(name) <= _MAX_NAME_BYTES:
        raise FieldError(f"name {name!r} has {len(name)} characters, 1..{_MAX_NAME_BYTES} fit")
    if not all("!" <= character <= "~" for character in name):
        raise FieldError(f"name {name!r} is not printable ASCII without blanks")
    return name.encode("ascii")


T = TypeVar("T")

_TEXT: Final = "latin-1"
"""Format of characters, which is used in place of a `struct` format."""


@dataclass(frozen=True, slots=True)
class LitePortType(Generic[T]):
    """The data type of a port of an RTComponent-Lite.

    Attributes:
        code: letter of the type, in upper case for a sequence.
        name: type of the port at the proxy, such as `TimedLong`.
        size: number of bytes of a value, or of an element in a sequence.
        format: `struct` format of an element, or `_TEXT` for characters.
        initial: value before the first write.
    """

    code: str
    name: str
    size: int
    format: str
    initial: T

    @property
    def sequence(self) -> bool:
        """Whether a value has any number of elements."""
        return self.code.isupper()

    def encode(self, value: T) -> bytes:
        """Encode a value of this type as bytes.

        Raises:
            FieldError: the value does not have this type.
        """
        if self.format == _TEXT:
            return self._encode_text(cast(str, value))
        values: Any = value if self.sequence else (value,)
        try:
            return struct.pack(f"<{len(values)}{self.format}", *values)
        except (struct.error, OverflowError) as error:
            raise FieldError(f"{self.name} cannot be {values}: {error}") from None

    def decode(self, data: bytes) -> T:
        """Decode bytes into a value of this type.

        Raises:
            FieldError: the number of bytes does not fit this type.
        """
        self.check_size(data)
        if self.format == _TEXT:
            return cast(T, data.decode("latin-1"))
        values = struct.unpack(f"<{len(data) // self.size}{self.format}", data)
        return cast(T, values if self.sequence else values[0])

    def check_size(self, data: bytes) -> None:
        """Raise FieldError unless a value can have the number of bytes."""
        whole = len(data) % self.size == 0 if self.sequence else len(data) == self.size
        if not whole:
            unit = "bytes each" if self.sequence else "bytes"
            raise FieldError(f"{self.name} of {len(data)} bytes: it has {self.size} {unit}")

    def _encode_text(self, value: str) -> bytes:
        try:
            data = value.encode("latin-1")
        except UnicodeEncodeError:
            raise FieldError(f"{self.name} {value!r} has a character beyond Latin-1") from None
        self.check_size(data)
        return data


BOOLEAN: Final = LitePortType("b", "TimedBoolean", 1, "?", initial=False)
CHAR: Final = LitePortType("c", "TimedChar", 1, _TEXT, "\0")
_OCTET: Final = LitePortType("o", "TimedOctet", 1, "B", 0)
SHORT: Final = LitePortType("s", "TimedShort", 2, "h", 0)
LONG: Final = LitePortType("l", "TimedLong", 4, "i", 0)
FLOAT: Final = LitePortType("f", "TimedFloat", 4, "f", 0.0)
# Four bytes: a double of avr-gcc is a float (DECISION L10).
_DOUBLE: Final = LitePortType("d", "TimedDouble", 4, "f", 0.0)
_BOOLEAN_SEQ: Final[LitePortType[tuple[bool, ...]]] = LitePortType(
    "B", "TimedBooleanSeq", 1, "?", ()
)
CHAR_SEQ: Final = LitePortType("C", "TimedCharSeq", 1, _TEXT, "")
OCTET_SEQ: Final[LitePortType[tuple[int, ...]]] = LitePortType("O", "TimedOctetSeq", 1, "B", ())
SHORT_SEQ: Final[LitePortType[tuple[int, ...]]] = LitePortType("S", "TimedShortSeq", 2, "h", ())
LONG_SEQ: Final[LitePortType[tuple[int, ...]]] = LitePortType("L", "TimedLongSeq", 4, "i", ())
_FLOAT_SEQ: Final[LitePortType[tuple[float, ...]]] = LitePortType("F", "TimedFloatSeq", 4, "f", ())
_DOUBLE_SEQ: Final[LitePortType[tuple[float, ...]]] = LitePortType(
    "D", "TimedDoubleSeq", 4, "f", ()
)

PORT_TYPES: Final[Mapping[str, LitePortType[Any]]] = MappingProxyType(
    {
        port_type.code: port_type
        for port_type in (
            *(BOOLEAN, CHAR, _OCTET, SHORT, LONG, FLOAT, _DOUBLE),
            *(_BOOLEAN_SEQ, CHAR_SEQ, OCTET_SEQ, SHORT_SEQ, LONG_SEQ, _FLOAT_SEQ, _DOUBLE_SEQ),
        )
    }
)
"""All types by letter."""
