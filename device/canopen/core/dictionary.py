"""The object dictionary: entries by index and sub-index."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import pairwise
from operator import attrgetter
from typing import Final

from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.twin import Immutable, Part
from tickrig.wire.canopen.eds.object_table import EntryDescription, ObjectDescription
from tickrig.wire.canopen.sdo.abort import AbortCode

NO_OBJECTS: Final[Mapping[int, ObjectDescription]] = {}


class DictionaryDescription(Immutable):
    """What never changes in the dictionaries of one type of device; all its slaves share it.

    Args:
        entries: in any order; they are kept sorted.
        objects: names and kinds of arrays and records; a variable is called as its entry.

    Raises:
        ValueError: two entries have the same index and sub-index.

    Attributes:
        entries: sorted by index and sub-index.
        objects: names and kinds by index, sorted.
        places: place among the entries by index << 8 | sub-index.
        spans: places of all entries of an object, by index.
        elements: places of the entries from sub-index 1 on without a gap, by index.
    """

    __slots__ = ("elements", "entries", "objects", "places", "spans")

    def __init__(
        self, entries: Iterable[EntryDescription], objects: Mapping[int, ObjectDescription]
    ) -> None:
        self.entries = tuple(sorted(entries, key=attrgetter("key")))
        self.places = {entry.key: place for place, entry in enumerate(self.entries)}
        if len(self.places) != len(self.entries):
            twice = next(a for a, b in pairwise(self.entries) if a.key == b.key)
            raise ValueError(f"{twice!r} is in the dictionary twice")
        self.objects: Mapping[int, ObjectDescription] = {
            entry.index: objects.get(entry.index, ObjectDescription(entry.name))
            for entry in self.entries
        }

        self.spans: dict[int, slice] = {}
        self.elements: dict[int, slice] = {}
        for place, entry in enumerate(self.entries):
            first = self.spans.get(entry.index, slice(place, place)).start
            self.spans[entry.index] = slice(first, place + 1)
            first = self.elements.get(entry.index, slice(place, place)).start
            if entry.sub == place - first + 1:
                self.elements[entry.index] = slice(first, place + 1)

    def __iter__(self) -> Iterator[EntryDescription]:
        """Give all entries, sorted."""
        return iter(self.entries)


class Dictionary(Part):
    """All entries of one slave: values of its own, and a description that it shares.

    Args:
        entries: in any order; they are kept sorted. Or the description of another dictionary.
        objects: names and kinds of arrays and records; a variable is called as its entry.

    Raises:
        ValueError: two entries have the same index and sub-index.

    Attributes:
        description: names, types, access, limits and defaults.
        by_multiplexer: readable entries that an SDO has named, by the three bytes that do.

    >>> from tickrig.wire.canopen.datatypes import DataType
    >>> from tickrig.wire.canopen.eds.object_table import RW
    >>> dictionary = Dictionary([EntryDescription(0x2000, 0, "Gain", DataType.UNSIGNED8, RW)])
    >>> dictionary[0x2000, 0].value = 5
    >>> dictionary[0x2000, 0].value, dictionary.copy()[0x2000, 0].value
    (5, 0)
    """

    __slots__ = ("_entries", "_only", "_places", "by_multiplexer", "description")

    def __init__(
        self,
        entries: Iterable[EntryDescription],
        objects: Mapping[int, ObjectDescription] = NO_OBJECTS,
    ) -> None:
        if isinstance(entries, DictionaryDescription):
            description = entries
        else:
            description = DictionaryDescription(entries, objects)
        self.description, self._places = description, description.places
        self._entries = list(map(Entry, description.entries))
        self.by_multiplexer: dict[bytes, Entry] = {}
        self._only: frozenset[int] | None = None

    def restrict(self, only: frozenset[int] | None) -> None:
        """Let SDOs find no other objects than some, as those of a boot loader.

        Args:
            only: their indices; None for all that there are.
        """
        self._only = only
        self.by_multiplexer.clear()

    def copy(self) -> Dictionary:
        """Return the same objects with their default values, for another slave."""
        return Dictionary(self.description)

    @property
    def objects(self) -> Mapping[int, ObjectDescription]:
        """Names and kinds by index, sorted."""
        return self.description.objects

    def __iter__(self) -> Iterator[Entry]:
        """Give all entries, sorted."""
        return iter(self._entries)

    def __len__(self) -> int:
        """Return the number of entries."""
        return len(self._entries)

    def __contains__(self, at: tuple[int, int]) -> bool:
        """Return whether there is an entry at (index, sub-index)."""
        return at[0] << 8 | at[1] in self._places

    def __getitem__(self, at: tuple[int, int]) -> Entry:
        """Return the entry at (index, sub-index); KeyError if there is none."""
        entry = self.find(*at)
        if entry is None:
            raise KeyError(f"{at[0]:04X}h:{at[1]:02X} is not in the dictionary")
        return entry

    def find(self, index: int, sub: int = 0) -> Entry | None:
        """Look an entry up.

        Args:
            index: of the object, 0x0000..0xFFFF.
            sub: sub-index, 0x00..0xFF.

        Returns:
            The entry, None if there is none.
        """
        place = self._places.get(index << 8 | sub)
        return None if place is None else self._entries[place]

    def look_up(self, multiplexer: bytes) -> Entry:
        """Look up the entry that an SDO names.

        Args:
            multiplexer: three bytes, the index with its low byte first and the sub-index.

        Returns:
            The entry.

        Raises:
            SdoAbort: there is no such object, or no such sub-index.
        """
        entry = self.by_multiplexer.get(multiplexer)
        if entry is None:
            index = int.from_bytes(multiplexer[:2], "little")
            entry = self.find(index, multiplexer[2])
            there = self._only is None or index in self._only
            if entry is None or not there:
                known = there and index in self.objects
                raise SdoAbort(AbortCode.NO_SUBINDEX if known else AbortCode.NO_OBJECT)
            if entry.description.readable:
                self.by_multiplexer[multiplexer] = entry
        return entry

    def object(self, index: int) -> list[Entry]:
        """List the entries of an object.

        Args:
            index: of the object.

        Returns:
            All of them, sorted; none if there is no such object.
        """
        span = self.description.spans.get(index)
        return [] if span is None else self._entries[span]

    def within(self, area: range) -> list[int]:
        """List the objects in an area.

        Args:
            area: indices, such as `range(0x1000, 0x2000)`.

        Returns:
            Those of which there is an object, sorted.
        """
        return [index for index in self.description.spans if index in area]

    def elements(self, index: int, most: int = 254) -> list[Entry]:
        """List the elements of an array.

        Args:
            index: of the object.
            most: no more than so many.

        Returns:
            Its entries from sub-index 1 on, up to the first gap.
        """
        places = self.description.elements.get(index)
        return [] if places is None else self._entries[places][:most]
