"""The object dictionary: entries by index and sub-index."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import pairwise

from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.device.canopen.core.entry import Entry
from tickrig.wire.canopen.eds.object_table import ObjectCode, ObjectInfo
from tickrig.wire.canopen.sdo.abort import AbortCode

__all__ = ["Dictionary", "ObjectCode", "ObjectInfo"]


class Dictionary:
    """All entries of one slave.

    Args:
        entries: in any order; they are kept sorted.
        objects: names and kinds of arrays and records; a variable is called as its entry.

    Raises:
        ValueError: two entries have the same index and sub-index.
    """

    def __init__(
        self, entries: Iterable[Entry], objects: dict[int, ObjectInfo] | None = None
    ) -> None:
        ordered = sorted(entries, key=lambda entry: entry.key)
        self._entries = {entry.key: entry for entry in ordered}
        if len(self._entries) != len(ordered):
            twice = next(a for a, b in pairwise(ordered) if a.key == b.key)
            raise ValueError(f"{twice!r} is in the dictionary twice")
        self.by_multiplexer = {
            entry.index.to_bytes(2, "little") + bytes([entry.sub]): entry for entry in ordered
        }
        known = objects or {}
        self.objects = {
            entry.index: known.get(entry.index, ObjectInfo(entry.name)) for entry in ordered
        }

    def copy(self) -> Dictionary:
        """Return the same objects with their default values, for another slave."""
        twin = Dictionary.__new__(Dictionary)
        entries = [entry.copy() for entry in self._entries.values()]
        twin._entries = dict(zip(self._entries, entries, strict=True))
        twin.by_multiplexer = dict(zip(self.by_multiplexer, entries, strict=True))
        twin.objects = self.objects
        return twin

    def __iter__(self) -> Iterator[Entry]:
        """Give all entries, sorted."""
        return iter(self._entries.values())

    def __len__(self) -> int:
        """Return the number of entries."""
        return len(self._entries)

    def __contains__(self, at: tuple[int, int]) -> bool:
        """Say whether there is an entry at (index, sub-index)."""
        return at[0] << 8 | at[1] in self._entries

    def __getitem__(self, at: tuple[int, int]) -> Entry:
        """Return the entry at (index, sub-index); KeyError if there is none."""
        entry = self.find(*at)
        if entry is None:
            raise KeyError(f"{at[0]:04X}h:{at[1]:02X} is not in the dictionary")
        return entry

    def find(self, index: int, sub: int = 0) -> Entry | None:
        """Return an entry, None if there is none."""
        return self._entries.get(index << 8 | sub)

    def look_up(self, multiplexer: bytes) -> Entry:
        """Return the entry that an SDO names by three bytes; SdoAbort if there is none."""
        entry = self.by_multiplexer.get(multiplexer)
        if entry is None:
            known = int.from_bytes(multiplexer[:2], "little") in self.objects
            raise SdoAbort(AbortCode.NO_SUBINDEX if known else AbortCode.NO_OBJECT)
        return entry

    def elements(self, index: int, most: int = 254) -> list[Entry]:
        """Return the entries of an object from sub-index 1 on, without a gap."""
        found = []
        for sub in range(1, most + 1):
            entry = self.find(index, sub)
            if entry is None:
                break
            found.append(entry)
        return found
