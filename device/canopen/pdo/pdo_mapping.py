"""PDO mapping parameter, 1600h.. and 1A00h.. (CiA 301, PDO mapping parameter)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from operator import attrgetter
from typing import TYPE_CHECKING, ClassVar, Final, NamedTuple

from tickrig.device.canopen.dictionary import Dictionary, Entry, SdoAbort, whole_number
from tickrig.device.canopen.pdo.pdo_parameters import PdoParameters, TpdoMode
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.device.twin import Part
from tickrig.wire.canopen import pdo
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.eds.object_table import Access
from tickrig.wire.canopen.emcy import EmcyCode, ErrorRegister
from tickrig.wire.canopen.sdo_frame import AbortCode
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.device.canopen.pdo.tpdo import Tpdo

# Conversion between mapped entries and the bytes of a PDO, prepared once per mapping.

Pack = Callable[[], bytes]
Unpack = Callable[[bytes], None]


class Slot(NamedTuple):
    """One mapped object of a PDO, with its number of bits.

    Attributes:
        entry: the object, or None for a dummy, which only fills bits of an RPDO.
        bits: number of bits in the PDO.
    """

    entry: Entry | None
    bits: int

    @property
    def whole(self) -> bool:
        """Whether exactly all bytes of the entry are mapped."""
        return self.entry is not None and 8 * self.entry.size == self.bits


_data: Final[attrgetter[bytes]] = attrgetter("data")


def total_bits(slots: tuple[Slot, ...]) -> int:
    """Return the length of a PDO in bits."""
    return sum(slot.bits for slot in slots)


def alone_in(slots: tuple[Slot, ...]) -> Entry | None:
    """Return the entry whose bytes alone are the data of a TPDO, or None."""
    entry = slots[0].entry if len(slots) == 1 and slots[0].whole else None
    return None if entry is None or entry.source is not None else entry


def make_pack(slots: tuple[Slot, ...]) -> Pack:
    """Return a function that packs the present values of mapped objects into the bytes of a TPDO.

    If an object is mapped with fewer bits than it has, the TPDO contains its low bits.
    """
    entries = [slot.entry for slot in slots if slot.entry is not None]
    if not all(slot.whole for slot in slots):
        return _Bits(slots).pack
    if any(entry.source is not None for entry in entries):
        return partial(_join_present, entries)
    # `partial` and attribute getters in place of lambdas: a slave is copied by pickle.
    return partial(_data, entries[0]) if len(entries) == 1 else partial(_join, entries)


def make_unpack(slots: tuple[Slot, ...]) -> Unpack:
    """Return a function that writes the bytes of an RPDO to the mapped objects.

    The RPDO must have enough bytes, and bytes after the last object are ignored. If only the low
    bits of an object are mapped, its other bits are set to 0, as in CANopenNode.
    """
    if not all(slot.whole or (slot.entry is None and slot.bits % 8 == 0) for slot in slots):
        return _Bits(slots).unpack
    steps, position = [], 0
    for entry, bits in slots:
        end = position + bits // 8
        if entry is not None:
            steps.append((_make_write(entry), position, end))
        position = end
    return partial(_split, steps)


def _make_write(entry: Entry) -> Unpack:
    """Return a function that writes an entry from a PDO.

    The function writes directly if the entry has no checks.
    """
    # A read-only object that a default mapping names is written, too; `download` would
    # refuse it.
    straight = entry.takes_all or not entry.description.writable
    return entry.assign if straight else entry.receive


def _present(entry: Entry) -> bytes:
    """Return the bytes of an entry, computed on demand if needed.

    If the computation fails, return the previous bytes.
    """
    try:
        return entry.present()
    except SdoAbort:
        return entry.data


def _join(entries: list[Entry]) -> bytes:
    return b"".join([entry.data for entry in entries])


def _join_present(entries: list[Entry]) -> bytes:
    return b"".join([_present(entry) for entry in entries])


def _split(steps: list[tuple[Unpack, int, int]], data: bytes) -> None:
    for write, start, end in steps:
        write(data[start:end])


class _Bits(Part):
    """Objects that do not fill whole bytes, packed one after the other."""

    __slots__ = ("_slots",)

    def __init__(self, slots: tuple[Slot, ...]) -> None:
        self._slots = slots

    def pack(self) -> bytes:
        return pdo.pack_bits(
            (int.from_bytes(_present(entry), "little"), bits)
            for entry, bits in self._slots
            if entry is not None
        )

    def unpack(self, data: bytes) -> None:
        values = pdo.unpack_bits(data, [slot.bits for slot in self._slots])
        for value, (entry, bits) in zip(values, self._slots, strict=True):
            if entry is not None:
                _make_write(entry)(value.to_bytes(entry.size or bits // 8, "little"))


# Multiplexed PDOs: their lists, producers and consumers (CiA 301, MPDO).

_SCANNER_LISTS: Final = range(0x1FA0, 0x1FD0)
_DISPATCHING_LISTS: Final = range(0x1FD0, 0x2000)

_Source = tuple[int, int, int]
"""Node-ID, index and sub-index of a producer's object."""


