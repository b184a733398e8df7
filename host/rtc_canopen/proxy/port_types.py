"""Objects in a PDO as data ports of OpenRTM carry them (NEDO report, Table 4; ours: K5).

A PDO has room for one 64-bit value: those have no sequence. INTEGER8, which RTC
has not, is a short. The canopen library reads A0h, VISIBLE_CHAR, as DOMAIN; no
other DOMAIN has 8 bits.

>>> PORT_TYPES[DataType.INTEGER16, 16].decode(0xFFFE)
-2
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.rtc_canopen import port_types as table_4
from tickrig.wire.rtc_types import basic
from tickrig.wire.rtc_types.idl import Struct
from tickrig.wire.rtc_types.long_long import TimedLongLong, TimedULongLong


@dataclass(frozen=True, slots=True)
class PortType:
    """How objects of a data type are seen at ports.

    Attributes:
        row: of Table 4.
        one: of a port for one object.
        many: of a port for several, None if two do not fit into a PDO.
        bits: of one object in a PDO.
    """

    row: table_4.Scalar[Any]
    one: type[Struct]
    many: type[Struct] | None
    bits: int

    def decode(self, number: int) -> Value:
        """Return the value that these bits are."""
        value: Value = self.row.decode([number.to_bytes((self.bits + 7) // 8, "little")])
        return value

    def encode(self, value: Value) -> int:
        """Return the bits; FieldError if the value does not fit."""
        return int.from_bytes(self.row.encode(value)[0], "little")


_KINDS: Final = (
    (table_4.BOOLEAN, basic.TimedBoolean, basic.TimedBooleanSeq),
    (table_4.OCTET, basic.TimedOctet, basic.TimedOctetSeq),
    (table_4.integer(8), basic.TimedShort, basic.TimedShortSeq),
    (table_4.SHORT, basic.TimedShort, basic.TimedShortSeq),
    (table_4.UNSIGNED_SHORT, basic.TimedUShort, basic.TimedUShortSeq),
    (table_4.LONG, basic.TimedLong, basic.TimedLongSeq),
    (table_4.UNSIGNED_LONG, basic.TimedULong, basic.TimedULongSeq),
    (table_4.FLOAT, basic.TimedFloat, basic.TimedFloatSeq),
    (table_4.DOUBLE, basic.TimedDouble, None),
    (table_4.UNSIGNED_LONG_LONG, TimedULongLong, None),
    (table_4.LONG_LONG, TimedLongLong, None),
)

PORT_TYPES: Final[Mapping[tuple[int, int], PortType]] = {
    **{(row.data_type, row.bits): PortType(row, one, many, row.bits) for row, one, many in _KINDS},
    (DataType.BOOLEAN, 1): PortType(table_4.BOOLEAN, basic.TimedBoolean, basic.TimedBooleanSeq, 1),
    (DataType.DOMAIN, 8): PortType(table_4.CHARACTER, basic.TimedChar, basic.TimedCharSeq, 8),
}
"""By data type and bits in the PDO; strings are not among them."""
