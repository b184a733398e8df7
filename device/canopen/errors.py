"""Errors of a slave: EMCY produced and consumed, error behaviour."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from enum import IntEnum
from typing import Final, NamedTuple

from tickrig._compiled import mypyc_attr
from tickrig.device.canopen.dictionary import (
    Dictionary,
    Entry,
    SdoAbort,
    check_emcy_cob_id,
    is_valid,
)
from tickrig.device.canopen.slave import ALIVE, CanopenSlave, Handler, Service
from tickrig.device.twin import Listeners, Part
from tickrig.wire.can import CanFrame, ErrorState
from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.canopen.emcy import TEXT_BYTES, Emcy, EmcyCode, ErrorRegister
from tickrig.wire.canopen.nmt import CAN_ID_MASK, NmtState
from tickrig.wire.canopen.sdo_frame import AbortCode
from tickrig.wire.errors import FramingError

# Theory of operation
# ===================
#
# Three services turn one event into frames and states. Their order in stack.py matters:
#
# ErrorStateEmcy, NodeGuarding, HeartbeatConsumer, ...   see the cause: node.emergency(...)
# EmcyProducer        keeps what is active, 1001h and 1003h, and sends
# ErrorBehaviour      changes the NMT state afterwards (1029h)
#
# An error is a pair of a code and five manufacturer-specific bytes. It is active until the same
# pair is cleared. `emergency` has no effect for an active error, so a service may call it in each
# tick in which it sees the cause. `emergency_clear` has no effect for an error that is not
# active. Two late RPDOs are two errors, because the bytes contain their numbers. 1001h is the
# union of the register bits of all active errors, so clearing one error must not clear a bit that
# another error sets.
#
# Two messages of one error, when it is raised and when it is cleared, for node-ID 5 and the
# heartbeat of node 7:
#
# 085   30 81 11 07 00 00 00 00    8130h, register: generic and communication, node 7
# 085   00 00 00 07 00 00 00 00    0000h, nothing is left, the same bytes
#
# The register in a message is the one at the time of the event: `_queue_message` reads it when
# the message is queued, not when the message is sent. Messages wait in Stopped (where EMCY is not
# allowed), in bus-off, and for the inhibit time. At most 16 messages wait; later ones are lost. A
# reset deletes errors and messages. A service that still sees the cause must raise its error
# again, as `ErrorStateEmcy.booted` does. It raises the error one tick later: the boot-up message
# has the larger CAN-ID, so in the same tick the EMCY would be sent before it.
#
# Codes and register bits are those of CiA 301. The length of the queue is a choice.

# Error behaviour (CiA 301, object dictionary; object 1029h).

_ERROR_BEHAVIOUR: Final = 0x1029
_COMMUNICATION_ERROR: Final = 1
OUTPUT_ERROR: Final = 2
INPUT_ERROR: Final = 3
"""Sub-indices of 1029h; the sub-indices of output and input errors are those of CiA 401."""


class _Behaviour(IntEnum):
    """NMT state after an error."""

    PRE_OPERATIONAL = 0  # only from Operational
    NO_CHANGE = 1
    STOPPED = 2


@mypyc_attr(allow_interpreted_subclasses=True)
class ErrorBehaviour(Service):
    """Changes the NMT state of the slave after an error, as 1029h (error behaviour) demands.

    Each sub-index of 1029h is for one kind of error. If the sub-index for communication errors is
    missing, the value 0 is used. If the sub-index for another kind is missing, errors of this kind
    have no effect. After an error, the EMCY is sent first, and then the NMT state changes. Writing
    an undefined value to 1029h is refused with 0609 0030h.

    Sub-indices that other profiles or manufacturers define are not emulated. Instead, an
    application may call `node.enter` itself.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self._behaviours: dict[int, Entry] = {}
        self._errors: list[int] = []
        for error in (_COMMUNICATION_ERROR, OUTPUT_ERROR, INPUT_ERROR):
            entry = node.dictionary.find(_ERROR_BEHAVIOUR, error)
            if entry is not None:
                entry.guard = _known
                self._behaviours[error] = entry

    def start(self) -> None:
        """Clear the pending error."""
        self._errors.clear()

    def communication_error(self) -> None:
        """Apply the error behaviour in this tick."""
        self.act(_COMMUNICATION_ERROR)

    def act(self, error: int) -> None:
        """Apply the behaviour of an error in this tick, given by its sub-index."""
        # Noted, and applied at its place in the tick: the EMCY of the same error leaves
        # first.
        self._errors.append(error)
        self.schedule(self.node.now_us)

    def tick(self, now_us: int) -> None:
        """Change the NMT state."""
        for error in self._errors:
            self._change(self._behaviour(error))
        self._errors.clear()

    def _behaviour(self, error: int) -> int:
        if error in self._behaviours:
            return self._behaviours[error].number
        communication = error == _COMMUNICATION_ERROR
        return _Behaviour.PRE_OPERATIONAL if communication else _Behaviour.NO_CHANGE

    def _change(self, behaviour: int) -> None:
        node = self.node
        if behaviour == _Behaviour.PRE_OPERATIONAL and node.state is NmtState.OPERATIONAL:
            node.enter(NmtState.PRE_OPERATIONAL)
        elif behaviour == _Behaviour.STOPPED and node.state in ALIVE:
            node.enter(NmtState.STOPPED)


