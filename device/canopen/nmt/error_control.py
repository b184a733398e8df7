"""Error control of a slave: heartbeat producer, node and life guarding (CiA 301, 1017h, 100Ch)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from tickrig._compiled import mypyc_attr
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.core.service import ALWAYS, Handler, Service
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.emcy import EmcyCode, ErrorRegister
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID, NmtState
from tickrig.wire.instant import NEVER


@mypyc_attr(allow_interpreted_subclasses=True)
class HeartbeatProducer(Service):
    """Sends the NMT state each producer heartbeat time.

    The boot-up message counts as the first heartbeat. A time that is written,
    over the bus or from the inside, begins anew, so the first one comes after
    one period.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self._period = node.dictionary.find(0x1017)
        self._due_us = NEVER
        self._begins = False
        if self._period is not None:
            self._period.watch(self._changed)
            self._period.written = self._changed  # the same value, too, begins anew

    def booted(self) -> None:
        """Count from the boot-up message."""
        self._begin()

    def tick(self, now_us: int) -> None:
        """Begin to count, or send one heartbeat."""
        node = self.node
        period_us = 1_000 * self._period.number if self._period is not None else 0
        if self._begins:
            self._due_us = now_us
        else:
            node.send(ERROR_CONTROL_COB_ID + node.node_id, bytes([node.state]))
        self._begins = False
        self._due_us += period_us
        self.schedule(self._due_us if period_us else NEVER)

    def _changed(self, entry: Entry) -> None:
        self._begin()

    def _begin(self) -> None:
        """Count from the next tick on, or from this one; not before the boot-up message."""
        if self.node.state is not NmtState.INITIALISING:
            self._begins = True
            self.schedule(0)


GUARD_TIME: Final = 0x100C
LIFE_TIME_FACTOR: Final = 0x100D
PRODUCER_HEARTBEAT_TIME: Final = 0x1017
TOGGLE: Final = 0x80


@mypyc_attr(allow_interpreted_subclasses=True)
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
        """Listen to requests in every state but Initialising."""
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
