"""The PDOs of a node by their kinds: enabled or not, event-driven or synchronous, remappable."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Final, NamedTuple

from tickrig.host.canopen.conform.bus.sdo import number_of
from tickrig.host.canopen.errors import SdoAborted, SdoFailed, SdoTimeout
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds import object_table
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.nmt import EXTENDED, FLAG_30
from tickrig.wire.canopen.pdo import PdoDescription, fields
from tickrig.wire.canopen.sdo_frame import AbortCode, describe_abort

# Reads objects of a node, each once, and notes what contradicts their descriptions.
Upload = Callable[[int, int], bytes]
"""Reads an object by index and sub-index; raises SdoAborted or SdoTimeout."""

PATIENCE: Final = 3
"""So many requests in a row without an answer: the node is gone."""

_ABSENT: Final = (AbortCode.NO_OBJECT, AbortCode.NO_SUBINDEX)
_BROKEN: Final = (AbortCode.TOGGLE_BIT, AbortCode.COMMAND_SPECIFIER)
"""With these an upload ends that went wrong, from whichever side."""


class ObjectReader:
    """Reads what is asked for, and remembers it.

    Args:
        upload: reads an object.

    Attributes:
        findings: descriptions that the node contradicts, one a line.
    """

    def __init__(self, upload: Upload) -> None:
        self._upload = upload
        self._known: dict[tuple[int, int], bytes | SdoFailed] = {}
        self._silent = 0
        self.findings: list[str] = []

    @property
    def held(self) -> dict[tuple[int, int], bytes]:
        """What was read so far."""
        return {at: value for at, value in self._known.items() if isinstance(value, bytes)}

    def read(self, entry: object_table.EntryDescription) -> bytes | None:
        """Return what a described object holds, None where it cannot be read or has another size.

        Raises:
            SdoTimeout: the node has stopped answering.
        """
        new = (entry.index, entry.sub) not in self._known
        answer = self.try_read(entry.index, entry.sub)
        wrong = _contradiction(entry, answer)
        if wrong and new:
            self.findings.append(f"{entry.index:04X}h:{entry.sub:02X} {entry.name} {wrong}")
        return answer if isinstance(answer, bytes) and not wrong else None

    def number(self, index: int, sub: int) -> int | None:
        """Return an unsigned number of at most 32 bits, None where there is none.

        Raises:
            SdoTimeout: the node has stopped answering.
        """
        answer = self.try_read(index, sub)
        return number_of(answer) if isinstance(answer, bytes) else None

    def has_nothing(self, index: int, sub: int) -> bool:
        """Return whether the node refuses to read a place, with whatever code.

        Raises:
            SdoTimeout: the node has stopped answering.
        """
        return isinstance(self.try_read(index, sub), SdoAborted)

    def try_read(self, index: int, sub: int) -> bytes | SdoFailed:
        """Return what the node answers to an upload.

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
    """Return how an answer differs from a description, empty if it does not."""
    match answer:
        case SdoAborted() if answer.code in _ABSENT and entry.sub in {0, 1}:
            return f"is described, and the node does not have it: {describe_abort(answer.code)}"
        case SdoAborted() if answer.code in _BROKEN:
            return f"cannot be read: {describe_abort(answer.code)}"
        case SdoTimeout():
            return "was not answered"
        case bytes() if entry.size and len(answer) != entry.size:
            return f"is described as {entry.data_type.name}, and the node sends {len(answer)} bytes"
    return ""


# The objects of a node without an EDS: which of CiA 301 it answers for.

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
"""The default server, which nobody may move, and the first beside it."""
_SDO_COB_IDS: Final = ((1, "client to server"), (2, "server to client"))
_COMMUNICATION: Final = ((1, "COB-ID", _U32), (2, "Transmission type", _U8))
_TIMING: Final = ((3, "Inhibit time", _U16), (5, "Event timer", _U16), (6, "SYNC start value", _U8))
_PDOS: Final = ((0x1400, "RPDO"), (0x1800, "TPDO"))
_MOST_PDOS: Final = 16
_MOST_SUBS: Final = 64
_MAPPED: Final = 8


