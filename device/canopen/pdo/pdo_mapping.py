"""PDO mapping parameter, 1600h.. and 1A00h.. (CiA 301, PDO mapping parameter)."""

from __future__ import annotations

from typing import Final

from tickrig.device.canopen.core.abort import SdoAbort, whole_number
from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.pdo.mpdo import DISPATCHING_LISTS, SCANNER_LISTS
from tickrig.device.canopen.pdo.pdo_packing import Slot, total_bits
from tickrig.device.canopen.pdo.pdo_parameters import PdoParameters
from tickrig.device.twin import Part
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.eds.object_table import Access
from tickrig.wire.canopen.pdo import (
    DAM_MPDO,
    MAX_MAPPED_OBJECTS,
    MAX_PDO_BITS,
    SAM_MPDO,
    MappedObject,
)
from tickrig.wire.canopen.sdo.abort import AbortCode

DUMMIES: Final = {
    kind.value: kind.bits
    for kind in (
        *(DataType.BOOLEAN, DataType.INTEGER8, DataType.INTEGER16, DataType.INTEGER32),
        *(DataType.UNSIGNED8, DataType.UNSIGNED16, DataType.UNSIGNED32),
    )
}
"""Data types that fill up an RPDO, and their bits (CiA 301, dummy mapping)."""

SAM_LISTS: Final = {Access.RPDO: DISPATCHING_LISTS, Access.TPDO: SCANNER_LISTS}
"""Without a dispatching or a scanner list there is no MPDO in source address mode."""

_NOTHING: Final = MappedObject(0, 0, 0)


class PdoMapping(Part):
    """What a PDO carries, and the order in which it may be changed.

    An object is mapped while the PDO is invalid and sub-index 0 is 0; it is
    judged at once, and all of them again when sub-index 0 is set. 0 takes an
    object out. A default mapping is carried out even where the dictionary does
    not call an object mappable, because many EDS files do not; one that names
    missing objects or too many bits leaves the PDO without effect.

    Args:
        dictionary: where the mapped objects are.
        index: of the mapping parameter.
        direction: Access.RPDO or Access.TPDO.
        parameters: know whether the PDO is valid.
    """

    def __init__(
        self, dictionary: Dictionary, index: int, direction: Access, parameters: PdoParameters
    ) -> None:
        self._dictionary, self._direction, self._parameters = dictionary, direction, parameters
        self._count = dictionary.find(index)
        self._objects = dictionary.elements(index, MAX_MAPPED_OBJECTS)
        if self._count is not None:
            self._count.guard = self._check_count
        check = self._check_object
        for entry in self._objects:
            entry.guard = check

    @property
    def count(self) -> int:
        """Sub-index 0: number of mapped objects, `SAM_MPDO` or `DAM_MPDO`."""
        return len(self._objects) if self._count is None else self._count.number

    def slots(self) -> tuple[Slot, ...]:
        """Return what is mapped; nothing if that cannot be carried out, or for an MPDO."""
        try:
            slots = self._slots(self.count)
        except SdoAbort:
            return ()
        return slots if total_bits(slots) <= MAX_PDO_BITS else ()

    def _slots(self, count: int) -> tuple[Slot, ...]:
        if count > len(self._objects):
            raise SdoAbort(AbortCode.PDO_LENGTH)
        mapped = [MappedObject.parse(entry.number) for entry in self._objects[:count]]
        return tuple(self._slot(each) for each in mapped if each != _NOTHING)

    def _slot(self, mapped: MappedObject) -> Slot:
        """Find an object; SdoAbort if there is none or it has not so many bits."""
        if mapped.sub == 0 and mapped.index in DUMMIES and self._direction is Access.RPDO:
            if not 0 < mapped.bits <= DUMMIES[mapped.index]:
                raise SdoAbort(AbortCode.NOT_MAPPABLE)
            return Slot(None, mapped.bits)
        entry = self._dictionary.look_up(mapped.index.to_bytes(2, "little") + bytes((mapped.sub,)))
        if not _fits(entry, mapped.bits):
            raise SdoAbort(AbortCode.NOT_MAPPABLE)
        return Slot(entry, mapped.bits)

    def _check_slot(self, slot: Slot) -> None:
        """Refuse what the dictionary does not let into a PDO of this direction."""
        if slot.entry is not None and self._direction not in slot.entry.description.access:
            raise SdoAbort(AbortCode.NOT_MAPPABLE)

    def _check_object(self, entry: Entry, value: Value) -> None:
        if self._parameters.valid or self.count:
            raise SdoAbort(AbortCode.UNSUPPORTED_ACCESS)
        mapped = MappedObject.parse(whole_number(value))
        if mapped != _NOTHING:
            self._check_slot(self._slot(mapped))

    def _check_count(self, entry: Entry, value: Value) -> None:
        if self._parameters.valid:
            raise SdoAbort(AbortCode.UNSUPPORTED_ACCESS)
        count = whole_number(value)
        if count == DAM_MPDO or (count == SAM_MPDO and self._has_sam_list()):
            return
        slots = self._slots(count)
        for slot in slots:
            self._check_slot(slot)
        if total_bits(slots) > MAX_PDO_BITS:
            raise SdoAbort(AbortCode.PDO_LENGTH)
        if count and not slots:
            raise SdoAbort(AbortCode.VALUE_RANGE)

    def _has_sam_list(self) -> bool:
        return any((index, 0) in self._dictionary for index in SAM_LISTS[self._direction])


def _fits(entry: Entry, bits: int) -> bool:
    """Return whether an object has so many bits; a string has whole bytes."""
    if entry.size:
        return 0 < bits <= 8 * entry.size
    return 0 < bits <= 8 * min(entry.description.max_bytes, 8) and bits % 8 == 0
