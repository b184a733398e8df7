"""One transmit PDO (CiA 301, PDO; 1800h.. and 1A00h..)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Final

from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.pdo.mpdo import DamProducer, SamProducer, scanned_entries
from tickrig.device.canopen.pdo.pdo_mapping import PdoMapping
from tickrig.device.canopen.pdo.pdo_packing import Pack, alone_in, make_pack
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
from tickrig.device.twin import Part
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.eds.object_table import Access
from tickrig.wire.canopen.pdo import DAM_MPDO, SAM_MPDO

if TYPE_CHECKING:
    from tickrig.device.canopen.pdo.pdo_producer import PdoProducer

TPDO_PARAMETERS: Final = range(0x1800, 0x1A00)
TPDO_MAPPINGS: Final = 0x1A00

RTR_MODES: Final[dict[int, type[TpdoMode]]] = {
    RTR_SYNCHRONOUS: RtrSynchronous,
    RTR_EVENT: TpdoMode,
}


class Tpdo(Part):
    """Sends the mapped objects when its transmission type says so.

    For its mode it is the sender: parameters, `pack`, `send`, `wake`.

    Args:
        producer: the service that it belongs to.
        number: 1..512.

    Attributes:
        mode: its transmission type at work.
        pack: makes the bytes out of the mapped objects.
        entries: the mapped objects.
    """

    __slots__ = (
        *("_alone", "_can_id", "_node", "_producer", "_watched", "entries", "mapping", "mode"),
        *("number", "pack", "parameters", "wake"),
    )

    def __init__(self, producer: PdoProducer, number: int) -> None:
        self.number, self._producer, self._node = number, producer, producer.node
        offset, dictionary = number - 1, producer.node.dictionary
        self.parameters = PdoParameters(
            dictionary, TPDO_PARAMETERS[offset], TPDO_TYPES, self._changed
        )
        self.mapping = PdoMapping(dictionary, TPDO_MAPPINGS + offset, Access.TPDO, self.parameters)
        self.mode: TpdoMode = Silent(self)
        self.pack: Pack
        self.entries: list[Entry] = []
        self._alone: Entry | None
        self.wake = producer.wake
        self._can_id: int
        self._watched: list[Entry] = []

    def begin(self) -> None:
        """Start anew with the present parameters."""
        self.end()
        self._can_id = self.parameters.can_id
        slots = self.mapping.slots()
        self.pack, self._alone = make_pack(slots), alone_in(slots)
        self.entries = [slot.entry for slot in slots if slot.entry is not None]
        self.mode = self._make_mode()
        if isinstance(self.mode, SamProducer):
            self._watch(scanned_entries(self._node.dictionary))
        elif self.mode.on_change:
            self._watch(self.entries)

    def end(self) -> None:
        """Send no more."""
        for entry in self._watched:
            entry.unwatch(self.mode.request)
        self.mode = Silent(self)

    def send(self, data: bytes | None = None) -> None:
        """Send bytes, or the mapped objects as they are now."""
        if data is not None:
            self._node.send(self._can_id, data)
            return
        alone = self._alone  # what most TPDOs carry is at hand: two objects less, 2 % of a network
        self._node.send(self._can_id, self.pack() if alone is None else alone.data)
        for notify in self._producer.on_sent:
            notify(self.entries)

    def answer(self, frame: CanFrame) -> None:
        """Answer a remote frame."""
        self.mode.answer()

    def _watch(self, entries: Iterable[Entry]) -> None:
        """Follow each change that counts as an event."""
        self._watched = [entry for entry in entries if entry.key not in self._producer.quiet]
        for entry in self._watched:
            entry.watch(self.mode.request)

    def _changed(self, entry: Entry) -> None:
        if entry.sub == EVENT_TIMER:
            self.mode.retime(self._node.now_us)
        else:
            self._producer.changed(self)

    def _make_mode(self) -> TpdoMode:
        """Return the transmission type at work."""
        kind, count = self.parameters.transmission_type, self.mapping.count
        if not self.parameters.valid:
            return Silent(self)
        if count in (SAM_MPDO, DAM_MPDO):
            if kind not in EVENT_DRIVEN:
                return Silent(self)
            return DamProducer(self) if count == DAM_MPDO else SamProducer(self, self._node.node_id)
        if not self.entries:
            return Silent(self)
        if kind in SYNCHRONOUS:
            return SynchronousCyclic(self) if kind else SynchronousAcyclic(self)
        return RTR_MODES.get(kind, EventDriven)(self)
