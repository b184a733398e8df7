"""What is known of an object: its name, type and unit, and who says so."""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.errors import FieldError

MAX_NUMBER_BYTES: Final = 8

_OTHERS: Final = re.compile(r"[^0-9a-z]+")


class ObjectText(NamedTuple):
    """An object as people know it.

    Attributes:
        name: as `Signal.name`.
        kind: its data type, None where nobody said it.
        unit: empty where nobody said it.
        factor: by which the number is multiplied to be in that unit.
        source: as `Decoded.source`.
        in_hex: a set of bits, or an identifier.
    """

    name: str = ""
    kind: DataType | None = None
    unit: str = ""
    factor: float = 1
    source: str = ""
    in_hex: bool = False

    def read(self, data: bytes) -> tuple[Value, str]:
        """Return value and text of some bytes; a type that does not fit them is not used."""
        if self.kind is not None and not self.in_hex:
            try:
                return self._scaled(self.kind.decode(data))
            except FieldError:
                pass
        if self.in_hex or self.kind is None or self.kind.is_integer:
            return _number(data)
        return data, write_bytes(data)

    def _scaled(self, value: Value) -> tuple[Value, str]:
        if isinstance(value, bytes):
            return value, write_bytes(value)
        if isinstance(value, str):
            return value, repr(value.rstrip("\0"))
        if self.factor != 1:
            value *= self.factor
        return value, f"{value:g}" if isinstance(value, float) else str(value)


def _number(data: bytes) -> tuple[Value, str]:
    """Read bytes as a number without a type."""
    if not 1 <= len(data) <= MAX_NUMBER_BYTES:
        return data, write_bytes(data)
    number = int.from_bytes(data, "little")
    return number, f"0x{number:0{2 * len(data)}X}"


def slug(name: str) -> str:
    """Return a name as filters write it.

    >>> slug("Velocity actual value"), slug("COB-ID used by PDO")
    ('velocity_actual_value', 'cob_id_used_by_pdo')
    """
    return _OTHERS.sub("_", name.lower()).strip("_")


def write_bytes(data: bytes) -> str:
    r"""Write some bytes: as text where they are text.

    >>> write_bytes(b"EPOS"), write_bytes(b"\x01\xff")
    ("'EPOS'", '01 FF')
    """
    text = data.rstrip(b"\0")
    if text and all(0x20 <= code < 0x7F for code in text):
        return repr(text.decode("ascii"))
    return data.hex(" ").upper()
