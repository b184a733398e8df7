"""Dictionaries out of objects that are written down as a manual lists them."""

from __future__ import annotations

from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.entry import Entry
from tickrig.wire.canopen.eds.object_table import (
    CONST,
    RO,
    ROT,
    RW,
    RWRW,
    RWW,
    WO,
    Element,
    ObjectRow,
    ObjectTable,
)

__all__ = ["CONST", "RO", "ROT", "RW", "RWRW", "RWW", "WO", "Element", "Objects", "dictionary_of"]


class Objects(ObjectTable):
    """Collects objects and makes a dictionary of them.

    >>> from tickrig.wire.canopen.datatypes import DataType
    >>> objects = Objects()
    >>> objects.array(0x6000, "Read input 8-bit", 1, DataType.UNSIGNED8, ROT)
    >>> [str(entry) for entry in objects.dictionary()]
    ['<6000h:00 Number of entries>', '<6000h:01 Read input 8-bit 1>']
    """

    def dictionary(self) -> Dictionary:
        """Make a dictionary of all objects; each call makes a new one."""
        return dictionary_of(self)


def dictionary_of(table: ObjectTable) -> Dictionary:
    """Make a dictionary of a table; ValueError if an entry is in it twice."""
    return Dictionary((_entry(row) for row in table), table.objects)


def _entry(row: ObjectRow) -> Entry:
    entry = Entry(
        *(row.index, row.sub, row.name, row.data_type, row.access),
        low=row.low,
        high=row.high,
        relative=row.relative,
        max_bytes=row.max_bytes,
    )
    entry.default = entry.data = row.default
    return entry
