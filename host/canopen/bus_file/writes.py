"""The writes of a concise DCF, as dcfgen makes them, held against the EDS."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from tickrig.host.canopen.bus_file.bus_values import BusWrite
from tickrig.host.canopen.bus_file.item import Place
from tickrig.host.canopen.bus_file.notes import Notes
from tickrig.host.canopen.bus_file.sheet import Sheet
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import EntryDescription

FLOATS: Final = (DataType.REAL32, DataType.REAL64)
ODD_SIZES: Final = (3, 5, 6, 7)


class Writes:
    """Collects the writes for one slave.

    Args:
        sheet: of the slave.
        name: of its section.
        notes: take what the EDS contradicts.
    """

    def __init__(self, sheet: Sheet, name: str, notes: Notes) -> None:
        self._sheet, self._name, self._notes = sheet, name, notes
        self._all: list[BusWrite] = []

    @property
    def all(self) -> tuple[BusWrite, ...]:
        """All of them in their order."""
        return tuple(self._all)

    def add(self, index: int, sub: int, value: int, place: Place, said: str = "") -> None:
        """Add a write; what dcfgen refuses is noted and left out.

        Args:
            index: of the object.
            sub: sub-index.
            value: as the file gives it.
            place: what asks for it.
            said: the value as it is written there.
        """
        if (write := self._made(index, sub, value, place, said)) is not None:
            self._all.append(write)

    def insert(self, index: int, sub: int, value: int, place: Place) -> None:
        """Put a write before all others."""
        if (write := self._made(index, sub, value, place, "")) is not None:
            self._all.insert(0, write)

    def values(self) -> dict[int, bytes]:
        """Return what is written last, by index << 8 | sub-index."""
        return {write.index << 8 | write.sub_index: write.data for write in self._all}

    def _made(self, index: int, sub: int, value: int, place: Place, said: str) -> BusWrite | None:
        what, row = f"{index:04X}h:{sub:02X}", self._sheet.row(index, sub)
        kind = DataType.UNSIGNED8
        if row is not None:
            kind = row.data_type
            self._check_access(row, what, place)
        elif sub or index not in self._sheet:
            text = f"{what} is not there: {self._sheet.beside(index)}"
            self._notes.note("object-missing", place, self._name, text)
            return None
        data = self._data(kind, what, value, place, said or str(value))
        if data is None:
            return None
        if row is not None:
            self._check_limits(row, what, value, place)
        return BusWrite(index, sub, data, place)

    def _data(self, kind: DataType, what: str, value: int, place: Place, said: str) -> bytes | None:
        if kind not in FLOATS and not kind.is_integer:
            text = f"{what} is a {kind.name}, of which dcfgen writes none"
            self._notes.note("value-type", place, self._name, text)
            return None
        if kind.size in ODD_SIZES:
            text = f"{what} is a {kind.name}: dcfgen writes more bytes than it says"
            self._notes.note("odd-size", place, self._name, text)
        if kind is DataType.BOOLEAN:  # a byte for dcfgen, whatever is in it
            kind = DataType.UNSIGNED8
        try:
            return kind.encode(float(value) if kind in FLOATS else value)
        except (ValueError, OverflowError):
            text = f"{what}: {said} is no {kind.name}"
            self._notes.note("value-range", place, self._name, text)
            return None

    def _check_access(self, row: EntryDescription, what: str, place: Place) -> None:
        if not row.writable:
            text = f"{what} cannot be written: {self._sheet.place(row.index, row.sub)}"
            self._notes.note("read-only", place, self._name, text)

    def _check_limits(self, row: EntryDescription, what: str, value: int, place: Place) -> None:
        low, high = row.low, row.high
        if (low is not None and value < low) or (high is not None and value > high):
            limits = f"{'' if low is None else low}..{'' if high is None else high}"
            text = f"{what}: {value} is not in {limits}: {self._sheet.place(row.index, row.sub)}"
            self._notes.note("value-limits", place, self._name, text)


def final_places(writes: Iterable[BusWrite]) -> dict[int, Place]:
    """Return what asks for the last write to an entry, by index << 8 | sub-index."""
    return {write.index << 8 | write.sub_index: write.place for write in writes}
