"""SYNC and TIME: consumers and producers (CiA 301)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from tickrig._compiled import mypyc_attr
from tickrig.device.canopen.dictionary import Entry, SdoAbort, check_time_cob_id, whole_number
from tickrig.device.canopen.slave import ALIVE, CanopenSlave, Handler, Service
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen import nmt
from tickrig.wire.canopen.datatypes import TimeOfDay, Value
from tickrig.wire.canopen.emcy import EmcyCode, ErrorRegister
from tickrig.wire.canopen.sdo_frame import AbortCode
from tickrig.wire.errors import WireError
from tickrig.wire.instant import NEVER

# SYNC consumer and producer (CiA 301, synchronization object; 1005h, 1006h, 1019h).

COB_ID_SYNC: Final = 0x1005
_COMMUNICATION_CYCLE_PERIOD: Final = 0x1006
_SYNC_COUNTER_OVERFLOW: Final = 0x1019

_COUNTER_OVERFLOWS: Final = (0, *range(2, 241))
_NOT_IN_A_CAN_ID: Final = nmt.EXTENDED | 0x1FFF_F800


@mypyc_attr(allow_interpreted_subclasses=True)
class Sync(Service):
    """Consumes SYNC, and produces SYNC if bit 30 of 1005h is set and 1006h is not 0.

    `node.on_sync` is called for each SYNC, including the slave's own, in the order of the frames
    of a tick. A SYNC whose length does not fit 1019h is ignored and raises EMCY 8240h, which the
    next valid SYNC clears. The slave's own SYNC starts one period after a write to 1005h, 1006h
    or 1019h, or one period after the node left Initialising or Stopped. Its counter starts at 1.

    Not emulated: 29-bit CAN-IDs; periods shorter than a tick (the slave sends one SYNC per tick);
    an EMCY for a missing SYNC, which CiA 301 leaves open.
    """

    __slots__ = (
        *("_cob_id", "_counter", "_due_us", "_length", "_length_error", "_overflow", "_period"),
    )

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        find = node.dictionary.find
        self._cob_id = find(COB_ID_SYNC)
        self._period = find(_COMMUNICATION_CYCLE_PERIOD)
        self._overflow = find(_SYNC_COUNTER_OVERFLOW)
        self._due_us, self._counter, self._length, self._length_error = NEVER, 0, 0, False
        if self._cob_id is not None:
            self._cob_id.guard = self._check_cob_id
            self._cob_id.watch(self._changed)
        if self._period is not None:
            self._period.watch(self._changed)
        if self._overflow is not None:
            self._overflow.guard = self._check_overflow
            self._overflow.watch(self._changed)

    @property
    def can_id(self) -> int:
        """The CAN-ID, or 0 if SYNC is neither consumed nor produced."""
        return self._cob_id.number & nmt.CAN_ID_MASK if self._cob_id is not None else 0

    @property
    def period_us(self) -> int:
        """The communication cycle period, or 0 for none."""
        return self._period.number if self._period is not None else 0

    @property
    def overflow(self) -> int:
        """The greatest counter, or 0 if SYNC carries no counter."""
        return self._overflow.number if self._overflow is not None else 0

    @property
    def _produces(self) -> bool:
        return self._cob_id is not None and bool(self._cob_id.number & nmt.FLAG_30)

    def start(self) -> None:
        """Clear the length error."""
        self._length_error = False

    def state_changed(self, old: nmt.NmtState, new: nmt.NmtState) -> None:
        """Start or stop producing."""
        if (old in ALIVE) is not (new in ALIVE):
            self._begin()

    def handlers(self, state: nmt.NmtState) -> Iterator[tuple[int, Handler]]:
        """Listen to SYNC in Pre-operational and Operational."""
        self._length = 1 if self.overflow else 0
        if state in ALIVE and not nmt.is_restricted(self.can_id):
            yield self.can_id, self._receive

    def tick(self, now_us: int) -> None:
        """Send SYNC and act on the SYNC, or start the period."""
        if self._due_us == NEVER:
            self._due_us = now_us + self.period_us
            self.schedule(self._due_us)
            return
        # From the last due time, without drift; a period below the tick still means one
        # SYNC a tick.
        self._due_us = max(self._due_us + self.period_us, now_us + 1)
        self.schedule(self._due_us)
        # 080#01, 080#02, ..., 080#nn, 080#01: counts from 1, and 0 stands for "without a
        # counter".
        self._counter = self._counter % self.overflow + 1 if self.overflow else 0
        self.node.send(self.can_id, bytes([self._counter] if self._counter else []))
        self._announce(self._counter)

    def _receive(self, frame: CanFrame) -> None:
        data = frame[1]
        if len(data) != self._length:
            self._length_error = True
            length = bytes([len(data)])
            self.node.emergency(EmcyCode.SYNC_LENGTH, ErrorRegister.COMMUNICATION, length)
            return
        if self._length_error:
            self._length_error = False
            self.node.emergency_clear(EmcyCode.SYNC_LENGTH)
        self._announce(data[0] if data else 0)

    def _announce(self, counter: int) -> None:
        node = self.node
        # In the order of the list: RPDOs, TPDOs, application. Observers of the slave come
        # after all.
        for notify in node.sync_handlers:
            notify(counter)
        if node.on_sync:  # mostly nobody listens: 1 % of a network
            for notify in node.on_sync:
                notify(counter)

    def _changed(self, entry: Entry) -> None:
        """Apply another COB-ID, period or overflow value."""
        if self.node.state in ALIVE:
            self.node.rewire()
            self._begin()

    def _begin(self) -> None:
        """Start producing with the counter at 1, or stop."""
        self._counter, self._due_us = 0, NEVER
        running = self._produces and self.period_us and self.node.state in ALIVE
        self.schedule(self.node.now_us if running else NEVER)

    def _check_cob_id(self, entry: Entry, value: Value) -> None:
        """Refuse an invalid CAN-ID, and any change while the slave produces SYNC."""
        cob_id = whole_number(value)
        can_id, producer = cob_id & nmt.CAN_ID_MASK, bool(cob_id & nmt.FLAG_30)
        if cob_id & _NOT_IN_A_CAN_ID or nmt.is_restricted(can_id):
            raise SdoAbort(AbortCode.VALUE_RANGE)
        # A producer needs 1006h; while it produces, the CAN-ID must not change (CiA 301,
        # 1005h).
        if producer and (self._period is None or (self._produces and can_id != self.can_id)):
            raise SdoAbort(AbortCode.VALUE_RANGE)

    def _check_overflow(self, entry: Entry, value: Value) -> None:
        """Refuse an invalid overflow value, and any change while a period is set."""
        if value not in _COUNTER_OVERFLOWS:
            raise SdoAbort(AbortCode.VALUE_RANGE)
        if self.period_us:
            raise SdoAbort(AbortCode.DEVICE_STATE)


_COB_ID_TIME: Final = 0x1012
_CONSUMES: Final = nmt.INVALID
_PRODUCES: Final = nmt.FLAG_30


class TimeStamp(Service):
    """Receives or sends the time of day (message TIME), and keeps a clock with the time of day.

    If bit 31 of 1012h is set, the slave receives TIME. `node.time_of_day` is the time stamp that
    was received last, and `now` is the present time of day of the clock, which continues from that
    time stamp. If bit 30 is set, the application may send TIME by `produce`. Invalid times of day
    are ignored.

    Not emulated: the error of a real clock; high resolution time stamps (1013h).
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self._set_us, self._ordered = 0, TimeOfDay(0, 0)
        self._cob_id = node.dictionary.find(_COB_ID_TIME)
        if self._cob_id is not None:
            self._cob_id.guard = check_time_cob_id
            self._cob_id.watch(self.follow_cob_id)

    @property
    def now(self) -> TimeOfDay | None:
        """The time of day, or None until it is set."""
        latest = self.node.time_of_day
        return None if latest is None else latest.after(self.node.now_us - self._set_us)

    def handlers(self, state: nmt.NmtState) -> Iterator[tuple[int, Handler]]:
        """Listen to TIME in Pre-operational and Operational."""
        cob_id = self._number
        if state in ALIVE and cob_id & _CONSUMES:
            yield cob_id & nmt.CAN_ID_MASK, self._receive

    def produce(self, time: TimeOfDay) -> None:
        """Set the clock in the next tick, and send TIME if 1012h and the NMT state allow it.

        Args:
            time: time of day to set.

        Raises:
            FieldError: the time is invalid.
        """
        self._ordered = time.checked()
        self.schedule(self.node.now_us)

    def tick(self, now_us: int) -> None:
        """Set the clock, and send TIME if requested."""
        self._set(self._ordered)
        cob_id = self._number
        if self.node.state in ALIVE and cob_id & _PRODUCES:
            self.node.send(cob_id & nmt.CAN_ID_MASK, self._ordered.encode())

    @property
    def _number(self) -> int:
        return self._cob_id.number if self._cob_id is not None else 0

    def _receive(self, frame: CanFrame) -> None:
        try:
            self._set(TimeOfDay.parse(frame.data))
        except WireError:
            return

    def _set(self, time: TimeOfDay) -> None:
        self.node.time_of_day, self._set_us = time, self.node.now_us