def _known(entry: Entry, value: Value) -> None:
    if value not in tuple(_Behaviour):
        raise SdoAbort(AbortCode.VALUE_RANGE)


# EMCY producer with error register and error history (CiA 301, emergency object).

_ERROR_REGISTER: Final = 0x1001
_PRE_DEFINED_ERROR_FIELD: Final = 0x1003
_COB_ID_EMCY: Final = 0x1014
_INHIBIT_TIME_EMCY: Final = 0x1015

_QUEUE_LENGTH: Final = 16
"""Largest number of waiting EMCY messages; more messages are lost, as in a real device."""


@mypyc_attr(allow_interpreted_subclasses=True)
class EmcyProducer(Service):
    """Sends an EMCY message when an error occurs, and another one when it is cleared (0000h).

    An error is identified by its error code and by the manufacturer-specific bytes of its message
    (the argument `text`). The error register 1001h combines the bits of all active errors, and its
    generic bit is set while any error is active. Each message contains this register. Thus the
    message that an error was cleared shows the errors that remain.

    In the NMT state Stopped and in bus-off, messages wait and are sent afterwards. A reset clears
    all errors and waiting messages. Therefore a service must raise its error again if the error
    still exists after the reset.

    Not emulated: 29-bit CAN-IDs.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        find = node.dictionary.find
        self._register, self._cob_id = find(_ERROR_REGISTER), find(_COB_ID_EMCY)
        self._inhibit = find(_INHIBIT_TIME_EMCY)
        self._history = _ErrorHistory(node.dictionary)
        self._active: dict[tuple[int, bytes], int] = {}
        self._queue: list[bytes] = []
        self._free_us, self._bus_off = 0, False
        if self._cob_id is not None:
            self._cob_id.guard = check_emcy_cob_id

    @property
    def register(self) -> int:
        """The error register."""
        bits = int(ErrorRegister.GENERIC) if self._active else 0
        for register in self._active.values():
            bits |= register & 0xFF
        return bits

    def power_on(self) -> None:
        """Assume that the bus is working."""
        self._bus_off = False

    def start(self) -> None:
        """Clear all errors."""
        self._active.clear()
        self._queue.clear()
        self._free_us = 0

    def emergency(self, code: int, register: int, text: bytes) -> None:
        """Record and report an error unless it is already active."""
        key = code & 0xFFFF, _padded(text)
        if key not in self._active:
            self._active[key] = register
            self._history.note(*key)
            self._queue_message(*key)

    def emergency_clear(self, code: int, text: bytes | None) -> None:
        """Report the end of an error if it was active."""
        gone = [
            key
            for key in self._active
            if key[0] == code and (text is None or key[1] == _padded(text))
        ]
        for key in gone:
            del self._active[key]
            self._queue_message(EmcyCode.NO_ERROR, key[1])

    def state_changed(self, old: NmtState, new: NmtState) -> None:
        """Send the messages that waited in Stopped."""
        if self._queue:
            self.schedule(self._free_us)

    def bus_state(self, state: ErrorState) -> None:
        """Hold messages in bus-off; send them afterwards."""
        self._bus_off = state is ErrorState.BUS_OFF
        if self._queue:
            self.schedule(self._free_us)

    def tick(self, now_us: int) -> None:
        """Send the messages that the inhibit time allows."""
        cob_id = self._cob_id
        # Without a valid 1014h no message can be sent. Drop the messages, so that old ones are
        # not sent when 1014h becomes valid.
        if cob_id is None or not is_valid(cob_id.number):
            self._queue.clear()
            return
        if self.node.state not in ALIVE or self._bus_off:
            return
        inhibit_us = self._inhibit.number * 100 if self._inhibit is not None else 0
        while self._queue and self._free_us <= now_us:
            self.node.send(cob_id.number & CAN_ID_MASK, self._queue.pop(0))
            self._free_us = now_us + inhibit_us
        if self._queue:
            self.schedule(self._free_us)

    def _queue_message(self, code: int, text: bytes) -> None:
        register = self.register
        if self._register is not None:
            self._register.assign(bytes([register]))
        # 1001h above follows the error even if its message is lost.
        if len(self._queue) < _QUEUE_LENGTH:
            self._queue.append(Emcy(code, register, text).encode())
        self.schedule(self._free_us)


class _ErrorHistory(Part):
    """Keeps the latest errors, the newest at sub-index 1.

    Sub-index 0 counts the errors. Writing 0 to it clears all errors; other values are refused
    with 0609 0030h. Reading a sub-index without an error is refused with 0800 0024h. A field
    contains the error code in its low half and the first two manufacturer-specific bytes above
    it. The end of an error is not recorded.

    Args:
        dictionary: objects of the slave, of which 1003h may be missing.
    """

    def __init__(self, dictionary: Dictionary) -> None:
        self._count = dictionary.find(_PRE_DEFINED_ERROR_FIELD)
        self._fields = dictionary.elements(_PRE_DEFINED_ERROR_FIELD)
        if self._count is not None:
            self._count.guard = _only_zero
            for field in self._fields:
                field.source = self._read

    def note(self, code: int, text: bytes) -> None:
        """Insert an error at the top of the error history 1003h.

        If all its fields are in use, the oldest error is dropped.
        """
        if self._count is None or not self._fields:
            return
        count = min(self._count.number + 1, len(self._fields))
        for sub in reversed(range(1, count)):
            self._fields[sub].assign(self._fields[sub - 1].data)
        # Example: 1003h:01 is the number 07 00 81 30h, with the error code in the low half and
        # additional information above.
        self._fields[0].assign(code.to_bytes(2, "little") + text[:2].ljust(2, b"\0"))
        self._count.assign(bytes([count]))

    def _read(self, field: Entry) -> bytes:
        if self._count is None or field.sub > self._count.number:
            raise SdoAbort(AbortCode.NO_DATA)
        return field.data


def _only_zero(entry: Entry, value: Value) -> None:
    if value != 0:
        raise SdoAbort(AbortCode.VALUE_RANGE)


def _padded(text: bytes) -> bytes:
    return text[:TEXT_BYTES].ljust(TEXT_BYTES, b"\0")


# EMCY consumer (CiA 301, emergency object; object 1028h).

_EMERGENCY_CONSUMER: Final = 0x1028
_MAX_NODES: Final = 127


class EmcyConsumer(Service):
    """Receives EMCY messages of other nodes. The object 1028h contains the COB-IDs of the messages.

    The sub-index of an entry in 1028h is the node-ID of the other node. The application decides how
    to react to a message. A message that does not have exactly eight bytes is ignored.

    Attributes:
        latest: latest EMCY since the reset, by node-ID.
        on_emcy: functions that are called with the node-ID and the message.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self.latest: dict[int, Emcy] = {}
        self.on_emcy: Listeners[Callable[[int, Emcy], None]] = Listeners()
        self._entries = [
            entry
            for entry in node.dictionary.object(_EMERGENCY_CONSUMER)
            if 1 <= entry.sub <= _MAX_NODES
        ]
        for entry in self._entries:
            entry.guard = check_emcy_cob_id
            entry.watch(self.follow_cob_id)

    def start(self) -> None:
        """Forget the EMCYs of other nodes."""
        self.latest.clear()

    def handlers(self, state: NmtState) -> Iterator[tuple[int, Handler]]:
        """Listen in Pre-operational and Operational."""
        if state in ALIVE:
            for entry in self._entries:
                if is_valid(entry.number):
                    yield entry.number & CAN_ID_MASK, _Producer(self, entry.sub).receive

    def take(self, node_id: int, emcy: Emcy) -> None:
        """Record the EMCY of a node."""
        self.latest[node_id] = emcy
        for notify in self.on_emcy:
            notify(node_id, emcy)


