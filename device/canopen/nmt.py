"""The NMT slave, heartbeat and node guarding."""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum, auto
from typing import Final

from tickrig._compiled import mypyc_attr
from tickrig.device.canopen.dictionary import Entry, SdoAbort
from tickrig.device.canopen.slave import ALWAYS, UNCONFIGURED, CanopenSlave, Handler, Service
from tickrig.device.twin import Part
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen import nmt
from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.canopen.emcy import EmcyCode, ErrorRegister
from tickrig.wire.canopen.sdo_frame import AbortCode
from tickrig.wire.instant import NEVER

# NMT slave: boot-up, commands, self start (CiA 301, network management).

_NEXT_STATE: Final = {
    nmt.NmtCommand.START: nmt.NmtState.OPERATIONAL,
    nmt.NmtCommand.STOP: nmt.NmtState.STOPPED,
    nmt.NmtCommand.ENTER_PRE_OPERATIONAL: nmt.NmtState.PRE_OPERATIONAL,
}
"""Next states by command, for every state except Initialising (CiA 301, NMT state diagram)."""

_NMT_STARTUP: Final = 0x1F80
_SELF_START_MASK: Final = 0b1101
_SELF_START: Final = 0b1000
"""Value of 1F80h of a slave that starts itself (CiA 302-2)."""


@mypyc_attr(allow_interpreted_subclasses=True)
class NmtSlave(Service):
    """Obeys the NMT master."""

    def booted(self) -> None:
        """Send the boot-up message, and enter Pre-operational, or Operational if self-starting."""
        if not self.node.boots():
            return
        self.node.send(
            nmt.ERROR_CONTROL_COB_ID + self.node.node_id, bytes([nmt.NmtState.INITIALISING])
        )
        self.node.enter(nmt.NmtState.PRE_OPERATIONAL)
        startup = self.node.dictionary.find(_NMT_STARTUP)
        # Value 8 of 1F80h: bit 0 (node is the NMT master) is 0, bit 2 is 0, bit 3 is 1. Bit 1
        # concerns masters only.
        if startup is not None and startup.number & _SELF_START_MASK == _SELF_START:
            self.node.enter(nmt.NmtState.OPERATIONAL)

    def handlers(self, state: nmt.NmtState) -> Iterator[tuple[int, Handler]]:
        """Listen to the NMT master; a node without node-ID listens to LSS only."""
        if self.node.node_id != UNCONFIGURED:
            yield nmt.NMT_COB_ID, self._receive

    def reconfigured_by(self, state: nmt.NmtState) -> Iterator[int]:
        """Return the CAN-ID of the NMT master; the NMT state determines the received CAN-IDs."""
        return (can_id for can_id, _ in self.handlers(state))

    def _receive(self, frame: CanFrame) -> None:
        """Execute a command; ignore frames that are not a command for this node."""
        # 000#8105: command, node-ID; 000#8100: all nodes.
        if len(frame.data) != 2 or frame.data[1] not in (nmt.ALL_NODES, self.node.node_id):
            return
        try:
            command = nmt.NmtCommand(frame.data[0])
        except ValueError:
            return
        if self.node.admits(command):
            self._obey(command)

    def _obey(self, command: nmt.NmtCommand) -> None:
        match command:
            case nmt.NmtCommand.RESET_NODE:
                self.node.reset_node()
            case nmt.NmtCommand.RESET_COMMUNICATION:
                self.node.reset_communication()
            case _:
                self.node.enter(_NEXT_STATE[command])


# Error control of a slave: heartbeat producer, node and life guarding (CiA 301, 1017h, 100Ch).


