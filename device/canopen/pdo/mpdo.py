"""MPDO lists: which objects go into multiplexed PDOs (CiA 301, object scanner list)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.entry import Entry
from tickrig.wire.canopen.eds.object_table import Access
from tickrig.wire.canopen.pdo import MPDO_DATA_BYTES, Dispatched, Scanned

SCANNER_LISTS: Final = range(0x1FA0, 0x1FD0)
DISPATCHING_LISTS: Final = range(0x1FD0, 0x2000)

Source = tuple[int, int, int]
"""Node-ID, index and sub-index of a producer's object."""


def fits_mpdo(entry: Entry, direction: Access) -> bool:
    """Say whether an object may be in an MPDO: mappable and of one to four bytes."""
    return direction in entry.description.access and 0 < entry.size <= MPDO_DATA_BYTES


def scanned_entries(dictionary: Dictionary) -> Iterator[Entry]:
    """Give the objects of the scanner lists that an MPDO can carry."""
    for value in _list_values(dictionary, SCANNER_LISTS):
        row = Scanned.parse(value)
        for step in range(row.block):
            entry = dictionary.find(row.index, row.sub + step)
            if entry is not None and fits_mpdo(entry, Access.TPDO):
                yield entry


def dispatched_entries(dictionary: Dictionary) -> Iterator[tuple[Source, Entry]]:
    """Give the objects of the dispatching lists, each with where its value comes from."""
    for value in _list_values(dictionary, DISPATCHING_LISTS):
        row = Dispatched.parse(value)
        for step in range(row.block):
            entry = dictionary.find(row.index, row.sub + step)
            if entry is not None and fits_mpdo(entry, Access.RPDO):
                yield (row.node_id, row.producer_index, row.producer_sub + step), entry


def _list_values(dictionary: Dictionary, lists: range) -> Iterator[int]:
    """Give the entries in use: sub-index 0 says how many, 0 is an empty one."""
    for index in lists:
        count = dictionary.find(index)
        if count is not None:
            used = dictionary.elements(index)[: count.number]
            yield from (entry.number for entry in used if entry.number)
