"""MPDO consumer: one frame, one object, named in the frame (CiA 301, MPDO)."""

from __future__ import annotations

from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.canopen.pdo.mpdo import dispatched_entries, fits_mpdo
from tickrig.device.canopen.pdo.pdo_packing import make_write
from tickrig.wire.canopen.eds.object_table import Access
from tickrig.wire.canopen.emcy import EmcyCode, ErrorRegister
from tickrig.wire.canopen.pdo import Mpdo


class DamConsumer:
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


class SamConsumer:
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
