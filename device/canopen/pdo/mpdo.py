"""Multiplexed PDOs: their lists, producers and consumers (CiA 301, MPDO)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, Final

from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.canopen.pdo.pdo_packing import make_write, present
from tickrig.device.canopen.pdo.tpdo_modes import PdoSender, TpdoMode
from tickrig.device.twin import Part
from tickrig.wire.canopen.eds.object_table import Access
from tickrig.wire.canopen.emcy import EmcyCode, ErrorRegister
from tickrig.wire.canopen.pdo import MPDO_DATA_BYTES, Dispatched, Mpdo, Scanned
from tickrig.wire.instant import NEVER

SCANNER_LISTS: Final = range(0x1FA0, 0x1FD0)
DISPATCHING_LISTS: Final = range(0x1FD0, 0x2000)

Source = tuple[int, int, int]
"""Node-ID, index and sub-index of a producer's object."""


def fits_mpdo(entry: Entry, direction: Access) -> bool:
    """Return whether an object may be in an MPDO: mappable and of one to four bytes."""
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


class MpdoQueue(TpdoMode):
    """MPDOs: one frame an object, one frame an inhibit time, in the order of events.

    An event of an object that waits already adds no frame: the newest data are sent.
    """

    timed: ClassVar[bool] = True

    def __init__(self, sender: PdoSender, node_id: int = 0) -> None:
        super().__init__(sender)
        self._node_id = node_id
        self._inhibit_us, self._free_us = sender.parameters.inhibit_us, 0
        self._waiting: dict[object, bytes | Entry] = {}

    def put(self, key: object, frame: bytes | Entry) -> None:
        """Send a frame, or what an entry then holds, as soon as the inhibit time allows."""
        self._waiting[key] = frame
        self.due_us = self._free_us
        self.sender.wake(self.due_us)

    def run(self, now_us: int) -> None:
        """Send the first, or all if there is no inhibit time."""
        while self._waiting and self._free_us <= now_us:
            frame = self._waiting.pop(next(iter(self._waiting)))
            self.sender.send(frame if isinstance(frame, bytes) else self._frame_of(frame))
            self._free_us = now_us + self._inhibit_us
        self.due_us = self._free_us if self._waiting else NEVER

    def answer(self) -> None:
        """Send nothing: a remote frame cannot say which object."""

    def _frame_of(self, entry: Entry) -> bytes:
        return Mpdo(False, self._node_id, entry.index, entry.sub, present(entry)).encode()


class DamProducer(MpdoQueue):
    """MPDO in destination address mode: the application says what goes where.

    Its own mapping entry is not used.
    """

    def send_to(self, node_id: int, index: int, sub: int, data: bytes) -> None:
        """Write an object of another node, or of all with node-ID 0."""
        self.put((node_id, index, sub), Mpdo(True, node_id, index, sub, data).encode())


class SamProducer(MpdoQueue):
    """MPDO in source address mode: each change of an object of the scanner lists is sent."""

    def request(self, entry: Entry | None = None) -> None:
        """Send an object that has changed."""
        if entry is not None:
            self.put(entry.key, entry)


class DamConsumer(Part):
    """Writes the object that an MPDO in destination address mode names.

    One for another node is ignored, one for a missing object is answered with
    EMCY 8230h, which the next good one clears.
    """

    def __init__(self, node: CanopenSlave) -> None:
        self._node, self._missing = node, False

    def unpack(self, data: bytes) -> None:
        """Take the eight bytes of a frame."""
        mpdo = Mpdo.parse(data[:8])
        if not mpdo.destination or mpdo.node_id not in (0, self._node.node_id):
            return
        entry = self._node.dictionary.find(mpdo.index, mpdo.sub)
        if entry is None or not fits_mpdo(entry, Access.RPDO):
            self._missing = True
            self._node.emergency(
                EmcyCode.MPDO_NO_OBJECT, ErrorRegister.COMMUNICATION, mpdo.encode()[1:4]
            )
            return
        if self._missing:
            self._missing = False
            self._node.emergency_clear(EmcyCode.MPDO_NO_OBJECT)
        make_write(entry)(mpdo.data[: entry.size])


class SamConsumer(Part):
    """Writes the object that the dispatching list has for an object of a producer.

    What is not in the list is ignored.
    """

    def __init__(self, dictionary: Dictionary) -> None:
        self._writes = {
            source: (make_write(entry), entry.size)
            for source, entry in dispatched_entries(dictionary)
        }

    def unpack(self, data: bytes) -> None:
        """Take the eight bytes of a frame."""
        mpdo = Mpdo.parse(data[:8])
        found = self._writes.get((mpdo.node_id, mpdo.index, mpdo.sub))
        if found is not None and not mpdo.destination:
            write, size = found
            write(mpdo.data[:size])
