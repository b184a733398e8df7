"""Heartbeat consumer (CiA 301, error control services; object 1016h)."""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum, auto
from typing import Final

from tickrig._compiled import mypyc_attr
from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.core.service import ALWAYS, Handler, Service
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.twin import Part
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.canopen.emcy import EmcyCode, ErrorRegister
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID, NmtState
from tickrig.wire.canopen.sdo.abort import AbortCode
from tickrig.wire.instant import NEVER

CONSUMER_HEARTBEAT_TIME: Final = 0x1016
MAX_NODES: Final = 127
RESERVED: Final = 0xFF00_0000


class Watch(Enum):
    """What is known of a monitored node."""

    UNKNOWN = auto()  # no heartbeat yet: nothing is late
    ALIVE = auto()
    LOST = auto()


class Monitor(Part):
    """Watches the heartbeat of one node.

    Args:
        consumer: the service that it belongs to.
        value: an entry of 1016h: node-ID in bits 16 to 23, time in ms below.

    Attributes:
        node_id: whom it watches.
        period_us: the consumer heartbeat time.
        watch: what is known.
        nmt_state: the NMT state that the node sent last, None before.
        deadline_us: when its heartbeat is late.
    """

    __slots__ = ("_consumer", "deadline_us", "nmt_state", "node_id", "period_us", "watch")

    def __init__(self, consumer: HeartbeatConsumer, value: int) -> None:
        self._consumer = consumer
        self.node_id, self.period_us = _node_id(value), _time_us(value)
        self.watch, self.deadline_us = Watch.UNKNOWN, NEVER
        self.nmt_state: int | None = None

    def receive(self, frame: CanFrame) -> None:
        """Take a heartbeat."""
        if len(frame.data) != 1:
            return
        self.nmt_state = frame.data[0]
        before, self.watch = self.watch, Watch.ALIVE
        self.deadline_us = self._consumer.node.now_us + self.period_us
        if before is not Watch.ALIVE:
            if before is Watch.LOST:
                self.clear()
            self._consumer.reschedule()

    def lose(self) -> None:
        """Note that the heartbeat is late."""
        self.watch, self.deadline_us = Watch.LOST, NEVER
        node = self._consumer.node
        node.emergency(EmcyCode.HEARTBEAT, ErrorRegister.COMMUNICATION, bytes([self.node_id]))
        node.communication_error()

    def clear(self) -> None:
        """Clear the error, if there is one."""
        self._consumer.node.emergency_clear(EmcyCode.HEARTBEAT, bytes([self.node_id]))


@mypyc_attr(allow_interpreted_subclasses=True)
class HeartbeatConsumer(Service):
    """Watches the heartbeats of other nodes.

    Monitoring begins with the first heartbeat; the boot-up message counts as
    one. A heartbeat that does not come is EMCY 8130h, whose first
    manufacturer-specific byte is the node-ID, and a communication error (1029h).
    The error is cleared when a heartbeat comes again, or when its entry is
    changed. An entry with time 0 or a node-ID that is not 1..127 is not used. A
    second one for the same node-ID is refused with 0604 0043h, reserved bits with
    0609 0030h.

    Attributes:
        monitors: the entries that are used.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self.monitors: dict[int, Monitor] = {}
        self._entries = node.dictionary.elements(CONSUMER_HEARTBEAT_TIME, MAX_NODES)
        for entry in self._entries:
            entry.guard = self._check
            entry.watch(self._changed)

    def start(self) -> None:
        """Watch the nodes of the power-on values."""
        for entry in self._entries:
            self._watch(entry)

    def handlers(self, state: NmtState) -> Iterator[tuple[int, Handler]]:
        """Listen to heartbeats in every state but Initialising."""
        if state in ALWAYS:
            for monitor in self.monitors.values():
                yield ERROR_CONTROL_COB_ID + monitor.node_id, monitor.receive

    def tick(self, now_us: int) -> None:
        """See which heartbeats are late."""
        for monitor in self.monitors.values():
            if monitor.deadline_us <= now_us:
                monitor.lose()
        self.reschedule()

    def reschedule(self) -> None:
        """Wait for the earliest deadline."""
        deadlines = (monitor.deadline_us for monitor in self.monitors.values())
        self.schedule(min(deadlines, default=NEVER))

    def _watch(self, entry: Entry) -> None:
        if _is_used(entry.number):
            self.monitors[entry.sub] = Monitor(self, entry.number)

    def _changed(self, entry: Entry) -> None:
        monitor = self.monitors.pop(entry.sub, None)
        if monitor is not None:
            monitor.clear()
        self._watch(entry)
        self.node.rewire()
        self.reschedule()

    def _check(self, entry: Entry, value: Value) -> None:
        number = value if isinstance(value, int) else 0
        if number & RESERVED:
            raise SdoAbort(AbortCode.VALUE_RANGE)
        others = (other.number for other in self._entries if other is not entry)
        if _is_used(number) and any(
            _is_used(other) and _node_id(other) == _node_id(number) for other in others
        ):
            raise SdoAbort(AbortCode.PARAMETER_INCOMPATIBLE)


def _node_id(value: int) -> int:
    return value >> 16 & 0xFF


def _time_us(value: int) -> int:
    return (value & 0xFFFF) * 1_000


def _is_used(value: int) -> bool:
    return bool(_time_us(value)) and 1 <= _node_id(value) <= MAX_NODES
