"""The PDO sections of a node: their writes, and the resulting PDOs of both sides."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

from tickrig.host.canopen.bus_file.bus_values import BusPdo
from tickrig.host.canopen.bus_file.known_keys import PDO, check_keys
from tickrig.host.canopen.bus_file.notes import UNSIGNED8, UNSIGNED16, BusFileSection
from tickrig.host.canopen.bus_file.sheet import Sheet, Writes
from tickrig.wire.canopen.eds.eds_file import shorten
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription
from tickrig.wire.canopen.nmt import INVALID
from tickrig.wire.canopen.pdo import MAX_PDO_BITS, MappedObject

RPDO: Final = 0x1400
TPDO: Final = 0x1800
_MAPPING: Final = 0x200
_PREDEFINED: Final = 4
_AUTO: Final = "auto"
_OTHER_WAY: Final = {
    True: ("event_deadline",),
    False: ("event_timer", "inhibit_time", "sync_start"),
}
"""Keys that dcfgen reads only for PDOs of the other direction.

The key is whether the PDO is a TPDO.
"""
_PARAMETERS: Final = (
    ("transmission", "transmission", 2, UNSIGNED8),
    ("inhibit_time", "inhibit_time_100us", 3, UNSIGNED16),
    ("event_timer", "event_timer_ms", 5, UNSIGNED16),
    ("sync_start", "sync_start", 6, UNSIGNED8),
)
"""Keys of a PDO, each with its field, its sub-index and the highest value."""
_FIRST_FREE: Final = 0x680
_END_OF_FREE: Final = 0x6E0


class CobIds:
    """The COB-IDs that `auto` assigns to PDOs beyond the fourth, in ascending order."""

    def __init__(self) -> None:
        self._next = _FIRST_FREE

    def take(self) -> int | None:
        """Return the next free COB-ID, or None if all COB-IDs are taken."""
        if self._next >= _END_OF_FREE:
            return None
        self._next += 1
        return self._next - 1


_MAPPED: Final = ("index", "sub_index", "bits")


class PdoReader:
    """Reader for the PDO settings of one slave, which are in the sections `rpdo` and `tpdo`.

    Args:
        node: section of the slave in the bus.yml.
        sheet: EDS or DCF of the slave.
        writes: collector of the SDO writes that configure the slave.
        cob_ids: source of free COB-IDs, shared by all nodes of the bus. They are used for PDOs with
            `cob_id: auto` from the fifth PDO of a node on. The first four PDOs have default
            COB-IDs.
    """

    def __init__(self, node: BusFileSection, sheet: Sheet, writes: Writes, cob_ids: CobIds) -> None:
        self._node, self._sheet, self._writes, self._cob_ids = node, sheet, writes, cob_ids

    def read(self, key: str, first: int) -> tuple[BusPdo, ...]:
        """Read the RPDOs or the TPDOs of the slave, and collect the writes that configure them.

        Args:
            key: section to read, `rpdo` or `tpdo`.
            first: index of the communication parameter of PDO 1.

        Returns:
            The PDOs of the slave that the master uses. The caller adds them to the PDOs in the
            object dictionary of the master.
        """
        pdos = {
            index - first + 1: _of_sheet(self._sheet, index) for index in self._sheet.pdos(first)
        }
        if key in self._node:
            section = self._node.section(key)
            for number in section.fields:
                pdo = pdos.get(number) if isinstance(number, int) else None
                if pdo is None:
                    what = f"{key} {shorten(str(number))} is not in {self._sheet.path.name}"
                    text = f"{what}, which has {_said(pdos)}"
                    section.note("pdo-missing", number, text)
                else:
                    one = section.section(number)
                    pdos[pdo.number] = self._configured(pdo, first + pdo.number - 1, one)
        return tuple(pdo for pdo in pdos.values() if pdo.enabled and pdo.mapping)

    def _configured(self, pdo: BusPdo, index: int, section: BusFileSection) -> BusPdo:
        """Write differences from the EDS as dcfgen does: disable, parameters, mapping, enable."""
        check_keys(section, PDO)
        for key in _OTHER_WAY[pdo.transmit]:
            if key in section:
                kind = "a TPDO" if pdo.transmit else "an RPDO"
                section.note("pdo-key", key, f"{key} of {kind}: dcfgen does not write it")
        place = section.place
        was, pdo = pdo.cob_id, replace(pdo, cob_id=self._cob_id(pdo, section))
        if was != pdo.cob_id | INVALID:
            self._writes.add(index, 1, pdo.cob_id | INVALID, section.place_of("cob_id"))
        if not pdo.enabled:
            if section.flag("enabled", "mapping" in section and "cob_id" not in section):
                where = self._sheet.place(index, 1)
                text = f"cob_id is 0x{pdo.cob_id:08X}, with bit 31: it stays off: {where}"
                section.note("not-enabled", "enabled", text)
            return pdo
        pdo = self._with_parameters(pdo, index, section)
        if "mapping" in section:
            pdo = self._with_mapping(pdo, index + _MAPPING, section)
        if section.flag("enabled", default=True):
            self._writes.add(index, 1, pdo.cob_id, place)
        elif pdo.mapping and pdo.transmit:
            text = "the PDO is off, but the master still uses it: its EDS maps objects into it"
            section.note("not-disabled", "enabled", text)
        return pdo

    def _cob_id(self, pdo: BusPdo, section: BusFileSection) -> int:
        item = section.fields.get("cob_id")
        if item is None:
            return pdo.cob_id
        if item.value != _AUTO:
            return section.whole("cob_id", pdo.cob_id)
        if pdo.number <= _PREDEFINED:
            base = 0x80 if pdo.transmit else 0x100
            return pdo.number * 0x100 + base + self._sheet.node_id
        taken = self._cob_ids.take()
        if taken is None:
            text = f"auto: none is left, 0x{_FIRST_FREE:X}..0x{_END_OF_FREE - 1:X} are taken"
            section.note("cob-id-none", "cob_id", text)
            return pdo.cob_id
        return taken

    def _with_parameters(self, pdo: BusPdo, index: int, section: BusFileSection) -> BusPdo:
        """Read the parameters in the file. Do not write the parameters of the other direction."""
        changed: dict[str, Any] = {}
        given = [
            section.whole(key, getattr(pdo, field), 0, most) for key, field, _, most in _PARAMETERS
        ]
        for (key, field, sub, _), number in zip(_PARAMETERS, given, strict=True):
            if number != getattr(pdo, field) and key not in _OTHER_WAY[pdo.transmit]:
                self._writes.add(index, sub, number, section.place_of(key))
                changed[field] = number
        if not pdo.transmit:
            deadline = section.whole("event_deadline", pdo.event_timer_ms, 0, UNSIGNED16)
            if deadline != pdo.event_timer_ms:
                text = "event_deadline of an RPDO: dcfgen fails on it"
                section.note("event-deadline", "event_deadline", text)
        return replace(pdo, **changed)

    def _with_mapping(self, pdo: BusPdo, index: int, section: BusFileSection) -> BusPdo:
        place = section.place_of("mapping")
        entries = section.sections("mapping")
        if entries or self._sheet.value(index, 0):
            self._writes.add(index, 0, 0, place)
        mapping: list[MappedObject] = []
        for entry in entries:
            check_keys(entry, _MAPPED)
            mapped = self._mapped(entry, pdo)
            if mapped is not None:
                mapping.append(mapped)
                self._writes.add(index, len(mapping), mapped.encode(), entry.place)
        bits = sum(mapped.bits for mapped in mapping)
        if bits > MAX_PDO_BITS:
            section.note("pdo-length", "mapping", f"{bits} bits are mapped; 64 at most")
        if mapping:
            self._writes.add(index, 0, len(mapping), place)
        return replace(pdo, mapping=tuple(mapping))

    def _mapped(self, entry: BusFileSection, pdo: BusPdo) -> MappedObject | None:
        """Return the object that a mapping entry maps, or None if the object does not exist."""
        if "index" not in entry:
            entry.note("kind", "index", "an entry of mapping needs an index")
            return None
        if (index := entry.whole("index", -1, 0, UNSIGNED16)) < 0:
            return None
        sub = entry.whole("sub_index", 0, 0, UNSIGNED8)
        row = self._sheet.row(index, sub)
        what = f"{index:04X}h:{sub:02X}"
        if row is None:
            text = f"{what} does not exist: {self._sheet.beside(index)}"
            entry.note("object-missing", "index", text)
            return None
        self._check_mappable(entry, row, what, pdo)
        if (bits := entry.whole("bits", row.data_type.bits)) != row.data_type.bits:
            where = self._sheet.place(index, sub)
            entry.note(
                "mapped-length",
                "bits",
                f"bits: {bits}, but {what} has {row.data_type.bits}: {where}",
            )
        if not row.data_type.bits:
            text = f"{what} is a {row.data_type.name}, which cannot be mapped into a PDO"
            entry.note("value-type", "index", text)
            return None
        return MappedObject(index, sub, row.data_type.bits)

    def _check_mappable(
        self, entry: BusFileSection, row: EntryDescription, what: str, pdo: BusPdo
    ) -> None:
        place = self._sheet.place(row.index, row.sub)
        if not row.access & (Access.TPDO | Access.RPDO):
            entry.note("not-mappable", "index", f"{what} cannot be mapped: {place}")
        elif not row.access & (Access.TPDO if pdo.transmit else Access.RPDO):
            kind = "TPDO" if pdo.transmit else "RPDO"
            entry.note("direction", "index", f"{what} cannot be mapped into a {kind}: {place}")


def _said(pdos: dict[int, BusPdo]) -> str:
    """Return the existing PDO numbers, as text for messages."""
    return ", ".join(map(str, list(pdos)[:12])) + (", ..." if len(pdos) > 12 else "") or "none"


def _of_sheet(sheet: Sheet, index: int) -> BusPdo:
    """Return a PDO with its power-on values."""
    count = sheet.value(index, 0)

    def value(at: int, sub: int, default: int = 0) -> int:
        return default if at == index and sub > count else sheet.value(at, sub, default)

    pdo = _pdo(sheet, index, value)
    return replace(pdo, mapping=tuple(mapped for mapped in pdo.mapping if mapped.encode()))


def _pdo(sheet: Sheet, index: int, value: Callable[..., int]) -> BusPdo:
    """Return a PDO with the values that a function gives for an index and a sub-index."""
    transmit, mapping = index >= TPDO, index + _MAPPING
    count = value(mapping, 0)
    mapped = (value(mapping, sub) for sub in sheet.subs(mapping) if 1 <= sub <= count)
    return BusPdo(
        index - (TPDO if transmit else RPDO) + 1,
        transmit,
        value(index, 1, INVALID),
        value(index, 2),
        inhibit_time_100us=value(index, 3) if transmit else 0,
        event_timer_ms=value(index, 5),
        sync_start=value(index, 6) if transmit else 0,
        mapping=tuple(map(MappedObject.parse, mapped)),
    )


def pdos_after(sheet: Sheet, writes: Writes) -> tuple[BusPdo, ...]:
    """Return all PDOs of a slave as they are after the writes, RPDOs first."""
    written = writes.values()

    def value(index: int, sub: int, default: int = 0) -> int:
        data = written.get(index << 8 | sub)
        return sheet.value(index, sub, default) if data is None else int.from_bytes(data, "little")

    return tuple(_pdo(sheet, index, value) for first in (RPDO, TPDO) for index in sheet.pdos(first))