def _fits_mpdo(entry: Entry, direction: Access) -> bool:
    """Return whether an MPDO can carry an object: mappable, one to four bytes."""
    return direction in entry.description.access and 0 < entry.size <= pdo.MPDO_DATA_BYTES


def scanned_entries(dictionary: Dictionary) -> Iterator[Entry]:
    """Yield the objects of the scanner lists that fit into an MPDO."""
    for value in _list_values(dictionary, _SCANNER_LISTS):
        row = pdo.Scanned.parse(value)
        for step in range(row.block):
            entry = dictionary.find(row.index, row.sub + step)
            if entry is not None and _fits_mpdo(entry, Access.TPDO):
                yield entry


def _dispatched_entries(dictionary: Dictionary) -> Iterator[tuple[_Source, Entry]]:
    """Yield the objects of the dispatching lists, each with its source."""
    for value in _list_values(dictionary, _DISPATCHING_LISTS):
        row = pdo.Dispatched.parse(value)
        for step in range(row.block):
            entry = dictionary.find(row.index, row.sub + step)
            if entry is not None and _fits_mpdo(entry, Access.RPDO):
                yield (row.node_id, row.producer_index, row.producer_sub + step), entry


def _list_values(dictionary: Dictionary, lists: range) -> Iterator[int]:
    """Yield the used entries: sub-index 0 is their number; an entry of 0 is empty."""
    for index in lists:
        count = dictionary.find(index)
        if count is not None:
            used = dictionary.elements(index)[: count.number]
            yield from (entry.number for entry in used if entry.number)


class _MpdoQueue(TpdoMode):
    """MPDOs, in the order of events: one frame per object and per inhibit time.

    An event of an object whose frame is already waiting adds no frame. The frame is sent with the
    newest data.
    """

    timed: ClassVar[bool] = True

    def __init__(self, sender: Tpdo, node_id: int = 0) -> None:
        super().__init__(sender)
        self._node_id = node_id
        self._inhibit_us, self._free_us = sender.parameters.inhibit_us, 0
        self._waiting: dict[object, bytes | Entry] = {}

    def put(self, key: object, frame: bytes | Entry) -> None:
        """Queue an MPDO, which is sent as soon as the inhibit time allows.

        The key identifies the object whose value the MPDO carries. If an MPDO with the same key is
        already waiting, the new MPDO replaces it.
        """
        self._waiting[key] = frame
        self.due_us = self._free_us
        self.sender.wake(self.due_us)

    def run(self, now_us: int) -> None:
        """Send the first waiting MPDO, or all waiting MPDOs if there is no inhibit time."""
        while self._waiting and self._free_us <= now_us:
            frame = self._waiting.pop(next(iter(self._waiting)))
            self.sender.send(frame if isinstance(frame, bytes) else self._frame_of(frame))
            # The inhibit time separates all frames of this CAN-ID, whatever object they carry.
            self._free_us = now_us + self._inhibit_us
        self.due_us = self._free_us if self._waiting else NEVER

    def answer(self) -> None:
        """Send nothing, because a remote frame cannot select an object."""

    def _frame_of(self, entry: Entry) -> bytes:
        return pdo.Mpdo(False, self._node_id, entry.index, entry.sub, _present(entry)).encode()


