"""Which CAN-ID carries which PDO of which node."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final, NamedTuple

from tickrig.host.monitor.decode.objects.memory import STATUSWORD, NodeMemory
from tickrig.host.monitor.decode.pdo.pdo_layout import (
    DUMMIES,
    MPDO,
    UNMAPPED,
    Field,
    MpdoLayout,
    PdoLayout,
    make_field,
)
from tickrig.wire.canopen.cob_id import CAN_ID_MASK, EXTENDED, INVALID
from tickrig.wire.canopen.pdo import MAX_MAPPED_OBJECTS, MappedObject

PDOS: Final = 512
PREDEFINED: Final = 4
"""So many PDOs of each direction have a CAN-ID in the pre-defined connection set."""
PDO_OBJECTS: Final = range(0x1400, 0x1C00)

_TPDO, _RPDO = "tpdo", "rpdo"
_INDICES: Final = {_TPDO: (0x1800, 0x1A00, 0x180), _RPDO: (0x1400, 0x1600, 0x200)}
"""First communication parameter, first mapping, pre-defined CAN-ID of the first PDO."""

Layout = PdoLayout | MpdoLayout


class Pdo(NamedTuple):
    """One PDO of one node; those that are sent come first."""

    receives: bool
    node: int
    number: int

    @property
    def kind(self) -> str:
        """As `Decoded.kind`."""
        return f"{_RPDO if self.receives else _TPDO}{self.number}"


class PdoTable:
    """PDOs by CAN-ID, as far as anybody said what they are."""

    def __init__(self) -> None:
        self._by_can_id: dict[int, dict[Pdo, Layout]] = {}
        self._can_ids: dict[Pdo, int] = {}

    def layout(self, can_id: int) -> Layout | None:
        """Return what carries this CAN-ID: who sends it, rather than who receives it."""
        claims = self._by_can_id.get(can_id)
        return claims[min(claims)] if claims else None

    def update(self, pdo: Pdo, memory: NodeMemory) -> set[int]:
        """Read again what is known of a PDO; return the CAN-IDs whose meaning may be new."""
        before = self._can_ids.pop(pdo, None)
        if before is not None:
            del self._by_can_id[before][pdo]
        can_id, layout = _can_id(pdo, memory), _layout(pdo, memory)
        if can_id is None or layout is None:
            return set() if before is None else {before}
        self._can_ids[pdo] = can_id
        self._by_can_id.setdefault(can_id, {})[pdo] = layout
        return {can_id} if before is None else {can_id, before}

    def known(self, node: int) -> tuple[Pdo, ...]:
        """Return the PDOs of a node that have a CAN-ID."""
        return tuple(pdo for pdo in self._can_ids if pdo.node == node)


def pdo_of(node: int, index: int) -> Pdo:
    """Return the PDO that an object 1400h to 1BFFh is about."""
    return Pdo(index < 0x1800, node, index % PDOS + 1)


def pdos_of(node: int, indices: Iterable[int]) -> set[Pdo]:
    """Return the PDOs that some objects are about."""
    return {pdo_of(node, index) for index in indices if index in PDO_OBJECTS}


def _can_id(pdo: Pdo, memory: NodeMemory) -> int | None:
    """Return its CAN-ID; None if it is not valid or not known."""
    parameter, _, predefined = _INDICES[_RPDO if pdo.receives else _TPDO]
    cob_id = memory.number(parameter + pdo.number - 1, 1)
    if cob_id is not None:
        return None if cob_id & (INVALID | EXTENDED) else cob_id & CAN_ID_MASK
    if pdo.number > PREDEFINED:
        return None
    return predefined + 0x100 * (pdo.number - 1) + pdo.node


def _layout(pdo: Pdo, memory: NodeMemory) -> Layout | None:
    parameter, mapping, _ = (
        first + pdo.number - 1 for first in _INDICES[_RPDO if pdo.receives else _TPDO]
    )
    count, source = memory.number(mapping, 0), memory.source(mapping)
    if count is None:
        source = memory.source(parameter)
        note = f"{UNMAPPED}: {mapping:04X}h was not heard"
        return PdoLayout((pdo.kind, pdo.node, source), note=note) if source else None
    if count in MPDO:
        return MpdoLayout((pdo.kind, pdo.node, source), memory.describe)
    entries = _entries(memory, mapping, min(count, MAX_MAPPED_OBJECTS))
    if (STATUSWORD, 16) in {((item.index, item.sub), item.bits) for item in entries}:
        memory.maps_statusword()
    missing = f"and {mapping:04X}h:{len(entries) + 1:02X}, which was not heard"
    note = missing if len(entries) < count else ""
    bits = sum(item.bits for item in entries)
    fields = _fields(memory, entries)
    return PdoLayout((pdo.kind, pdo.node, source), fields, bits, note)


def _entries(memory: NodeMemory, mapping: int, count: int) -> list[MappedObject]:
    """Return the mapped objects up to the first that is not known."""
    entries = []
    for sub in range(1, count + 1):
        value = memory.number(mapping, sub)
        if value is None:
            break
        entries.append(MappedObject.parse(value))
    return entries


def _fields(memory: NodeMemory, entries: list[MappedObject]) -> list[Field]:
    fields, shift = [], 0
    for item in entries:
        if item.index not in DUMMIES:
            text = memory.describe(item.index, item.sub)
            fields.append(make_field(item, shift, text))
        shift += item.bits
    return fields