@mypyc_attr(allow_interpreted_subclasses=True)
class HeartbeatProducer(Service):
    """Sends the heartbeat of the slave: its NMT state, once in each heartbeat time (1017h).

    The boot-up message counts as the first heartbeat. A write to 1017h, over the bus or by the
    device itself, restarts the period, so the next heartbeat follows one period later.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self._period = node.dictionary.find(0x1017)
        self._due_us = NEVER
        self._begins = False
        if self._period is not None:
            self._period.watch(self._changed)
            self._period.written = self._changed  # writing the same value restarts the period, too

    def booted(self) -> None:
        """Start the period at the boot-up message."""
        self._begin()

    def tick(self, now_us: int) -> None:
        """Start the period, or send one heartbeat."""
        node = self.node
        period_us = 1_000 * self._period.number if self._period is not None else 0
        if self._begins:
            self._due_us = now_us
        else:
            node.send(nmt.ERROR_CONTROL_COB_ID + node.node_id, bytes([node.state]))
        self._begins = False
        # From the last due time, not from now: no drift.
        self._due_us += period_us
        self.schedule(self._due_us if period_us else NEVER)

    def _changed(self, entry: Entry) -> None:
        self._begin()

    def _begin(self) -> None:
        """Start the period in this tick or the next one, but not before the boot-up message."""
        # While the node initialises the values of a reset arrive here, too; `booted` begins
        # then.
        if self.node.state is not nmt.NmtState.INITIALISING:
            self._begins = True
            self.schedule(0)


_GUARD_TIME: Final = 0x100C
_LIFE_TIME_FACTOR: Final = 0x100D
_PRODUCER_HEARTBEAT_TIME: Final = 0x1017
_TOGGLE: Final = 0x80


@mypyc_attr(allow_interpreted_subclasses=True)
class NodeGuarding(Service):
    """Answers guarding requests of the master with the NMT state, and checks that they arrive.

    The toggle bit is 0 after a reset and changes with each answer. Life guarding begins with the
    first request. Then a request must follow within the guard time multiplied by the life time
    factor. Otherwise the slave raises EMCY 8130h and a communication error (1029h), which last
    until the next request. While the heartbeat is on (1017h is not 0), requests are neither
    answered nor supervised. If the dictionary lacks 100Ch, node guarding is off.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        find = node.dictionary.find
        self._guard_time, self._factor = find(_GUARD_TIME), find(_LIFE_TIME_FACTOR)
        self._heartbeat = find(_PRODUCER_HEARTBEAT_TIME)
        self._toggle = 0
        for entry in (self._guard_time, self._factor, self._heartbeat):
            if entry is not None:
                entry.watch(self._changed)

    @property
    def life_time_us(self) -> int:
        """The node life time, or 0 if life guarding is off."""
        if self._guard_time is None or self._factor is None:
            return 0
        return self._guard_time.number * self._factor.number * 1_000

    @property
    def _heartbeat_instead(self) -> bool:
        return self._heartbeat is not None and self._heartbeat.number > 0

    def start(self) -> None:
        """Reset the toggle bit to 0, and wait for the first request."""
        self._toggle = 0

    def remote_handlers(self, state: nmt.NmtState) -> Iterator[tuple[int, Handler]]:
        """Listen to requests in every state but Initialising."""
        if state in ALWAYS and self._guard_time is not None:
            yield nmt.ERROR_CONTROL_COB_ID + self.node.node_id, self._receive

    def tick(self, now_us: int) -> None:
        """Report that the master no longer sends requests."""
        self.node.emergency(EmcyCode.HEARTBEAT, ErrorRegister.COMMUNICATION)
        self.node.communication_error()

    def _receive(self, frame: CanFrame) -> None:
        if self._heartbeat_instead:
            return
        node = self.node
        # 705#7F, 705#FF, 705#7F: the toggle bit is bit 7, Pre-operational the other seven.
        node.send(nmt.ERROR_CONTROL_COB_ID + node.node_id, bytes([self._toggle | node.state]))
        self._toggle ^= _TOGGLE
        node.emergency_clear(EmcyCode.HEARTBEAT, b"")
        life_time_us = self.life_time_us
        self.schedule(node.now_us + life_time_us if life_time_us else NEVER)

    def _changed(self, entry: Entry) -> None:
        """Wait for the next request with the new times."""
        self.node.emergency_clear(EmcyCode.HEARTBEAT, b"")
        self.schedule(NEVER)


# Heartbeat consumer (CiA 301, error control services; object 1016h).

_CONSUMER_HEARTBEAT_TIME: Final = 0x1016
_MAX_NODES: Final = 127
_RESERVED: Final = 0xFF00_0000


class Watch(Enum):
    """Monitoring state of a node."""

    UNKNOWN = auto()  # no heartbeat yet: nothing is late
    ALIVE = auto()
    LOST = auto()


