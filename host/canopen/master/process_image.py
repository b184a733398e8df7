"""The process image of a slave: the values of its PDO objects at the master."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Final

from tickrig.host.canopen.bus_file.bus_values import BusPdo
from tickrig.host.canopen.dialogue import Send
from tickrig.wire.canopen.nmt import CAN_ID_MASK
from tickrig.wire.canopen.pdo import pack_bits, unpack_bits

Key = tuple[int, int]
"""Index and sub-index."""

EVENT_DRIVEN: Final = 0xFE
"""The lowest transmission type whose PDOs are sent when one of their objects is written."""

_SYNC_ACYCLIC: Final = 0
"""Transmission type of a PDO that is sent with the SYNC after an object was written."""


class ProcessImage:
    """Values of the objects in the PDOs of one slave, as the master has received or written them.

    Values are 0 until they are received or written. When an object is written, the RPDO that
    contains the object is sent. A synchronous RPDO is sent with a SYNC instead: with each n-th SYNC
    if its transmission type is n. If an RPDO also contains objects that have not been written,
    these objects are sent as 0. The CANopen master of the Lely library does the same.

    The inhibit times, event timers and deadlines of the master are not emulated.

    Args:
        pdos: PDOs that the slave has.
        send: function that sends a data frame. Its arguments are CAN-ID and data.
    """

    def __init__(self, pdos: Iterable[BusPdo], send: Send) -> None:
        enabled = [pdo for pdo in pdos if pdo.enabled]
        self._send = send
        self._received = {pdo.cob_id & CAN_ID_MASK: pdo for pdo in enabled if pdo.transmit}
        self._sent = [pdo for pdo in enabled if not pdo.transmit]
        self._inputs = {key for pdo in self._received.values() for key in keys(pdo)}
        self._outputs = {key for pdo in self._sent for key in keys(pdo)}
        self._values: dict[Key, int] = {}
        self._seen: set[Key] = set()
        self._counts: Counter[Key] = Counter()
        self._written: set[int] = set()
        self._syncs = 0

    @property
    def cob_ids(self) -> Iterable[int]:
        """The CAN-IDs that the slave sends."""
        return self._received

    def receives(self, key: Key) -> bool:
        """Return whether a TPDO of the slave carries an object."""
        return key in self._inputs

    def sends(self, key: Key) -> bool:
        """Return whether an RPDO of the slave carries an object."""
        return key in self._outputs

    def is_fresh(self, key: Key) -> bool:
        """Return whether an object was received or read since it was marked as outdated."""
        return key in self._seen

    def doubt(self, key: Key) -> None:
        """Mark the value of an object as outdated. The value is kept."""
        self._seen.discard(key)

    def count(self, key: Key) -> int:
        """Return how many times an object was received or read."""
        return self._counts[key]

    def read(self, key: Key) -> int:
        """Return the bits of an object."""
        return self._values.get(key, 0)

    def write(self, key: Key, bits: int) -> None:
        """Change an object. Send the event-driven PDOs that carry it."""
        self._values[key] = bits
        for pdo in self._sent:
            if key in keys(pdo):
                if pdo.transmission >= EVENT_DRIVEN:
                    self._transmit(pdo)
                else:
                    self._written.add(pdo.number)

    def learn(self, key: Key, bits: int) -> None:
        """Store a value that was read in another way, such as by SDO."""
        self._values[key] = bits
        self._seen.add(key)
        self._counts[key] += 1

    def receive(self, can_id: int, data: bytes) -> None:
        """Process a TPDO. Ignore a TPDO that is too short."""
        pdo = self._received[can_id]
        widths = [mapped.bits for mapped in pdo.mapping]
        if 8 * len(data) < sum(widths):
            return
        values = unpack_bits(data, widths)
        for mapped, bits in zip(pdo.mapping, values, strict=True):
            self.learn((mapped.index, mapped.sub), bits)

    def sync(self) -> None:
        """Send the PDOs that are due with this SYNC."""
        self._syncs += 1
        for pdo in self._sent:
            if pdo.transmission == _SYNC_ACYCLIC:
                due = pdo.number in self._written
            else:
                due = pdo.transmission < EVENT_DRIVEN and self._syncs % pdo.transmission == 0
            if due:
                self._transmit(pdo)
        self._written.clear()

    def _transmit(self, pdo: BusPdo) -> None:
        fields = ((self.read((one.index, one.sub)), one.bits) for one in pdo.mapping)
        self._send(pdo.cob_id & CAN_ID_MASK, pack_bits(fields))


def keys(pdo: BusPdo) -> tuple[Key, ...]:
    """Return the data of a PDO."""
    return tuple((mapped.index, mapped.sub) for mapped in pdo.mapping)
