"""Transmit PDOs (CiA 301, PDO; 1800h.. and 1A00h..)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Final

from tickrig.device.canopen.dictionary import Entry
from tickrig.device.canopen.pdo import pdo_mapping, pdo_parameters
from tickrig.device.canopen.slave import CanopenSlave, Handler, Service
from tickrig.device.twin import Part
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.eds.object_table import Access
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.canopen.pdo import DAM_MPDO, SAM_MPDO
from tickrig.wire.instant import NEVER

# Theory of operation
# ===================
#
# A TPDO consists of parameters (1800h..), a mapping (1A00h..) and a mode, which carries out its
# transmission type. Parameters and mapping exist as long as the slave. The mode exists from
# `begin` to `end`: while the node is Operational and the PDO is unchanged. Every change of a
# parameter, except the event timer, makes a new mode. So a mode never has to follow a change, and
# its memory (a mark, an inhibit time, a count of SYNCs) ends with it. A valid TPDO begins with an
# event; therefore each event-driven TPDO is sent once when the node becomes Operational, as in
# CANopenNode.
#
# Causes of a transmission:
#
# type        on SYNC                            otherwise
# 0           if an event has happened since     -
# 1 to 240    each n-th                          -
# 252         the sample is taken                a remote frame fetches the sample
# 253         -                                  a remote frame fetches the present values
# 254, 255    -                                  event or event timer, inhibit time permitting
#
# All frames are sent at the place of the producer in the tick (stack.py): SYNC only records its
# counter in `_counters`, and an event only sets `due_us` and wakes the producer. Therefore a TPDO
# carries the values that RPDOs and the application have left at the end of the tick, and one tick
# sends one frame for ten events. Only the answer to a remote frame is sent at once. Every type
# answers remote frames if bit 30 of the COB-ID is 0.
#
# An event is the change of a mapped object (watched from `begin` to `end`), unless a device
# profile decides when an event occurs. Then the entries of the profile are in `quiet`, and the
# profile calls `request_for`. `quiet` must be complete before the node is Operational, because
# `begin` reads it.
#
# A function that is chosen once (`make_pack`) makes the bytes. For one whole object it returns
# the object's own bytes (`_alone`); otherwise it joins whole objects or, if necessary, bits.
# Entries with a `source` are computed each time. `on_change` modes must be made before they are
# watched, and unwatched before they are dropped. For this, `begin` calls `end` first, and `end`
# removes the bound method of the old mode from the entries.

_TPDO_PARAMETERS: Final = range(0x1800, 0x1A00)
_TPDO_MAPPINGS: Final = 0x1A00

_RTR_MODES: Final[dict[int, type[pdo_parameters.TpdoMode]]] = {
    pdo_parameters.RTR_SYNCHRONOUS: pdo_parameters.RtrSynchronous,
    pdo_parameters.RTR_EVENT: pdo_parameters.TpdoMode,
}


class Tpdo(Part):
    """A TPDO of a slave: sends its mapped objects according to its transmission type.

    The transmission type is a `TpdoMode`, which decides when to send. It uses `parameters`, `pack`,
    `send` and `wake` of the TPDO.

    Args:
        producer: service that the TPDO belongs to.
        number: number of the TPDO, 1..512.

    Attributes:
        mode: active transmission type.
        pack: function that packs the mapped objects into bytes.
        entries: the mapped objects.
    """

    __slots__ = (
        *("_alone", "_can_id", "_node", "_producer", "_watched", "entries", "mapping", "mode"),
        *("number", "pack", "parameters", "wake"),
    )

    def __init__(self, producer: PdoProducer, number: int) -> None:
        self.number, self._producer, self._node = number, producer, producer.node
        offset, dictionary = number - 1, producer.node.dictionary
        self.parameters = pdo_parameters.PdoParameters(
            dictionary, _TPDO_PARAMETERS[offset], pdo_parameters.TPDO_TYPES, self._changed
        )
        self.mapping = pdo_mapping.PdoMapping(
            dictionary, _TPDO_MAPPINGS + offset, Access.TPDO, self.parameters
        )
        self.mode: pdo_parameters.TpdoMode = pdo_parameters.Silent(self)
        self.pack: pdo_mapping.Pack
        self.entries: list[Entry] = []
        self._alone: Entry | None
        self.wake = producer.wake
        self._can_id: int
        self._watched: list[Entry] = []

    def begin(self) -> None:
        """Restart with the present parameters."""
        self.end()
        self._can_id = self.parameters.can_id
        slots = self.mapping.slots()
        self.pack, self._alone = pdo_mapping.make_pack(slots), pdo_mapping.alone_in(slots)
        self.entries = [slot.entry for slot in slots if slot.entry is not None]
        self.mode = self._make_mode()
        if isinstance(self.mode, pdo_mapping.SamProducer):
            self._watch(pdo_mapping.scanned_entries(self._node.dictionary))
        elif self.mode.on_change:
            self._watch(self.entries)

    def end(self) -> None:
        """Stop sending."""
        for entry in self._watched:
            entry.unwatch(self.mode.request)
        self.mode = pdo_parameters.Silent(self)

    def send(self, data: bytes | None = None) -> None:
        """Send bytes, or the present values of the mapped objects."""
        # MPDOs and samples bring their own bytes, and are no transmission of the mapped
        # objects.
        if data is not None:
            self._node.send(self._can_id, data)
            return
        alone = self._alone  # the common case without two objects: 2 % of a network
        self._node.send(self._can_id, self.pack() if alone is None else alone.data)
        for notify in self._producer.on_sent:
            notify(self.entries)

    def answer(self, frame: CanFrame) -> None:
        """Answer a remote frame."""
        self.mode.answer()

    def _watch(self, entries: Iterable[Entry]) -> None:
        """Watch each entry whose change is an event."""
        self._watched = [entry for entry in entries if entry.key not in self._producer.quiet]
        for entry in self._watched:
            entry.watch(self.mode.request)
        for notify in self._node.watch_handlers:
            notify()

    def _changed(self, entry: Entry) -> None:
        # The event timer may change at any time, without a new beginning (CiA 301, PDO
        # parameter).
        if entry.sub == pdo_parameters.EVENT_TIMER:
            self.mode.retime(self._node.now_us)
        else:
            self._producer.changed(self)

    def _make_mode(self) -> pdo_parameters.TpdoMode:
        """Return the mode of the transmission type."""
        kind, count = self.parameters.transmission_type, self.mapping.count
        if not self.parameters.valid:
            return pdo_parameters.Silent(self)
        # Sub-index 0 is FEh or FFh: no number of mapped objects but a kind of PDO.
        if count in (SAM_MPDO, DAM_MPDO):
            if kind not in pdo_parameters.EVENT_DRIVEN:
                return pdo_parameters.Silent(self)
            return (
                pdo_mapping.DamProducer(self)
                if count == DAM_MPDO
                else pdo_mapping.SamProducer(self, self._node.node_id)
            )
        if not self.entries:
            return pdo_parameters.Silent(self)
        if kind in pdo_parameters.SYNCHRONOUS:
            return (
                pdo_parameters.SynchronousCyclic(self)
                if kind
                else pdo_parameters.SynchronousAcyclic(self)
            )
        return _RTR_MODES.get(kind, pdo_parameters.EventDriven)(self)


# PDO producer: all TPDOs of a slave (CiA 301, PDO).


class PdoProducer(Service):
    """Sends PDOs in Operational.

    In a tick, PDOs are packed after the application has acted. A TPDO of a SYNC
    contains the values after the RPDOs of this SYNC and after the application. It is sent in the
    same tick, so it is never sent after the synchronous window (1007h). Each event-driven TPDO is
    sent once when the node enters Operational or when the TPDO is switched on, as in CANopenNode.
    Each TPDO whose bit 30 is 0 answers remote frames, whatever its type.

    Attributes:
        tpdos: TPDOs that the dictionary has.
        quiet: keys of entries whose change is not an event, because a profile decides on their
            events. Set it before the node is Operational.
        on_sent: functions that are called with the mapped objects of each TPDO that has been sent.
    """

    __slots__ = ("_counters", "_due_us", "_synchronous", "_timed", "on_sent", "quiet", "tpdos")

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self.quiet: set[int] = set()
        self.on_sent: list[Callable[[list[Entry]], None]] = []
        self.tpdos = [
            Tpdo(self, index - _TPDO_PARAMETERS[0] + 1)
            for index in node.dictionary.within(_TPDO_PARAMETERS)
        ]
        self._synchronous: tuple[pdo_parameters.TpdoMode, ...]
        self._timed: tuple[pdo_parameters.TpdoMode, ...]
        self._counters: tuple[int, ...]
        self._due_us = NEVER
        node.sync_handlers.append(self._sync)

    def request(self, number: int) -> None:
        """Raise an event for a TPDO.

        A TPDO of type 254 or 255 is then sent as soon as its inhibit time allows, and a TPDO of
        type 0 with the next SYNC.

        Args:
            number: number of the TPDO, 1..512.
        """
        for tpdo in self.tpdos:
            if tpdo.number == number:
                tpdo.mode.request()

    def request_for(self, entry: Entry) -> None:
        """Raise an event for each TPDO that carries an entry."""
        for tpdo in self.tpdos:
            if entry in tpdo.entries:
                tpdo.mode.request()

    def send_to(self, node_id: int, index: int, sub: int, data: bytes) -> None:  # noqa: D417
        """Write an object of another node with an MPDO in destination address mode.

        The slave uses its first TPDO that is such an MPDO. If it has none, nothing is sent.

        Args:
            node_id: node-ID of the destination, or 0 for all nodes.
            data: up to four bytes to write.
        """
        for tpdo in self.tpdos:
            if isinstance(tpdo.mode, pdo_mapping.DamProducer):
                tpdo.mode.send_to(node_id, index, sub, data)
                return

    def start(self) -> None:
        """Send nothing."""
        self._due_us = NEVER

    def remote_handlers(self, state: NmtState) -> Iterator[tuple[int, Handler]]:
        """Listen to remote frames that request a TPDO."""
        if state is NmtState.OPERATIONAL:
            for tpdo in self.tpdos:
                if tpdo.parameters.valid and tpdo.parameters.answers_rtr:
                    yield tpdo.parameters.can_id, tpdo.answer

    def state_changed(self, old: NmtState, new: NmtState) -> None:
        """Start all TPDOs when Operational is entered, stop them when it is left."""
        self._counters = ()
        for tpdo in self.tpdos:
            if new is NmtState.OPERATIONAL:
                tpdo.begin()
            else:
                tpdo.end()
        self._collect()

    def changed(self, tpdo: Tpdo) -> None:
        """Restart a TPDO with changed communication parameters."""
        if self.node.state is NmtState.OPERATIONAL:
            tpdo.begin()
            self.node.rewire()
            self._collect()

    def wake(self, due_us: int) -> None:
        """Schedule a run of a TPDO at a time or earlier."""
        if due_us < self._due_us:
            self._due_us = due_us
            self.node.await_tick(self, due_us)

    def tick(self, now_us: int) -> None:
        """Send the TPDOs of SYNC, then the TPDOs with events."""
        if self._counters:
            # All SYNCs that came in this tick, each with its counter: two of them send two
            # frames.
            counters, self._counters = self._counters, ()
            for counter in counters:
                for mode in self._synchronous:
                    mode.on_sync(counter)
        self._due_us = NEVER
        if self._timed:
            for mode in self._timed:
                if mode.due_us <= now_us:
                    mode.run(now_us)
            self.wake(min([mode.due_us for mode in self._timed]))

    def _sync(self, counter: int) -> None:
        if self._synchronous:
            self._counters = (*self._counters, counter) if self._counters else (counter,)
            self.wake(self.node.now_us)

    def _collect(self) -> None:
        """Determine which TPDOs act on SYNC, and which on events or by time."""
        modes = [tpdo.mode for tpdo in self.tpdos]
        self._synchronous = tuple(mode for mode in modes if mode.synchronous)
        self._timed = tuple(mode for mode in modes if mode.timed)
        self._due_us = min((mode.due_us for mode in self._timed), default=NEVER)
        self.schedule(self._due_us)
