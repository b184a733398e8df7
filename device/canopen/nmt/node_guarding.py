"""Node guarding and life guarding of a slave (CiA 301, error control services)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.core.service import ALWAYS, Handler, Service
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.emcy import EmcyCode, ErrorRegister
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID, NmtState
from tickrig.wire.instant import NEVER

GUARD_TIME: Final = 0x100C
LIFE_TIME_FACTOR: Final = 0x100D
PRODUCER_HEARTBEAT_TIME: Final = 0x1017
TOGGLE: Final = 0x80


class NodeGuarding(Service):
    """Answers guarding requests with the NMT state, and watches that they come.

    The toggle bit begins with 0 after a reset and changes with each answer. Life
    guarding begins with the first request; none within guard time times life time
    factor is EMCY 8130h and a communication error (1029h), until the next request.
    Heartbeat has priority: with 1017h set, requests are not answered and nothing
    is watched. Without 100Ch there is no guarding.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        find = node.dictionary.find
        self._guard_time, self._factor = find(GUARD_TIME), find(LIFE_TIME_FACTOR)
        self._heartbeat = find(PRODUCER_HEARTBEAT_TIME)
        self._toggle = 0
        for entry in (self._guard_time, self._factor, self._heartbeat):
            if entry is not None:
                entry.watch(self._changed)

    @property
    def life_time_us(self) -> int:
        """The node life time, 0 if life guarding is off."""
        if self._guard_time is None or self._factor is None:
            return 0
        return self._guard_time.number * self._factor.number * 1_000

    @property
    def _heartbeat_instead(self) -> bool:
        return self._heartbeat is not None and self._heartbeat.number > 0

    def start(self) -> None:
        """Begin with toggle 0, and wait for the first request."""
        self._toggle = 0

    def remote_handlers(self, state: NmtState) -> Iterator[tuple[int, Handler]]:
        """Hear requests in every state but Initialising."""
        if state in ALWAYS and self._guard_time is not None:
            yield ERROR_CONTROL_COB_ID + self.node.node_id, self._receive

    def tick(self, now_us: int) -> None:
        """Note that the master does not guard any more."""
        self.node.emergency(EmcyCode.HEARTBEAT, ErrorRegister.COMMUNICATION)
        self.node.communication_error()

    def _receive(self, frame: CanFrame) -> None:
        if self._heartbeat_instead:
            return
        node = self.node
        node.send(ERROR_CONTROL_COB_ID + node.node_id, bytes([self._toggle | node.state]))
        self._toggle ^= TOGGLE
        node.emergency_clear(EmcyCode.HEARTBEAT, b"")
        life_time_us = self.life_time_us
        self.schedule(node.now_us + life_time_us if life_time_us else NEVER)

    def _changed(self, entry: Entry) -> None:
        """Wait for the next request: the times are others now."""
        self.node.emergency_clear(EmcyCode.HEARTBEAT, b"")
        self.schedule(NEVER)
