"""PDO producer: all TPDOs of a slave (CiA 301, PDO)."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.core.service import Handler, Service
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.canopen.pdo.mpdo import DamProducer
from tickrig.device.canopen.pdo.tpdo import TPDO_PARAMETERS, Tpdo
from tickrig.device.canopen.pdo.tpdo_modes import TpdoMode
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.instant import NEVER


class PdoProducer(Service):
    """Sends PDOs in Operational.

    They are made at the place of TPDOs in the tick, after the application: a
    TPDO that SYNC causes has the values that the RPDOs of this SYNC and the
    application have left at the end of the tick. It leaves in the same tick,
    so it is never later than the synchronous window (1007h).
    Each event-driven TPDO is sent once when the node enters Operational or the
    TPDO is switched on, as in CANopenNode. Remote frames are answered by each
    TPDO whose bit 30 is 0, whatever its type.

    Attributes:
        tpdos: those that the dictionary has.
        quiet: keys of entries whose change is no event, because a profile judges
            it; to be set before the node is Operational.
        on_sent: called with the mapped objects of each TPDO that has been sent.
    """

    __slots__ = ("_counters", "_due_us", "_synchronous", "_timed", "on_sent", "quiet", "tpdos")

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self.quiet: set[int] = set()
        self.on_sent: list[Callable[[list[Entry]], None]] = []
        self.tpdos = [
            Tpdo(self, index - TPDO_PARAMETERS[0] + 1)
            for index in node.dictionary.within(TPDO_PARAMETERS)
        ]
        self._synchronous: tuple[TpdoMode, ...] = ()
        self._timed: tuple[TpdoMode, ...] = ()
        self._counters: tuple[int, ...] = ()
        self._due_us = NEVER
        node.sync_handlers.append(self._sync)

    def request(self, number: int) -> None:
        """Let an event happen to a TPDO (254, 255: sent; 0: sent with the next SYNC)."""
        for tpdo in self.tpdos:
            if tpdo.number == number:
                tpdo.mode.request()

    def request_for(self, entry: Entry) -> None:
        """Let an event happen to each TPDO that carries an entry."""
        for tpdo in self.tpdos:
            if entry in tpdo.entries:
                tpdo.mode.request()

    def send_to(self, node_id: int, index: int, sub: int, data: bytes) -> None:  # noqa: D417
        """Write an object of other nodes by the first MPDO in destination address mode.

        Args:
            node_id: 0 for all.
            data: up to four bytes.
        """
        for tpdo in self.tpdos:
            if isinstance(tpdo.mode, DamProducer):
                tpdo.mode.send_to(node_id, index, sub, data)
                return

    def start(self) -> None:
        """Send nothing."""
        self._due_us = NEVER

    def remote_handlers(self, state: NmtState) -> Iterator[tuple[int, Handler]]:
        """Listen to remote frames that fetch a TPDO."""
        if state is NmtState.OPERATIONAL:
            for tpdo in self.tpdos:
                if tpdo.parameters.valid and tpdo.parameters.answers_rtr:
                    yield tpdo.parameters.can_id, tpdo.answer

    def state_changed(self, old: NmtState, new: NmtState) -> None:
        """Start all TPDOs in Operational, stop them when it is left."""
        self._counters = ()
        for tpdo in self.tpdos:
            if new is NmtState.OPERATIONAL:
                tpdo.begin()
            else:
                tpdo.end()
        self._collect()

    def changed(self, tpdo: Tpdo) -> None:
        """Start a TPDO anew with other communication parameters."""
        if self.node.state is NmtState.OPERATIONAL:
            tpdo.begin()
            self.node.rewire()
            self._collect()

    def wake(self, due_us: int) -> None:
        """Run a TPDO at this time, unless it comes back earlier anyway."""
        if due_us < self._due_us:
            self._due_us = due_us
            self.node.await_tick(self, due_us)

    def tick(self, now_us: int) -> None:
        """Send what SYNC has asked for, then what events have."""
        if self._counters:
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
            self._counters += (counter,)
            self.wake(self.node.now_us)

    def _collect(self) -> None:
        """Find out which TPDOs act on SYNC, and which on events or with time."""
        modes = [tpdo.mode for tpdo in self.tpdos]
        self._synchronous = tuple(mode for mode in modes if mode.synchronous)
        self._timed = tuple(mode for mode in modes if mode.timed)
        self._due_us = min((mode.due_us for mode in self._timed), default=NEVER)
        self.schedule(self._due_us)
