"""TIME consumer and producer (CiA 301, time stamp object; object 1012h)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from tickrig.device.canopen.core.cob_id_rules import check_time_cob_id
from tickrig.device.canopen.core.service import ALIVE, Handler, Service
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.cob_id import CAN_ID_MASK, FLAG_30, INVALID
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.canopen.time_of_day import TimeOfDay
from tickrig.wire.errors import WireError

COB_ID_TIME: Final = 0x1012
CONSUMES: Final = INVALID
PRODUCES: Final = FLAG_30


class TimeStamp(Service):
    """Keeps the time of day.

    Bit 31 of 1012h makes it consume TIME; `node.time_of_day` is the latest time
    stamp as it came, `now` the clock that goes on from there. Bit 30 lets the
    application send TIME by `produce`. What is no time of day is ignored.

    Not emulated: the error of a real clock; high resolution time stamps (1013h).
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self._set_us, self._ordered = 0, TimeOfDay(0, 0)
        self._cob_id = node.dictionary.find(COB_ID_TIME)
        if self._cob_id is not None:
            self._cob_id.guard = check_time_cob_id
            self._cob_id.watch(self.follow_cob_id)

    @property
    def now(self) -> TimeOfDay | None:
        """The time of day, None before it was set."""
        latest = self.node.time_of_day
        return None if latest is None else latest.after(self.node.now_us - self._set_us)

    def handlers(self, state: NmtState) -> Iterator[tuple[int, Handler]]:
        """Listen to TIME in Pre-operational and Operational."""
        cob_id = self._number
        if state in ALIVE and cob_id & CONSUMES:
            yield cob_id & CAN_ID_MASK, self._receive

    def produce(self, time: TimeOfDay) -> None:
        """Set the clock in the next tick, and send TIME then if 1012h and NMT state allow it.

        Raises:
            FieldError: there is no such time.
        """
        self._ordered = time.checked()
        self.schedule(self.node.now_us)

    def tick(self, now_us: int) -> None:
        """Send what was ordered."""
        self._set(self._ordered)
        cob_id = self._number
        if self.node.state in ALIVE and cob_id & PRODUCES:
            self.node.send(cob_id & CAN_ID_MASK, self._ordered.encode())

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
