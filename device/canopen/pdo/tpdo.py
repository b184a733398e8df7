"""One transmit PDO (CiA 301, PDO; 1800h.. and 1A00h..)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from tickrig.device.canopen.core.entry import Access, Entry
from tickrig.device.canopen.pdo.mpdo_producer import DamProducer, SamProducer
from tickrig.device.canopen.pdo.pdo_mapping import PdoMapping
from tickrig.device.canopen.pdo.pdo_packing import Pack, make_pack
from tickrig.device.canopen.pdo.pdo_parameters import (
    EVENT_DRIVEN,
    EVENT_TIMER,
    RTR_EVENT,
    RTR_SYNCHRONOUS,
    SYNCHRONOUS,
    TPDO_TYPES,
    PdoParameters,
)
from tickrig.device.canopen.pdo.tpdo_modes import (
    EventDriven,
    RtrSynchronous,
    Silent,
    SynchronousAcyclic,
    SynchronousCyclic,
    TpdoMode,
)
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.pdo import DAM_MPDO, SAM_MPDO

if TYPE_CHECKING:
    from tickrig.device.canopen.pdo.pdo_producer import PdoProducer

TPDO_PARAMETERS: Final = range(0x1800, 0x1A00)
TPDO_MAPPINGS: Final = 0x1A00

MPDO_MODES: Final[dict[int, type[TpdoMode]]] = {SAM_MPDO: SamProducer, DAM_MPDO: DamProducer}
RTR_MODES: Final[dict[int, type[TpdoMode]]] = {
    RTR_SYNCHRONOUS: RtrSynchronous,
    RTR_EVENT: TpdoMode,
}


class Tpdo:
    """Sends the mapped objects when its transmission type says so.

    Args:
        producer: the service that it belongs to.
        number: 1..512.

    Attributes:
        mode: its transmission type at work.
        pack: makes the bytes out of the mapped objects.
        entries: the mapped objects.
    """

    def __init__(self, producer: PdoProducer, number: int) -> None:
        self.number, self.producer, self.node = number, producer, producer.node
        offset, dictionary = number - 1, producer.node.dictionary
        self.parameters = PdoParameters(
            dictionary, TPDO_PARAMETERS[offset], TPDO_TYPES, self._changed
        )
        self.mapping = PdoMapping(
            dictionary, TPDO_MAPPINGS + offset, Access.TPDO, lambda: self.parameters.valid
        )
        self.mode: TpdoMode = Silent(self)
        self.pack: Pack = bytes
        self.entries: list[Entry] = []
        self._can_id = 0
        self._watched: list[tuple[Entry, Callable[[], None]]] = []

    def begin(self) -> None:
        """Start anew with the present parameters."""
        self.end()
        self._can_id = self.parameters.can_id
        slots = self.mapping.slots()
        self.pack = make_pack(slots)
        self.entries = [slot.entry for slot in slots if slot.entry is not None]
        self.mode = _mode(self)

    def end(self) -> None:
        """Send no more."""
        for entry, changed in self._watched:
            entry.watchers.remove(changed)
        self._watched.clear()
        self.mode = Silent(self)

    def watch(self, entry: Entry, changed: Callable[[], None]) -> None:
        """Hear of each change of an entry that counts as an event."""
        if entry.key not in self.producer.quiet:
            entry.watchers.append(changed)
            self._watched.append((entry, changed))

    def transmit(self) -> None:
        """Send the mapped objects."""
        self.node.send(self._can_id, self.pack())
        for told in self.producer.on_sent:
            told(self.entries)

    def send(self, data: bytes) -> None:
        """Send these bytes."""
        self.node.send(self._can_id, data)

    def answer(self, frame: CanFrame) -> None:
        """Answer a remote frame."""
        self.mode.answer()

    def _changed(self, sub: int) -> None:
        if sub == EVENT_TIMER:
            self.mode.retime()
        else:
            self.producer.changed(self)


def _mode(tpdo: Tpdo) -> TpdoMode:
    """Return the transmission type of a TPDO at work."""
    kind, count = tpdo.parameters.transmission_type, tpdo.mapping.count
    if not tpdo.parameters.valid:
        return Silent(tpdo)
    if count in MPDO_MODES:
        return MPDO_MODES[count](tpdo) if kind in EVENT_DRIVEN else Silent(tpdo)
    if not tpdo.entries:
        return Silent(tpdo)
    if kind in SYNCHRONOUS:
        return SynchronousCyclic(tpdo) if kind else SynchronousAcyclic(tpdo)
    return RTR_MODES.get(kind, EventDriven)(tpdo)
