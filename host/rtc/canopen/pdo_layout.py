"""The layout of a device's PDO in its proxy (NEDO report, Fig. 109, Table 4; ours: K5).

A PDO has room for only one 64-bit value, so there are no sequences of 64-bit types. INTEGER8, which
RTC does not have, is a short. UNICODE_STRING of 16 bits is a wide character. The canopen library
reads A0h, VISIBLE_CHAR, as DOMAIN. No other DOMAIN has 8 bits.

>>> PDO_FIELD_TYPES[DataType.INTEGER16, 16].decode(0xFFFE)
-2
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from tickrig.host.rtc.canopen.definition import TPDOS
from tickrig.wire import rtc_canopen as table_4
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.pdo import MAX_PDO_BITS, MappedObject
from tickrig.wire.rtc_types import rtc
from tickrig.wire.rtc_types.idl import Struct
from tickrig.wire.rtc_types.rtc import (
    TimedLongLong,
    TimedLongLongSeq,
    TimedULongLong,
    TimedULongLongSeq,
)


@dataclass(frozen=True, slots=True)
class _PdoFieldType:
    """Representation of the objects of a data type in ports.

    Attributes:
        row: row of Table 4.
        one: type of a port for one object.
        many: type of a port for several objects, or None if two objects do not fit into a PDO.
        bits: number of bits of one object in a PDO.
    """

    row: table_4.CanopenPortType[Any]
    one: type[Struct]
    many: type[Struct] | None
    bits: int

    def decode(self, number: int) -> Value:
        """Return the value of these bits."""
        value: Value = self.row.decode([number.to_bytes((self.bits + 7) // 8, "little")])
        return value

    def encode(self, value: Value) -> int:
        """Convert a value to its bits. Raise FieldError if the value does not fit."""
        return int.from_bytes(self.row.encode(value)[0], "little")


PORT_KINDS: Final = (
    (table_4.BOOLEAN, rtc.TimedBoolean, rtc.TimedBooleanSeq),
    (table_4.CHARACTER, rtc.TimedChar, rtc.TimedCharSeq),
    (table_4.WIDE_CHARACTER, rtc.TimedWChar, rtc.TimedWCharSeq),
    (table_4.STRING, rtc.TimedString, rtc.TimedStringSeq),
    (table_4.WIDE_STRING, rtc.TimedWString, rtc.TimedWStringSeq),
    (table_4.OCTET, rtc.TimedOctet, rtc.TimedOctetSeq),
    (table_4.integer(8), rtc.TimedShort, rtc.TimedShortSeq),
    (table_4.SHORT, rtc.TimedShort, rtc.TimedShortSeq),
    (table_4.UNSIGNED_SHORT, rtc.TimedUShort, rtc.TimedUShortSeq),
    (table_4.LONG, rtc.TimedLong, rtc.TimedLongSeq),
    (table_4.UNSIGNED_LONG, rtc.TimedULong, rtc.TimedULongSeq),
    (table_4.FLOAT, rtc.TimedFloat, rtc.TimedFloatSeq),
    (table_4.DOUBLE, rtc.TimedDouble, rtc.TimedDoubleSeq),
    (table_4.UNSIGNED_LONG_LONG, TimedULongLong, TimedULongLongSeq),
    (table_4.LONG_LONG, TimedLongLong, TimedLongLongSeq),
)
"""Rows of Table 4, each with the struct of one value and the struct of several values."""


def _field_type(
    row: table_4.CanopenPortType[Any], one: type[Struct], many: type[Struct], bits: int = 0
) -> _PdoFieldType:
    bits = bits or row.element_bits
    return _PdoFieldType(row, one, many if 2 * bits <= MAX_PDO_BITS else None, bits)


_BOOLEAN, _CHARACTER = PORT_KINDS[0], PORT_KINDS[1]

PDO_FIELD_TYPES: Final[Mapping[tuple[int, int], _PdoFieldType]] = {
    **{
        (row.data_type, row.element_bits): _field_type(row, one, many)
        for row, one, many in PORT_KINDS
        if row.element_bits
    },
    (DataType.BOOLEAN, 8): _field_type(*_BOOLEAN, 8),
    (DataType.DOMAIN, 8): _field_type(*_CHARACTER),
}
"""Field types by data type and bits in the PDO, without strings."""


def sequence_of(kind: type[Any], tm: rtc.Time, values: tuple[Value, ...]) -> Struct:
    """Return a struct with several values."""
    if isinstance(kind().data, bytes):
        return kind(tm, bytes(map(int, values)))  # type: ignore[no-any-return]
    return kind(tm, values)  # type: ignore[no-any-return]


_PAIR = 0x400
"""Index distance: the proxy of a TPDO is an RPDO 400h below, that of an RPDO a TPDO 400h above."""

PARAMETERS = 0x200
"""Distance from a communication parameter to its mapping parameter."""


def proxy_index(index: int) -> int:
    """Return the index of the proxy's PDO parameter that belongs to a PDO parameter of the device.

    The proxy receives each PDO that the device sends, and vice versa. So each TPDO of the device
    is an RPDO of the proxy.

    >>> f"{proxy_index(0x1801):04X}h {proxy_index(0x1A01):04X}h {proxy_index(0x1400):04X}h"
    '1401h 1601h 1800h'
    """
    return index - _PAIR if index >= TPDOS.start else index + _PAIR


@dataclass(frozen=True, slots=True)
class _PdoField:
    """A mapped object.

    Attributes:
        shift: number of bits before the field in the PDO.
        type: representation of the object in ports.
    """

    mapped: MappedObject
    shift: int
    type: _PdoFieldType


@dataclass(frozen=True)
class PdoLayout:
    """Positions and types of the objects in a PDO, for conversion from and to port values.

    Attributes:
        index: index of the communication parameter in the device.
        cob_id: CAN-ID of the PDO.
        fields: mapped objects, without dummies.
        bits: length of the PDO in bits.
        unknown: mapped objects of types that ports do not support. If the PDO has such objects, no
            ports are made for it.
    """

    index: int
    cob_id: int
    fields: tuple[_PdoField, ...]
    bits: int
    unknown: tuple[MappedObject, ...] = field(default=())

    @property
    def name(self) -> str:
        """The name of the PDO in a System Definition, such as `tpdo1`."""
        kind = "t" if self.sends else "r"
        return f"{kind}pdo{(self.index & 0x1FF) + 1}"

    @property
    def sends(self) -> bool:
        """Whether the device sends the PDO."""
        return self.index in TPDOS

    @property
    def size(self) -> int:
        """Number of bytes in a frame."""
        return (self.bits + 7) // 8

    def decode(self, data: bytes) -> tuple[Value, ...]:
        """Return the values in a frame of at least `size` bytes."""
        number = int.from_bytes(data, "little")
        return tuple(
            field.type.decode(number >> field.shift & (1 << field.type.bits) - 1)
            for field in self.fields
        )

    def encode(self, values: tuple[Value, ...]) -> bytes:
        """Return the data of a frame. Raise ValueError if a value does not fit."""
        number = 0
        for item, value in zip(self.fields, values, strict=True):
            number |= item.type.encode(value) << item.shift
        return number.to_bytes(self.size, "little")


def lay_out(
    index: int,
    cob_id: int,
    mapping: tuple[MappedObject, ...],
    data_types: Mapping[tuple[int, int], int],
) -> PdoLayout:
    """Return the layout of a PDO, calculated from its mapping.

    Objects with an index below 20h are dummies, which get no port.

    Args:
        index: index of the communication parameter.
        cob_id: CAN-ID of the PDO.
        mapping: mapped objects in order.
        data_types: data types in the EDS, by index and sub-index.
    """
    fields, unknown, shift = list[_PdoField](), list[MappedObject](), 0
    for mapped in mapping:
        data_type = data_types.get((mapped.index, mapped.sub), 0)
        if (kind := PDO_FIELD_TYPES.get((data_type, mapped.bits))) is not None:
            fields.append(_PdoField(mapped, shift, kind))
        elif mapped.index >= 0x20:
            unknown.append(mapped)
        shift += mapped.bits
    real = tuple(item for item in fields if item.mapped.index >= 0x20)
    return PdoLayout(index, cob_id, real, shift, tuple(unknown))


# Values of a PDO at once.

_PdoDecoder = Callable[[bytes], tuple[Value, ...]]
"""Function that decodes the data of a frame that is not too short."""

_LETTERS: Final[Mapping[tuple[DataType, int], str]] = {
    (DataType.BOOLEAN, 8): "?",
    (DataType.INTEGER8, 8): "b",
    (DataType.UNSIGNED8, 8): "B",
    (DataType.INTEGER16, 16): "h",
    (DataType.UNSIGNED16, 16): "H",
    (DataType.INTEGER32, 32): "i",
    (DataType.UNSIGNED32, 32): "I",
    (DataType.INTEGER64, 64): "q",
    (DataType.UNSIGNED64, 64): "Q",
    (DataType.REAL32, 32): "f",
    (DataType.REAL64, 64): "d",
}
"""Letters of the struct module by data type and bits in the PDO."""


def pdo_decoder(layout: PdoLayout) -> _PdoDecoder:
    """Return the fastest function that decodes the data of a PDO to the values of its objects.

    If the objects are aligned like the fields of a C struct, the function uses the struct module.
    The function is then faster than `layout.decode`.

    >>> mapping = (MappedObject(0x6401, 1, 16), MappedObject(0x6401, 2, 16))
    >>> types = {(0x6401, 1): DataType.INTEGER16, (0x6401, 2): DataType.INTEGER16}
    >>> pdo_decoder(lay_out(0x1801, 0x281, mapping, types))(bytes.fromhex("FEFF0100"))
    (-2, 1)
    """
    letters = _struct_letters(layout)
    return layout.decode if letters is None else struct.Struct(letters).unpack_from


def _struct_letters(layout: PdoLayout) -> str | None:
    """Return the layout in the notation of the struct module, or None if that is impossible."""
    letters, end = "<", 0
    for one in layout.fields:
        letter = _LETTERS.get((one.type.row.data_type, one.type.bits))
        gap, odd = divmod(one.shift - end, 8)
        if letter is None or odd:
            return None
        letters, end = f"{letters}{gap}x{letter}", one.shift + one.type.bits
    return letters
