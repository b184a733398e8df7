"""PDO consumer: all RPDOs of a slave (CiA 301, PDO)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

from tickrig.device.canopen.bus.sync import COB_ID_SYNC
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.core.service import Handler, Service
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.canopen.pdo.rpdo import RPDO_PARAMETERS, Rpdo
from tickrig.wire.canopen.cob_id import CAN_ID_MASK
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.instant import NEVER

SYNCHRONOUS_WINDOW_LENGTH: Final = 0x1007


class PdoConsumer(Service):
    """Receives PDOs in Operational.

    On SYNC the synchronous RPDOs of the cycle reach their objects at once, in
    the order of their numbers, before the synchronous TPDOs of the same SYNC
    are made. Which frames are before the SYNC is decided by the wire, also
    within a tick.

    Attributes:
        rpdos: those that the dictionary has.
        on_rpdo: called with the number of an RPDO when its objects have got its values.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self.on_rpdo: list[Callable[[int], None]] = []
        self.rpdos = [
            Rpdo(self, index - RPDO_PARAMETERS[0] + 1)
            for index in node.dictionary.within(RPDO_PARAMETERS)
        ]
        self._synchronous: tuple[Rpdo, ...] = ()
        self._window_us, self._window_end_us, self._due_us = 0, NEVER, NEVER
        window = node.dictionary.find(SYNCHRONOUS_WINDOW_LENGTH)
        if window is not None:
            self._window_changed(window)
            window.watch(self._window_changed)
        if self.rpdos or window is not None:  # else each SYNC touched it for nothing
            node.sync_handlers.append(self._sync)

    @property
    def window_is_over(self) -> bool:
        """Whether the synchronous window of the last SYNC has passed (1007h)."""
        return self.node.now_us > self._window_end_us

    def start(self) -> None:
        """Know of no error and no SYNC."""
        self._window_end_us = self._due_us = NEVER
        for rpdo in self.rpdos:
            rpdo.restart()

    def handlers(self, state: NmtState) -> Iterator[tuple[int, Handler]]:
        """Listen to the RPDOs that exist."""
        if state is not NmtState.OPERATIONAL:
            return
        listening = [(rpdo, rpdo.listen()) for rpdo in self.rpdos]
        self._synchronous = tuple(
            rpdo for rpdo, handler in listening if handler is not None and rpdo.synchronous
        )
        for rpdo, handler in listening:
            if handler is not None:
                yield rpdo.parameters.can_id, handler

    def reconfigured_by(self, state: NmtState) -> Iterator[int]:
        """Name the RPDOs that may write communication objects, and the SYNC that makes them act."""
        if state is not NmtState.OPERATIONAL:
            return
        rpdos = [rpdo for rpdo in self.rpdos if rpdo.parameters.valid and rpdo.reconfigures]
        yield from (rpdo.parameters.can_id for rpdo in rpdos)
        sync = self.node.dictionary.find(COB_ID_SYNC)
        if sync is not None and any(rpdo.synchronous for rpdo in rpdos):
            yield sync.number & CAN_ID_MASK

    def state_changed(self, old: NmtState, new: NmtState) -> None:
        """Forget what has come if the node is not Operational any more."""
        if old is NmtState.OPERATIONAL:
            self._synchronous, self._window_end_us = (), NEVER
            for rpdo in self.rpdos:
                rpdo.stop()

    def tick(self, now_us: int) -> None:
        """Report RPDOs that are late."""
        for rpdo in self.rpdos:
            if rpdo.deadline_us <= now_us:
                rpdo.expire()
        self._due_us = NEVER
        self.await_deadline(min(rpdo.deadline_us for rpdo in self.rpdos))

    def await_deadline(self, due_us: int) -> None:
        """Come back at a deadline, unless one is earlier."""
        if due_us < self._due_us:
            self._due_us = due_us
            self.schedule(due_us)

    def changed(self) -> None:
        """Listen to what the communication parameters say now."""
        if self.node.state is NmtState.OPERATIONAL:
            self.node.rewire()

    def _sync(self, counter: int) -> None:
        for rpdo in self._synchronous:
            rpdo.sync()
        if self._window_us:
            self._window_end_us = self.node.now_us + self._window_us

    def _window_changed(self, window: Entry) -> None:
        """Know the synchronous window at each SYNC."""
        self._window_us = window.number