class DamProducer(_MpdoQueue):
    """Sends MPDOs in destination address mode, which write an object of another node.

    The application chooses the object and the node. The mapping entry of the MPDO is not used.
    """

    def send_to(self, node_id: int, index: int, sub: int, data: bytes) -> None:
        """Write an object of another node, or of all nodes with node-ID 0."""
        self.put((node_id, index, sub), pdo.Mpdo(True, node_id, index, sub, data).encode())


class SamProducer(_MpdoQueue):
    """Sends MPDOs in source address mode: one for each change of an object in the scanner lists."""

    def request(self, entry: Entry | None = None) -> None:
        """Send an object that has changed."""
        if entry is not None:
            self.put(entry.key, entry)


class DamConsumer(Part):
    """Receives MPDOs in destination address mode, and writes the objects that they name.

    An MPDO for another node is ignored. An MPDO for an object that does not exist raises EMCY
    8230h, which the next valid MPDO clears.
    """

    def __init__(self, node: CanopenSlave) -> None:
        self._node, self._missing = node, False

    def unpack(self, data: bytes) -> None:
        """Handle the eight bytes of a frame."""
        mpdo = pdo.Mpdo.parse(data[:8])
        if not mpdo.destination or mpdo.node_id not in (0, self._node.node_id):
            return
        entry = self._node.dictionary.find(mpdo.index, mpdo.sub)
        if entry is None or not _fits_mpdo(entry, Access.RPDO):
            self._missing = True
            self._node.emergency(
                EmcyCode.MPDO_NO_OBJECT, ErrorRegister.COMMUNICATION, mpdo.encode()[1:4]
            )
            return
        if self._missing:
            self._missing = False
            self._node.emergency_clear(EmcyCode.MPDO_NO_OBJECT)
        _make_write(entry)(mpdo.data[: entry.size])


class SamConsumer(Part):
    """Receives MPDOs in source address mode, which name an object of their producer.

    The object dispatching list tells to which object of this slave the data are written. If the
    producer's object is not in the list, the MPDO is ignored.
    """

    def __init__(self, dictionary: Dictionary) -> None:
        self._writes = {
            source: (_make_write(entry), entry.size)
            for source, entry in _dispatched_entries(dictionary)
        }

    def unpack(self, data: bytes) -> None:
        """Handle the eight bytes of a frame."""
        mpdo = pdo.Mpdo.parse(data[:8])
        found = self._writes.get((mpdo.node_id, mpdo.index, mpdo.sub))
        if found is not None and not mpdo.destination:
            write, size = found
            write(mpdo.data[:size])


_DUMMIES: Final = {
    kind.value: kind.bits
    for kind in (
        *(DataType.BOOLEAN, DataType.INTEGER8, DataType.INTEGER16, DataType.INTEGER32),
        *(DataType.UNSIGNED8, DataType.UNSIGNED16, DataType.UNSIGNED32),
    )
}
"""Data types that fill up an RPDO, and their bits (CiA 301, dummy mapping)."""

_SAM_LISTS: Final = {Access.RPDO: _DISPATCHING_LISTS, Access.TPDO: _SCANNER_LISTS}
"""Lists by direction, without which there is no MPDO in source address mode."""

_NOTHING: Final = pdo.MappedObject(0, 0, 0)


