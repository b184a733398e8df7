"""The reference object dictionary R1 of the conformance checks, from its table."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Final

from tickrig.device.canopen.dictionary import Dictionary
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.eds.object_table import (
    Access,
    EntryDescription,
    ObjectCode,
    ObjectDescription,
)

RO: Final = Access.READ
WO: Final = Access.WRITE
RW: Final = Access.READ | Access.WRITE
CONST: Final = Access.READ | Access.CONST
TPDO: Final = Access.TPDO
RPDO: Final = Access.RPDO

BOOL: Final = DataType.BOOLEAN
U8: Final = DataType.UNSIGNED8
U16: Final = DataType.UNSIGNED16
U32: Final = DataType.UNSIGNED32
U64: Final = DataType.UNSIGNED64
I8: Final = DataType.INTEGER8
I16: Final = DataType.INTEGER16
I32: Final = DataType.INTEGER32
R32: Final = DataType.REAL32
STR: Final = DataType.VISIBLE_STRING
DOM: Final = DataType.DOMAIN

NODE_ID: Final = 5

Variable = tuple[int, str, DataType, Access, Value]
"""Index, name, type, access and default."""

Array = tuple[int, str, int, DataType, Access, Value]
"""Index, name, number of elements, their type, access and default."""

VARIABLES: Final[tuple[Variable, ...]] = (
    (0x1000, "Device type", U32, RO, 0x000F_0191),
    (0x1001, "Error register", U8, RO | TPDO, 0),
    (0x1005, "COB-ID SYNC", U32, RW, 0x80),
    (0x1006, "Communication cycle period", U32, RW, 0),
    (0x1007, "Synchronous window length", U32, RW, 0),
    (0x1008, "Manufacturer device name", STR, CONST, "reference slave"),
    (0x1009, "Manufacturer hardware version", STR, CONST, "R1"),
    (0x100C, "Guard time", U16, RW, 0),
    (0x100D, "Life time factor", U8, RW, 0),
    (0x1012, "COB-ID TIME", U32, RW, 0x100),
    (0x1015, "Inhibit time EMCY", U16, RW, 0),
    (0x1017, "Producer heartbeat time", U16, RW, 0),
    (0x1019, "Synchronous counter overflow value", U8, RW, 0),
    (0x2000, "u8", U8, RW | TPDO | RPDO, 0),
    (0x2001, "u16", U16, RW | TPDO | RPDO, 0),
    (0x2002, "u32", U32, RW | TPDO | RPDO, 0),
    (0x2003, "u64", U64, RW | TPDO | RPDO, 0),
    (0x2004, "u8 write only", U8, WO | RPDO, 0),
    (0x2005, "u8 read only", U8, RO | TPDO, 0x55),
    (0x2009, "i16 not mappable", I16, RW, 0),
    (0x200A, "real32", R32, RW | TPDO | RPDO, 0.0),
)

ARRAYS: Final[tuple[Array, ...]] = (
    (0x1010, "Store parameters", 1, U32, RW, 1),
    (0x1011, "Restore default parameters", 1, U32, RW, 1),
    (0x1016, "Consumer heartbeat time", 4, U32, RW, 0),
    (0x200C, "bits", 8, BOOL, RW | TPDO | RPDO, False),
    (0x6000, "DI 8-bit", 2, U8, RO | TPDO, 0),
    (0x6200, "DO 8-bit", 2, U8, RW | RPDO, 0),
    (0x6401, "AI 16-bit", 4, I16, RO | TPDO, 0),
    (0x6411, "AO 16-bit", 4, I16, RW | RPDO, 0),
)

MAPPINGS: Final[tuple[tuple[int, str, tuple[int, ...]], ...]] = (
    (0x1600, "RPDO1 map", (0x6200_0108, 0x6200_0208)),
    (0x1601, "RPDO2 map", (0x6411_0110, 0x6411_0210, 0x6411_0310, 0x6411_0410)),
    (0x1602, "RPDO3 map", ()),
    (0x1603, "RPDO4 map", ()),
    (0x1A00, "TPDO1 map", (0x6000_0108, 0x6000_0208)),
    (0x1A01, "TPDO2 map", (0x6401_0110, 0x6401_0210, 0x6401_0310, 0x6401_0410)),
    (0x1A02, "TPDO3 map", ()),
    (0x1A03, "TPDO4 map", ()),
)

RPDO_COB_IDS: Final = (0x200, 0x300, 0x8000_0400, 0x8000_0500)
TPDO_COB_IDS: Final = (0x4000_0180, 0x4000_0280, 0xC000_0380, 0xC000_0480)

IDENTITY: Final = (("vendor", 0xAB01), ("product", 2), ("revision", 0x3_0004), ("serial", 0x5678))

ERROR_BEHAVIOUR: Final = "1029"
NMT_STARTUP: Final = "1F80"
"""Features that a check may need and R1 does not have."""


def make_dictionary(needs: Collection[str] = ()) -> Dictionary:
    """Make R1 with the optional objects that a check needs."""
    rows = [*_variables(), *_arrays(), *_records(), *_pdos(), *_mappings(), *_optional(needs)]
    codes = dict(_object_infos())
    return Dictionary(rows, {row.index: codes[row.index] for row in rows if row.index in codes})


def array(row: Array) -> Iterator[EntryDescription]:
    """Make an array with its sub-index 0."""
    index, name, count, kind, access, default = row
    yield EntryDescription(index, 0, f"{name}.n", U8, RO, default=count)
    for sub in range(1, count + 1):
        yield EntryDescription(index, sub, f"{name}.{sub}", kind, access, default=default)


def _object_infos() -> Iterator[tuple[int, ObjectDescription]]:
    for index, name, *_ in ARRAYS:
        yield index, ObjectDescription(name, ObjectCode.ARRAY)
    yield 0x1003, ObjectDescription("Pre-defined error field", ObjectCode.ARRAY)
    yield 0x1029, ObjectDescription("Error behaviour", ObjectCode.ARRAY)
    yield 0x1018, ObjectDescription("Identity", ObjectCode.RECORD)
    yield 0x1200, ObjectDescription("SDO server 1", ObjectCode.RECORD)
    yield 0x1201, ObjectDescription("SDO server 2", ObjectCode.RECORD)
    for index, name, _ in MAPPINGS:
        yield index, ObjectDescription(name, ObjectCode.RECORD)
        yield index - 0x200, ObjectDescription(name.replace("map", "comm"), ObjectCode.RECORD)


def _variables() -> Iterator[EntryDescription]:
    for index, name, kind, access, default in VARIABLES:
        yield EntryDescription(index, 0, name, kind, access, default=default)
    yield EntryDescription(0x1014, 0, "COB-ID EMCY", U32, RW, default=0x80, relative=True)
    yield EntryDescription(
        0x2006, 0, "u8 limits 10h..20h", U8, RW, default=0x10, low=0x10, high=0x20
    )
    yield EntryDescription(0x2007, 0, "string, max 64", STR, RW, default="short", max_bytes=64)
    yield EntryDescription(0x2008, 0, "domain, max 20000", DOM, RW, default=b"", max_bytes=20_000)


def _arrays() -> Iterator[EntryDescription]:
    for row in ARRAYS:
        yield from array(row)
    yield EntryDescription(0x1003, 0, "Pre-defined error field.n", U8, RW)
    for sub in range(1, 9):
        yield EntryDescription(0x1003, sub, f"Pre-defined error field.{sub}", U32, RO)


def _records() -> Iterator[EntryDescription]:
    yield EntryDescription(0x1018, 0, "Identity.n", U8, RO, default=len(IDENTITY))
    for sub, (name, value) in enumerate(IDENTITY, 1):
        yield EntryDescription(0x1018, sub, f"Identity.{name}", U32, RO, default=value)
    yield EntryDescription(0x1200, 0, "SDO server 1.n", U8, RO, default=2)
    yield EntryDescription(0x1200, 1, "SDO server 1.c2s", U32, RO, default=0x600, relative=True)
    yield EntryDescription(0x1200, 2, "SDO server 1.s2c", U32, RO, default=0x580, relative=True)
    yield EntryDescription(0x1201, 0, "SDO server 2.n", U8, RO, default=3)
    yield EntryDescription(0x1201, 1, "SDO server 2.c2s", U32, RW, default=0x8000_0000)
    yield EntryDescription(0x1201, 2, "SDO server 2.s2c", U32, RW, default=0x8000_0000)
    yield EntryDescription(0x1201, 3, "SDO server 2.client", U8, RW)


def _pdos() -> Iterator[EntryDescription]:
    for number, cob_id in enumerate(RPDO_COB_IDS, 1):
        yield from _communication(0x13FF + number, f"RPDO{number} comm", 5, cob_id)
    for number, cob_id in enumerate(TPDO_COB_IDS, 1):
        index, name = 0x17FF + number, f"TPDO{number} comm"
        yield from _communication(index, name, 6, cob_id)
        yield EntryDescription(index, 3, f"{name}.inhibit", U16, RW)
        yield EntryDescription(index, 6, f"{name}.sync start", U8, RW)


def _communication(index: int, name: str, highest: int, cob_id: int) -> Iterator[EntryDescription]:
    yield EntryDescription(index, 0, f"{name}.n", U8, RO, default=highest)
    yield EntryDescription(index, 1, f"{name}.cobid", U32, RW, default=cob_id, relative=True)
    yield EntryDescription(index, 2, f"{name}.type", U8, RW, default=0xFF)
    yield EntryDescription(index, 5, f"{name}.event timer", U16, RW)


def _mappings() -> Iterator[EntryDescription]:
    for index, name, mapped in MAPPINGS:
        yield EntryDescription(index, 0, f"{name}.n", U8, RW, default=len(mapped))
        for sub in range(1, 9):
            default = mapped[sub - 1] if sub <= len(mapped) else 0
            yield EntryDescription(index, sub, f"{name}.map{sub}", U32, RW, default=default)


def _optional(needs: Collection[str]) -> Iterator[EntryDescription]:
    if ERROR_BEHAVIOUR in needs:
        yield from array((0x1029, "Error behaviour", 1, U8, RW, 0))
    if NMT_STARTUP in needs:
        yield EntryDescription(0x1F80, 0, "NMT startup", U32, RW, default=4)
