"""From mapped entries to the bytes of a PDO and back, prepared once per mapping."""

from __future__ import annotations

from collections.abc import Callable
from operator import attrgetter
from typing import Final, NamedTuple

from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.device.canopen.core.entry import Entry
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


def make_pack(slots: tuple[Slot, ...]) -> Pack:
    """Return what makes the bytes of a TPDO out of the entries.

    An object that is mapped shorter than it is gives its low bytes.
    """
    entries = [slot.entry for slot in slots if slot.entry is not None]
    if not all(slot.whole for slot in slots):
        return _make_bit_pack(slots)
    if any(entry.source is not None for entry in entries):
        return lambda: b"".join(map(present, entries))
    if len(entries) == 1:
        return lambda: _data(entries[0])
    return lambda: b"".join(map(_data, entries))


def make_unpack(slots: tuple[Slot, ...]) -> Unpack:
    """Return what gives the bytes of an RPDO, which must be enough, to the entries.

    An object that is mapped shorter than it is gets zeros above, as CANopenNode
    does it; bytes behind the last object are for nobody.
    """
    if not all(slot.whole or (slot.entry is None and slot.bits % 8 == 0) for slot in slots):
        return _make_bit_unpack(slots)
    steps, position = [], 0
    for entry, bits in slots:
        end = position + bits // 8
        if entry is not None:
            steps.append((make_write(entry), slice(position, end)))
        position = end

    def unpack(data: bytes) -> None:
        for write, piece in steps:
            write(data[piece])

    return unpack


def make_write(entry: Entry) -> Unpack:
    """Return what writes an entry from a PDO.

    A value that its limits or its owner refuse is not taken, and nobody is told:
    a PDO has no answer. It is the straight way if nobody judges the entry.
    """
    if entry.takes_all or not entry.writable:
        return entry.assign

    def write(data: bytes) -> None:
        try:
            entry.download(data)
        except SdoAbort:
            return

    return write


def present(entry: Entry) -> bytes:
    """Return the bytes of an entry that may be made on demand; the last ones if none can be."""
    if entry.source is None:
        return entry.data
    try:
        return entry.source()
    except SdoAbort:
        return entry.data


def _make_bit_pack(slots: tuple[Slot, ...]) -> Pack:
    fields = [(slot.entry, slot.bits) for slot in slots if slot.entry is not None]

    def pack() -> bytes:
        return pack_bits((int.from_bytes(present(entry), "little"), bits) for entry, bits in fields)

    return pack


def _make_bit_unpack(slots: tuple[Slot, ...]) -> Unpack:
    widths = [slot.bits for slot in slots]
    steps = [
        (place, make_write(entry), entry.size or bits // 8)
        for place, (entry, bits) in enumerate(slots)
        if entry is not None
    ]

    def unpack(data: bytes) -> None:
        values = unpack_bits(data, widths)
        for place, write, size in steps:
            write(values[place].to_bytes(size, "little"))

    return unpack