class PdoMapping(Part):
    """The mapping of a PDO, and the procedure to change it.

    An object can be mapped while the PDO is invalid and sub-index 0 is 0. The object is checked
    at once, and all objects are checked again when sub-index 0 is set. Writing 0 to a mapping
    entry removes its object. A default mapping is used even if the dictionary does not declare
    its objects as mappable, because many EDS files do not. A default mapping with missing objects
    or too many bits disables the PDO.

    Args:
        dictionary: dictionary that contains the mapped objects.
        index: index of the mapping parameter.
        direction: direction of the PDO: `Access.RPDO` or `Access.TPDO`.
        parameters: communication parameters, which determine whether the PDO is valid.
    """

    def __init__(
        self, dictionary: Dictionary, index: int, direction: Access, parameters: PdoParameters
    ) -> None:
        self._dictionary, self._direction, self._parameters = dictionary, direction, parameters
        self._count = dictionary.find(index)
        self._objects = dictionary.elements(index, pdo.MAX_MAPPED_OBJECTS)
        if self._count is not None:
            self._count.guard = self._check_count
        check = self._check_object
        for entry in self._objects:
            entry.guard = check

    @property
    def count(self) -> int:
        """Value of sub-index 0: number of mapped objects, `SAM_MPDO` or `DAM_MPDO`."""
        return len(self._objects) if self._count is None else self._count.number

    def slots(self) -> tuple[Slot, ...]:
        """Return the mapped objects of the PDO.

        The result is empty if the mapping is invalid or the PDO is an MPDO.
        """
        try:
            slots = self._slots(self.count)
        except SdoAbort:
            return ()
        return slots if total_bits(slots) <= pdo.MAX_PDO_BITS else ()

    def _slots(self, count: int) -> tuple[Slot, ...]:
        if count > len(self._objects):
            raise SdoAbort(AbortCode.PDO_LENGTH)
        mapped = [pdo.MappedObject.parse(entry.number) for entry in self._objects[:count]]
        return tuple(self._slot(each) for each in mapped if each != _NOTHING)

    def _slot(self, mapped: pdo.MappedObject) -> Slot:
        """Find an object; raise SdoAbort if it does not exist or has too few bits."""
        # 0005 00 08h: eight bits that an RPDO carries without effect (CiA 301, dummy
        # mapping).
        if mapped.sub == 0 and mapped.index in _DUMMIES and self._direction is Access.RPDO:
            if not 0 < mapped.bits <= _DUMMIES[mapped.index]:
                raise SdoAbort(AbortCode.NOT_MAPPABLE)
            return Slot(None, mapped.bits)
        entry = self._dictionary.look_up(mapped.index.to_bytes(2, "little") + bytes((mapped.sub,)))
        if not _fits(entry, mapped.bits):
            raise SdoAbort(AbortCode.NOT_MAPPABLE)
        return Slot(entry, mapped.bits)

    def _check_slot(self, slot: Slot) -> None:
        """Raise SdoAbort if the dictionary does not allow the object in a PDO of this direction."""
        if slot.entry is not None and self._direction not in slot.entry.description.access:
            raise SdoAbort(AbortCode.NOT_MAPPABLE)

    def _check_object(self, entry: Entry, value: Value) -> None:
        # Mapping procedure (CiA 301, PDO mapping parameter): first set bit 31 of the COB-ID, then
        # write 0 to sub-index 0, then the objects, then sub-index 0, then the COB-ID.
        if self._parameters.valid or self.count:
            raise SdoAbort(AbortCode.UNSUPPORTED_ACCESS)
        mapped = pdo.MappedObject.parse(whole_number(value))
        if mapped != _NOTHING:
            self._check_slot(self._slot(mapped))

    def _check_count(self, entry: Entry, value: Value) -> None:
        if self._parameters.valid:
            raise SdoAbort(AbortCode.UNSUPPORTED_ACCESS)
        count = whole_number(value)
        if count == pdo.DAM_MPDO or (count == pdo.SAM_MPDO and self._has_sam_list()):
            return
        slots = self._slots(count)
        for slot in slots:
            self._check_slot(slot)
        if total_bits(slots) > pdo.MAX_PDO_BITS:
            raise SdoAbort(AbortCode.PDO_LENGTH)
        if count and not slots:
            raise SdoAbort(AbortCode.VALUE_RANGE)

    def _has_sam_list(self) -> bool:
        return any((index, 0) in self._dictionary for index in _SAM_LISTS[self._direction])


def _fits(entry: Entry, bits: int) -> bool:
    """Return whether an object has that many bits; a string has whole bytes."""
    if entry.size:
        return 0 < bits <= 8 * entry.size
    return 0 < bits <= 8 * min(entry.description.max_bytes, 8) and bits % 8 == 0
