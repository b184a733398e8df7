"""Reader that reads each object of a node once and reports contradictions to the descriptions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

from tickrig.host.canopen.conform.bus.sdo import number_of
from tickrig.host.canopen.errors import SdoAborted, SdoFailed, SdoTimeout
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds import object_table
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.sdo_frame import AbortCode, describe_abort

Upload = Callable[[int, int], bytes]
"""Function that reads an object by index and sub-index. It raises SdoAborted or SdoTimeout."""

PATIENCE: Final = 3
"""Number of successive requests without an answer after which the node counts as gone."""

_ABSENT: Final = (AbortCode.NO_OBJECT, AbortCode.NO_SUBINDEX)
_BROKEN: Final = (AbortCode.TOGGLE_BIT, AbortCode.COMMAND_SPECIFIER)
"""Abort codes of an upload that went wrong, sent by client or server."""


class ObjectReader:
    """Reader for the objects of a node, which reads each object once by SDO and caches the answer.

    Args:
        upload: function that reads an object by SDO.

    Attributes:
        findings: texts about objects that do not agree with their descriptions.
    """

    def __init__(self, upload: Upload) -> None:
        self._upload = upload
        self._known: dict[tuple[int, int], bytes | SdoFailed] = {}
        self._silent = 0
        self.findings: list[str] = []

    @property
    def held(self) -> dict[tuple[int, int], bytes]:
        """The values read so far."""
        return {at: value for at, value in self._known.items() if isinstance(value, bytes)}

    def read(self, entry: object_table.EntryDescription) -> bytes | None:
        """Read an object that the EDS describes. Return its bytes, or None if they are not usable.

        The result is None if the node refuses the request, or if the number of bytes contradicts
        the description.

        Raises:
            SdoTimeout: the node no longer answers.
        """
        new = (entry.index, entry.sub) not in self._known
        answer = self.try_read(entry.index, entry.sub)
        wrong = _contradiction(entry, answer)
        if wrong and new:
            self.findings.append(f"{entry.index:04X}h:{entry.sub:02X} {entry.name} {wrong}")
        return answer if isinstance(answer, bytes) and not wrong else None

    def number(self, index: int, sub: int) -> int | None:
        """Read an object as an unsigned number of at most 32 bits.

        The result is None if the value is longer or is no number, or if the node refuses the
        request.

        Raises:
            SdoTimeout: the node no longer answers.
        """
        answer = self.try_read(index, sub)
        return number_of(answer) if isinstance(answer, bytes) else None

    def has_nothing(self, index: int, sub: int) -> bool:
        """Return whether the node refuses to read an index and sub-index, with any abort code.

        Raises:
            SdoTimeout: the node no longer answers.
        """
        return isinstance(self.try_read(index, sub), SdoAborted)

    def try_read(self, index: int, sub: int) -> bytes | SdoFailed:
        """Return the node's answer to an upload.

        Raises:
            SdoTimeout: the node has stopped answering.
        """
        at = (index, sub)
        if at not in self._known:
            try:
                self._known[at] = self._upload(index, sub)
                self._silent = 0
            except SdoTimeout as error:
                self._silent += 1
                if self._silent == PATIENCE:
                    raise
                self._known[at] = error
            except SdoFailed as error:
                self._known[at], self._silent = error, 0
        return self._known[at]


def _contradiction(entry: object_table.EntryDescription, answer: bytes | SdoFailed) -> str:
    """Return the difference between an answer and the description, empty if there is none."""
    match answer:
        case SdoAborted() if answer.code in _ABSENT and entry.sub in {0, 1}:
            return f"is described, but the node does not have it: {describe_abort(answer.code)}"
        case SdoAborted() if answer.code in _BROKEN:
            return f"cannot be read: {describe_abort(answer.code)}"
        case SdoTimeout():
            return "was not answered"
        case bytes() if entry.size and len(answer) != entry.size:
            return f"is described as {entry.data_type.name}, but the node sends {len(answer)} bytes"
    return ""


# The objects of a node without an EDS: those of CiA 301 that it answers for.

_U8: Final = DataType.UNSIGNED8
_U16: Final = DataType.UNSIGNED16
_U32: Final = DataType.UNSIGNED32
_TEXT: Final = DataType.VISIBLE_STRING

_VARIABLES: Final[tuple[tuple[int, str, DataType, object_table.Access], ...]] = (
    (0x1000, "Device type", _U32, object_table.RO),
    (0x1001, "Error register", _U8, object_table.RO),
    (0x1002, "Manufacturer status register", _U32, object_table.RO),
    (0x1005, "COB-ID SYNC", _U32, object_table.RW),
    (0x1006, "Communication cycle period", _U32, object_table.RW),
    (0x1007, "Synchronous window length", _U32, object_table.RW),
    (0x1008, "Manufacturer device name", _TEXT, object_table.CONST),
    (0x1009, "Manufacturer hardware version", _TEXT, object_table.CONST),
    (0x100A, "Manufacturer software version", _TEXT, object_table.CONST),
    (0x100C, "Guard time", _U16, object_table.RW),
    (0x100D, "Life time factor", _U8, object_table.RW),
    (0x1012, "COB-ID TIME", _U32, object_table.RW),
    (0x1014, "COB-ID EMCY", _U32, object_table.RW),
    (0x1015, "Inhibit time EMCY", _U16, object_table.RW),
    (0x1017, "Producer heartbeat time", _U16, object_table.RW),
    (0x1019, "Synchronous counter overflow value", _U8, object_table.RW),
    (0x1F80, "NMT startup", _U32, object_table.RW),
)
_ARRAYS: Final[tuple[tuple[int, str, DataType, object_table.Access], ...]] = (
    (0x1010, "Store parameters", _U32, object_table.RW),
    (0x1011, "Restore default parameters", _U32, object_table.RW),
    (0x1016, "Consumer heartbeat time", _U32, object_table.RW),
    (0x1018, "Identity object", _U32, object_table.RO),
    (0x1029, "Error behaviour", _U8, object_table.RW),
)
_ERROR_FIELD: Final = 0x1003
_SDO_SERVERS: Final = ((0x1200, object_table.RO), (0x1201, object_table.RW))
"""The default server, which must not be changed, and the first additional one."""
_SDO_COB_IDS: Final = ((1, "client to server"), (2, "server to client"))
_COMMUNICATION: Final = ((1, "COB-ID", _U32), (2, "Transmission type", _U8))
_TIMING: Final = ((3, "Inhibit time", _U16), (5, "Event timer", _U16), (6, "SYNC start value", _U8))
_PDOS: Final = ((0x1400, "RPDO"), (0x1800, "TPDO"))
_MOST_PDOS: Final = 16
_MOST_SUBS: Final = 64
_MAPPED: Final = 8


def probe_device(reader: ObjectReader) -> EdsDevice:
    """Find out by SDO uploads which communication objects (CiA 301) a node has, if there is no EDS.

    Objects of the manufacturer and of device profiles are not searched.

    Raises:
        SdoTimeout: the node does not answer.
    """
    table = object_table.ObjectTable()
    for index, name, kind, access in _VARIABLES:
        if _has(reader, index):
            table.variable(index, name, kind, access)
    for index, name, kind, access in _ARRAYS:
        if count := min(reader.number(index, 0) or 0, _MOST_SUBS):
            table.array(index, name, count, kind, access)
    _add_records(table, reader)
    return EdsDevice(object_table.DeviceInfo(), tuple(table), table.objects)


def _add_records(table: object_table.ObjectTable, reader: ObjectReader) -> None:
    if _has(reader, _ERROR_FIELD):
        rows = [object_table.Element(1, "Standard error field", _U32, object_table.RO)]
        table.record(
            _ERROR_FIELD, "Pre-defined error field", rows, count_access=object_table.RW, count=0
        )
    for index, access in _SDO_SERVERS:
        if _has(reader, index, 1):
            rows = [
                object_table.Element(sub, f"COB-ID {way}", _U32, access)
                for sub, way in _SDO_COB_IDS
            ]
            table.record(index, "SDO server parameter", rows)
    for first, kind in _PDOS:
        for number in range(_MOST_PDOS):
            if _has(reader, first + number, 1):
                _add_pdo(table, reader, first + number, f"{kind}{number + 1}")


def _has(reader: ObjectReader, index: int, sub: int = 0) -> bool:
    return isinstance(reader.try_read(index, sub), bytes)


def _add_pdo(table: object_table.ObjectTable, reader: ObjectReader, index: int, name: str) -> None:
    head = [*_present(reader, index, _COMMUNICATION), *_present(reader, index, _TIMING)]
    table.record(index, f"{name} communication parameter", head)
    mapping = index + 0x200
    if _has(reader, mapping):
        rows = [
            object_table.Element(sub, f"Object {sub}", _U32, object_table.RW)
            for sub in range(1, _MAPPED + 1)
        ]
        table.record(
            mapping, f"{name} mapping parameter", rows, count_access=object_table.RW, count=0
        )


def _present(
    reader: ObjectReader, index: int, rows: tuple[tuple[int, str, DataType], ...]
) -> Iterator[object_table.Element]:
    return (
        object_table.Element(sub, name, kind, object_table.RW)
        for sub, name, kind in rows
        if _has(reader, index, sub)
    )
