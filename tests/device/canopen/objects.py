"""Small dictionaries for tests of one service, and what an SDO client would do with them."""

from __future__ import annotations

from collections.abc import Iterable

from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.dictionary import Dictionary, SdoAbort
from tickrig.device.canopen.slave import Nonvolatile
from tickrig.device.canopen.stack import make_slave
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription
from tickrig.wire.canopen.sdo_frame import AbortCode

RW = Access.READ | Access.WRITE
RO = Access.READ
U8, U16, U32 = DataType.UNSIGNED8, DataType.UNSIGNED16, DataType.UNSIGNED32


def u8(index: int, default: int = 0, access: Access = RW) -> list[EntryDescription]:
    return [EntryDescription(index, 0, f"{index:04X}h", U8, access, default=default)]


def u16(index: int, default: int = 0) -> list[EntryDescription]:
    return [EntryDescription(index, 0, f"{index:04X}h", U16, RW, default=default)]


def u32(index: int, default: int = 0, *, relative: bool = False) -> list[EntryDescription]:
    return [
        EntryDescription(index, 0, f"{index:04X}h", U32, RW, default=default, relative=relative)
    ]


def array(
    index: int, *defaults: int, kind: DataType = U32, access: Access = RW
) -> list[EntryDescription]:
    elements = [
        EntryDescription(index, sub, f"{index:04X}h:{sub}", kind, access, default=default)
        for sub, default in enumerate(defaults, 1)
    ]
    return [EntryDescription(index, 0, f"{index:04X}h:0", U8, RO, default=len(defaults)), *elements]


def errors() -> list[EntryDescription]:
    """Give the objects of an EMCY producer with three fields of history."""
    history = array(0x1003, 0, 0, 0, access=RO)[1:]
    return [
        *u8(0x1001, access=RO),
        *u8(0x1003),
        *history,
        *u32(0x1014, 0x80, relative=True),
        *u16(0x1015),
    ]


def make_bus(
    *objects: Iterable[EntryDescription], node_id: int = 5, kept: Nonvolatile | None = None
) -> Bus:
    """Make a slave of these objects on a bus of its own; it has not booted."""
    return Bus(make_slave(Dictionary(entry for rows in objects for entry in rows), node_id, kept))


def booted(*objects: Iterable[EntryDescription], kept: Nonvolatile | None = None) -> Bus:
    """Make one that has sent its boot-up message."""
    bus = make_bus(*objects, kept=kept)
    assert bus.step() == ["705#00"]
    return bus


def write(bus: Bus, index: int, value: Value, sub: int = 0) -> AbortCode | None:
    """Write as an SDO client; return why it was refused, None if it was not."""
    entry = bus.slave.dictionary[index, sub]
    try:
        entry.download(entry.data_type.encode(value))
    except SdoAbort as abort:
        return abort.code
    return None


def read(bus: Bus, index: int, sub: int = 0) -> Value:
    """Read as an SDO client; return the abort code if that is refused."""
    entry = bus.slave.dictionary[index, sub]
    try:
        return entry.data_type.decode(entry.upload())
    except SdoAbort as abort:
        return abort.code
