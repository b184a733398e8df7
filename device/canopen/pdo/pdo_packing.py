"""From mapped entries to the bytes of a PDO and back, prepared once per mapping."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from operator import attrgetter
from typing import Final, NamedTuple

from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.twin import Part
from tickrig.wire.canopen.pdo import pack_bits, unpack_bits

Pack = Callable[[], bytes]
Unpack = Callable[[bytes], None]


class Slot(NamedTuple):
    """One mapped object.

    Attributes:
        entry: None for a dummy, which takes up bits of an RPDO and goes nowhere.
        bits: length in the PDO.
    """

    entry: Entry | None
    bits: int

    @property
    def whole(self) -> bool:
        """Whether all bytes of the entry are mapped, no bit more or less."""
        return self.entry is not None and 8 * self.entry.size == self.bits


_data: Final[attrgetter[bytes]] = attrgetter("data")


def total_bits(slots: tuple[Slot, ...]) -> int:
    """Return the length of a PDO in bits."""
    return sum(slot.bits for slot in slots)


def alone_in(slots: tuple[Slot, ...]) -> Entry | None:
    """Return the entry whose bytes are those of a TPDO; None if it takes more to make them."""
    entry = slots[0].entry if len(slots) == 1 and slots[0].whole else None
    return None if entry is None or entry.source is not None else entry


def make_pack(slots: tuple[Slot, ...]) -> Pack:
    """Return what makes the bytes of a TPDO out of the entries.

    An object that is mapped shorter than it is gives its low bytes.
    """
    entries = [slot.entry for slot in slots if slot.entry is not None]
    if not all(slot.whole for slot in slots):
        return _Bits(slots).pack
    if any(entry.source is not None for entry in entries):
        return partial(_join_present, entries)
    return partial(_data, entries[0]) if len(entries) == 1 else partial(_join, entries)


def make_unpack(slots: tuple[Slot, ...]) -> Unpack:
    """Return what gives the bytes of an RPDO, which must be enough, to the entries.

    An object that is mapped shorter than it is gets zeros above, as CANopenNode
    does it; bytes behind the last object are for nobody.
    """
    if not all(slot.whole or (slot.entry is None and slot.bits % 8 == 0) for slot in slots):
        return _Bits(slots).unpack
    steps, position = [], 0
    for entry, bits in slots:
        end = position + bits // 8
        if entry is not None:
            steps.append((make_write(entry), position, end))
        position = end
    return partial(_split, steps)


def make_write(entry: Entry) -> Unpack:
    """Return what writes an entry from a PDO: the straight way if nobody judges the entry."""
    straight = entry.takes_all or not entry.description.writable
    return entry.assign if straight else entry.receive


def present(entry: Entry) -> bytes:
    """Return the bytes of an entry that may be made on demand; the last ones if none can be."""
    try:
        return entry.present()
    except SdoAbort:
        return entry.data


def _join(entries: list[Entry]) -> bytes:
    return b"".join(map(_data, entries))


def _join_present(entries: list[Entry]) -> bytes:
    return b"".join(map(present, entries))


def _split(steps: list[tuple[Unpack, int, int]], data: bytes) -> None:
    for write, start, end in steps:
        write(data[start:end])


class _Bits(Part):
    """Objects that do not fill whole bytes, behind each other."""

    __slots__ = ("_slots",)

    def __init__(self, slots: tuple[Slot, ...]) -> None:
        self._slots = slots

    def pack(self) -> bytes:
        return pack_bits(
            (int.from_bytes(present(entry), "little"), bits)
            for entry, bits in self._slots
            if entry is not None
        )

    def unpack(self, data: bytes) -> None:
        values = unpack_bits(data, [slot.bits for slot in self._slots])
        for value, (entry, bits) in zip(values, self._slots, strict=True):
            if entry is not None:
                make_write(entry)(value.to_bytes(entry.size or bits // 8, "little"))