class _Producer(NamedTuple):
    """Receives the EMCY of another node."""

    consumer: EmcyConsumer
    node_id: int

    def receive(self, frame: CanFrame) -> None:
        with suppress(FramingError):
            self.consumer.take(self.node_id, Emcy.parse(frame.data))


# Reaction of a slave to the fault confinement of its CAN controller (CiA 301, emergency object).


class ErrorStateEmcy(Service):
    """Sends an EMCY when the CAN controller is error-passive (8120h) or back from bus-off (8140h).

    The error 8120h is cleared when the controller is error-active again. The error 8140h is sent
    after the recovery from bus-off, and is cleared at once. When the controller becomes bus-off,
    the slave reacts as the object 1029h:01 defines for communication errors.

    Not emulated: the recovery of the controller itself.

    Attributes:
        state: error state that the controller has reported last.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self.state = ErrorState.ACTIVE

    def power_on(self) -> None:
        """Start error-active."""
        self.state = ErrorState.ACTIVE

    def booted(self) -> None:
        """Report error-passive again after the boot-up message, if the state still applies."""
        if self.state is ErrorState.PASSIVE:
            self.schedule(self.node.now_us + 1)

    def tick(self, now_us: int) -> None:
        """Report error-passive."""
        self._report_passive()

    def bus_state(self, state: ErrorState) -> None:
        """Report a change of state."""
        node, old, self.state = self.node, self.state, state
        if old is state:
            return
        if state is ErrorState.BUS_OFF:
            node.communication_error()
            return
        # Raised and cleared at once: 8140h reports that bus-off is over.
        if old is ErrorState.BUS_OFF:
            node.emergency(EmcyCode.BUS_OFF_RECOVERED, ErrorRegister.COMMUNICATION)
            node.emergency_clear(EmcyCode.BUS_OFF_RECOVERED)
        if state is ErrorState.PASSIVE:
            self._report_passive()
        else:
            node.emergency_clear(EmcyCode.CAN_PASSIVE)

    def _report_passive(self) -> None:
        self.node.emergency(EmcyCode.CAN_PASSIVE, ErrorRegister.COMMUNICATION)