class Monitor(Part):
    """Monitors the heartbeat of one other node, for the heartbeat consumer of a slave.

    Args:
        consumer: heartbeat consumer that the monitor belongs to.
        value: value of an entry of 1016h, with the node-ID in bits 16 to 23 and the time in ms in
            bits 0 to 15.

    Attributes:
        node_id: node-ID of the monitored node.
        period_us: consumer heartbeat time.
        watch: state of the monitoring.
        nmt_state: NMT state that the node has sent last, or None before its first heartbeat.
        deadline_us: time from which the heartbeat of the node is late.
    """

    __slots__ = ("_consumer", "deadline_us", "nmt_state", "node_id", "period_us", "watch")

    def __init__(self, consumer: HeartbeatConsumer, value: int) -> None:
        self._consumer = consumer
        self.node_id, self.period_us = _node_id(value), _time_us(value)
        self.watch, self.deadline_us = Watch.UNKNOWN, NEVER
        self.nmt_state: int | None = None

    def receive(self, frame: CanFrame) -> None:
        """Handle a heartbeat."""
        if len(frame.data) != 1:
            return
        self.nmt_state = frame.data[0]
        before, self.watch = self.watch, Watch.ALIVE
        # The deadline moves but the schedule does not: the service wakes at the old deadline and
        # checks the new one. Rescheduling at each heartbeat would cost more than that one check.
        self.deadline_us = self._consumer.node.now_us + self.period_us
        if before is not Watch.ALIVE:
            if before is Watch.LOST:
                self.clear()
            self._consumer.reschedule()

    def lose(self) -> None:
        """Report that the heartbeat is late."""
        self.watch, self.deadline_us = Watch.LOST, NEVER
        node = self._consumer.node
        node.emergency(EmcyCode.HEARTBEAT, ErrorRegister.COMMUNICATION, bytes([self.node_id]))
        node.communication_error()

    def clear(self) -> None:
        """Clear the error, if there is one."""
        self._consumer.node.emergency_clear(EmcyCode.HEARTBEAT, bytes([self.node_id]))


@mypyc_attr(allow_interpreted_subclasses=True)
class HeartbeatConsumer(Service):
    """Monitors the heartbeats of the nodes that 1016h lists.

    Monitoring of a node begins with its first heartbeat. The boot-up message counts as a heartbeat.
    A missing heartbeat raises a communication error (1029h) and EMCY 8130h, whose first
    manufacturer-specific byte is the node-ID. The error is cleared when a heartbeat arrives again,
    or when the entry of 1016h is changed.

    An entry with time 0 or with a node-ID outside 1..127 is not used. A second entry for the same
    node-ID is refused with 0604 0043h. An entry with reserved bits is refused with 0609 0030h.

    Attributes:
        monitors: monitors of the entries in use.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self.monitors: dict[int, Monitor] = {}
        self._entries = node.dictionary.elements(_CONSUMER_HEARTBEAT_TIME, _MAX_NODES)
        for entry in self._entries:
            entry.guard = self._check
            entry.watch(self._changed)

    def start(self) -> None:
        """Monitor the nodes of the power-on values."""
        for entry in self._entries:
            self._watch(entry)

    def handlers(self, state: nmt.NmtState) -> Iterator[tuple[int, Handler]]:
        """Listen to heartbeats in every state but Initialising."""
        if state in ALWAYS:
            for monitor in self.monitors.values():
                yield nmt.ERROR_CONTROL_COB_ID + monitor.node_id, monitor.receive

    def tick(self, now_us: int) -> None:
        """Check for late heartbeats."""
        for monitor in self.monitors.values():
            if monitor.deadline_us <= now_us:
                monitor.lose()
        self.reschedule()

    def reschedule(self) -> None:
        """Schedule the earliest deadline."""
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
        if number & _RESERVED:
            raise SdoAbort(AbortCode.VALUE_RANGE)
        others = (other.number for other in self._entries if other is not entry)
        if _is_used(number) and any(
            _is_used(other) and _node_id(other) == _node_id(number) for other in others
        ):
            raise SdoAbort(AbortCode.PARAMETER_INCOMPATIBLE)


def _node_id(value: int) -> int:
    # 1016h: 00 nn tttt: node-ID in bits 16 to 23, time in ms in bits 0 to 15.
    return value >> 16 & 0xFF


def _time_us(value: int) -> int:
    return (value & 0xFFFF) * 1_000


def _is_used(value: int) -> bool:
    return bool(_time_us(value)) and 1 <= _node_id(value) <= _MAX_NODES