def probe_device(reader: ObjectReader) -> EdsDevice:
    """Ask a node for the objects of CiA 301; what else it has stays unknown.

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


RPDOS: Final = range(0x1400, 0x1600)
_TPDOS: Final = range(0x1800, 0x1A00)
_MAPPING: Final = 0x200
"""A mapping parameter is so far behind its communication parameter."""

_LOOKED_AT: Final = 16
"""PDOs of each direction that are read; a node may have 512."""

_MOST_MAPPED: Final = 64
"""More is said of multiplexed PDOs."""

_COB_ID: Final = 1
_TYPE: Final = 2
_INHIBIT: Final = 3
_EVENT_TIMER: Final = 5
_SYNC_START: Final = 6

_EVENT_DRIVEN: Final = (254, 255)
_CYCLIC: Final = range(1, 241)


@dataclass(frozen=True, slots=True, kw_only=True)
class BoundPdo(PdoDescription):
    """A PDO as it was found.

    Attributes:
        index: of its communication parameter, 1400h.. or 1800h...
        subs: sub-indices that its communication parameter has.
        remappable: its mapping and its COB-ID may be written.
        places: how many objects can be mapped.
        restless: it has an inhibit time, or an event timer, that cannot be switched off.
    """

    index: int
    subs: frozenset[int]
    remappable: bool
    places: int
    restless: bool = False

    @property
    def mapping_index(self) -> int:
        """Index of its mapping parameter."""
        return self.index + _MAPPING

    def place(self, address: tuple[int, int]) -> tuple[int, int] | None:
        """Return how many bytes are before an object that it carries, and how many behind."""
        for mapped, before in fields(self.mapping):
            if (mapped.index, mapped.sub) == address:
                whole = not before % 8 and not mapped.bits % 8
                return (before // 8, self.size - (before + mapped.bits) // 8) if whole else None
        return None


class _PdoKind(NamedTuple):
    """A name in checks, what it stands for in words, and which PDOs are of that kind."""

    name: str
    what: str
    fits: Callable[[BoundPdo], bool]


def _kinds(way: str) -> Iterator[_PdoKind]:
    """Give the kinds that both directions have."""
    pdo = way.upper()
    yield _PdoKind(way, pdo, lambda pdo: True)
    yield _PdoKind(f"{way}_enabled", f"{pdo} that is enabled", lambda pdo: pdo.enabled)
    yield _PdoKind(f"{way}_disabled", f"{pdo} that is disabled", lambda pdo: not pdo.enabled)
    yield _PdoKind(
        f"{way}_async",
        f"{pdo} that is enabled, event-driven, has a mapping and no timer that cannot be stopped",
        lambda pdo: (
            pdo.enabled
            and bool(pdo.mapping)
            and pdo.transmission_type in _EVENT_DRIVEN
            and not pdo.restless
        ),
    )
    yield _PdoKind(
        f"{way}_sync",
        f"{pdo} that is enabled, synchronous and has a mapping",
        lambda pdo: pdo.enabled and bool(pdo.mapping) and pdo.transmission_type in _CYCLIC,
    )
    what = f"{pdo} with a mapping that may be changed"
    yield _PdoKind(f"{way}_remappable", what, lambda pdo: pdo.remappable and not pdo.restless)
    yield _PdoKind(
        f"{way}_event_timer",
        f"{pdo} with an event timer",
        lambda pdo: pdo.remappable and _EVENT_TIMER in pdo.subs,
    )


CARRIED: Final[dict[str, tuple[int, int]]] = {
    "tpdo_di1": (0x6000, 1),
    "tpdo_ai1": (0x6401, 1),
    "rpdo_do1": (0x6200, 1),
    "rpdo_ao1": (0x6411, 1),
}
"""Names of event-driven PDOs that carry the first input or output of a module of CiA 401."""


def _carrying(way: str) -> Iterator[_PdoKind]:
    """Give the kinds that carry an object."""
    for name, (index, sub) in CARRIED.items():
        if name.startswith(way):
            what = f"{way.upper()} that is enabled, event-driven and carries {index:04X}h:{sub:02X}"
            yield _PdoKind(name, what, partial(_carries, (index, sub)))


def _carries(address: tuple[int, int], pdo: BoundPdo) -> bool:
    driven = pdo.enabled and pdo.transmission_type in _EVENT_DRIVEN
    return driven and pdo.place(address) is not None


_TPDO_KINDS: Final = (
    *_kinds("tpdo"),
    *_carrying("tpdo"),
    _PdoKind("tpdo_inhibit", "TPDO with an inhibit time", lambda pdo: _INHIBIT in pdo.subs),
    _PdoKind(
        "tpdo_sync_start", "TPDO with a SYNC start value", lambda pdo: _SYNC_START in pdo.subs
    ),
    _PdoKind(
        "tpdo_rtr",
        "TPDO that may be fetched with a remote frame",
        lambda pdo: pdo.enabled and bool(pdo.mapping) and not pdo.cob_id & FLAG_30,
    ),
)
_RPDO_KINDS: Final = (*_kinds("rpdo"), *_carrying("rpdo"))
_MAPPED_RPDO: Final = "mapped_rpdo"
PDO_NAMES: Final = (*(kind.name for kind in (*_TPDO_KINDS, *_RPDO_KINDS)), _MAPPED_RPDO)


def bind_pdos(
    device: EdsDevice, reader: ObjectReader, may_write: Callable[[int], bool]
) -> tuple[dict[str, BoundPdo], dict[str, str]]:
    """Find a PDO of each kind.

    `mapped_rpdo` is one whose objects may all be written; to the others nothing is sent as
    long as they are mapped as they are.

    Args:
        device: what its EDS says.
        reader: reads the node.
        may_write: whether an object may be written.

    Returns:
        What was found, and the reasons why the rest was not, by name.
    """
    bound: dict[str, BoundPdo] = {}
    reasons: dict[str, str] = {}
    tpdos, rpdos = list(_read(device, reader, _TPDOS)), list(_read(device, reader, RPDOS))
    for name, what, fits in (*_TPDO_KINDS, *_RPDO_KINDS, _harmless(may_write)):
        pdo = next(filter(fits, tpdos if name.startswith("t") else rpdos), None)
        if pdo is None:
            reasons[name] = f"the node has no {what}"
        else:
            bound[name] = pdo
    return bound, reasons


def _harmless(may_write: Callable[[int], bool]) -> _PdoKind:
    return _PdoKind(
        _MAPPED_RPDO,
        "RPDO that is enabled and whose objects may be written without moving anything",
        lambda pdo: (
            pdo.enabled
            and bool(pdo.mapping)
            and all(may_write(mapped.index) for mapped, _ in fields(pdo.mapping))
        ),
    )


def _read(device: EdsDevice, reader: ObjectReader, area: range) -> Iterator[BoundPdo]:
    """Read the first PDOs of a direction; those that are incomplete or 29-bit are passed over."""
    subs: dict[int, dict[int, bool]] = {}
    for entry in device.entries:
        subs.setdefault(entry.index, {})[entry.sub] = entry.writable
    for index in [index for index in subs if index in area][:_LOOKED_AT]:
        cob_id, kind = reader.number(index, _COB_ID), reader.number(index, _TYPE)
        mapping = _mapping(reader, index + _MAPPING)
        if cob_id is None or kind is None or mapping is None or cob_id & EXTENDED:
            continue
        head, body = subs[index], dict(subs.get(index + _MAPPING, {}))
        changeable = body.pop(0, False) and any(body.values()) and head.get(_COB_ID, False)
        yield BoundPdo(
            *(cob_id, mapping, kind),
            relative=False,
            index=index,
            subs=frozenset(head),
            remappable=changeable,
            places=len(body),
            restless=any(
                head.get(sub) is False and reader.number(index, sub)
                for sub in (_INHIBIT, _EVENT_TIMER)
            ),
        )


def _mapping(reader: ObjectReader, index: int) -> tuple[int, ...] | None:
    count = reader.number(index, 0)
    if count is None or count > _MOST_MAPPED:
        return None
    mapped = (reader.number(index, sub) for sub in range(1, count + 1))
    return tuple(number for number in mapped if number is not None)
