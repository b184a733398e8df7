"""The objects of a node without an EDS: which of CiA 301 it answers for."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from tickrig.host.canopen.conform.binding.object_reader import ObjectReader
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.eds.object_table import (
    CONST,
    RO,
    RW,
    Access,
    DeviceInfo,
    Element,
    ObjectTable,
)

U8: Final = DataType.UNSIGNED8
U16: Final = DataType.UNSIGNED16
U32: Final = DataType.UNSIGNED32
TEXT: Final = DataType.VISIBLE_STRING

VARIABLES: Final[tuple[tuple[int, str, DataType, Access], ...]] = (
    (0x1000, "Device type", U32, RO),
    (0x1001, "Error register", U8, RO),
    (0x1002, "Manufacturer status register", U32, RO),
    (0x1005, "COB-ID SYNC", U32, RW),
    (0x1006, "Communication cycle period", U32, RW),
    (0x1007, "Synchronous window length", U32, RW),
    (0x1008, "Manufacturer device name", TEXT, CONST),
    (0x1009, "Manufacturer hardware version", TEXT, CONST),
    (0x100A, "Manufacturer software version", TEXT, CONST),
    (0x100C, "Guard time", U16, RW),
    (0x100D, "Life time factor", U8, RW),
    (0x1012, "COB-ID TIME", U32, RW),
    (0x1014, "COB-ID EMCY", U32, RW),
    (0x1015, "Inhibit time EMCY", U16, RW),
    (0x1017, "Producer heartbeat time", U16, RW),
    (0x1019, "Synchronous counter overflow value", U8, RW),
    (0x1F80, "NMT startup", U32, RW),
)
ARRAYS: Final[tuple[tuple[int, str, DataType, Access], ...]] = (
    (0x1010, "Store parameters", U32, RW),
    (0x1011, "Restore default parameters", U32, RW),
    (0x1016, "Consumer heartbeat time", U32, RW),
    (0x1018, "Identity object", U32, RO),
    (0x1029, "Error behaviour", U8, RW),
)
ERROR_FIELD: Final = 0x1003
SDO_SERVERS: Final = ((0x1200, RO), (0x1201, RW))
"""The default server, which nobody may move, and the first beside it."""
SDO_COB_IDS: Final = ((1, "client to server"), (2, "server to client"))
COMMUNICATION: Final = ((1, "COB-ID", U32), (2, "Transmission type", U8))
TIMING: Final = ((3, "Inhibit time", U16), (5, "Event timer", U16), (6, "SYNC start value", U8))
PDOS: Final = ((0x1400, "RPDO"), (0x1800, "TPDO"))
MOST_PDOS: Final = 16
MOST_SUBS: Final = 64
MAPPED: Final = 8


def probe_device(reader: ObjectReader) -> EdsDevice:
    """Ask a node for the objects of CiA 301; what else it has stays unknown.

    Raises:
        SdoTimeout: the node does not answer.
    """
    table = ObjectTable()
    for index, name, kind, access in VARIABLES:
        if _has(reader, index):
            table.variable(index, name, kind, access)
    for index, name, kind, access in ARRAYS:
        if count := min(reader.number(index, 0) or 0, MOST_SUBS):
            table.array(index, name, count, kind, access)
    _add_records(table, reader)
    return EdsDevice(DeviceInfo(), tuple(table), table.objects)


def _add_records(table: ObjectTable, reader: ObjectReader) -> None:
    if _has(reader, ERROR_FIELD):
        rows = [Element(1, "Standard error field", U32, RO)]
        table.record(ERROR_FIELD, "Pre-defined error field", rows, count_access=RW, count=0)
    for index, access in SDO_SERVERS:
        if _has(reader, index, 1):
            rows = [Element(sub, f"COB-ID {way}", U32, access) for sub, way in SDO_COB_IDS]
            table.record(index, "SDO server parameter", rows)
    for first, kind in PDOS:
        for number in range(MOST_PDOS):
            if _has(reader, first + number, 1):
                _add_pdo(table, reader, first + number, f"{kind}{number + 1}")


def _has(reader: ObjectReader, index: int, sub: int = 0) -> bool:
    return isinstance(reader.try_read(index, sub), bytes)


def _add_pdo(table: ObjectTable, reader: ObjectReader, index: int, name: str) -> None:
    head = [*_present(reader, index, COMMUNICATION), *_present(reader, index, TIMING)]
    table.record(index, f"{name} communication parameter", head)
    mapping = index + 0x200
    if _has(reader, mapping):
        rows = [Element(sub, f"Object {sub}", U32, RW) for sub in range(1, MAPPED + 1)]
        table.record(mapping, f"{name} mapping parameter", rows, count_access=RW, count=0)


def _present(
    reader: ObjectReader, index: int, rows: tuple[tuple[int, str, DataType], ...]
) -> Iterator[Element]:
    return (Element(sub, name, kind, RW) for sub, name, kind in rows if _has(reader, index, sub))
