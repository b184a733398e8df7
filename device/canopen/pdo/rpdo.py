"""Receive PDOs (CiA 301, PDO; 1400h.. and 1600h..)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

from tickrig.device.canopen.dictionary import Entry
from tickrig.device.canopen.pdo import pdo_mapping
from tickrig.device.canopen.pdo.pdo_parameters import (
    EVENT_TIMER,
    RPDO_TYPES,
    SYNCHRONOUS,
    PdoParameters,
)
from tickrig.device.canopen.slave import COMMUNICATION_AREA, CanopenSlave, Handler, Service
from tickrig.device.canopen.sync import COB_ID_SYNC
from tickrig.device.twin import Part
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.eds.object_table import Access
from tickrig.wire.canopen.emcy import EmcyCode, ErrorRegister
from tickrig.wire.canopen.nmt import CAN_ID_MASK, NmtState
from tickrig.wire.canopen.pdo import DAM_MPDO, MAX_PDO_BYTES, SAM_MPDO
from tickrig.wire.instant import NEVER

_RPDO_PARAMETERS: Final = range(0x1400, 0x1600)
_RPDO_MAPPINGS: Final = 0x1600

_Target = tuple[pdo_mapping.Unpack, int]
"""The handler of the bytes, and the number of bytes that it needs."""


class Rpdo(Part):
    """Writes received data to the mapped objects, at once or with the next SYNC.

    A frame with too few bytes is dropped and raises EMCY 8210h. A frame with too many bytes is
    used up to the length of the mapping and raises EMCY 8220h. The next correct frame clears
    both. The event timer is the deadline for the next frame; a missed deadline raises EMCY 8250h,
    and each usable frame restarts the timer. These EMCYs carry the number of the RPDO. A
    synchronous RPDO that arrives after the synchronous window (1007h) is dropped.

    Args:
        consumer: service that the RPDO belongs to.
        number: number of the RPDO, 1..512.

    Attributes:
        deadline_us: time from which the next frame is late.
    """

    def __init__(self, consumer: PdoConsumer, number: int) -> None:
        self.number, self._consumer = number, consumer
        offset, dictionary = number - 1, consumer.node.dictionary
        self.parameters = PdoParameters(
            dictionary, _RPDO_PARAMETERS[offset], RPDO_TYPES, self._changed
        )
        self.mapping = pdo_mapping.PdoMapping(
            dictionary, _RPDO_MAPPINGS + offset, Access.RPDO, self.parameters
        )
        self._text = number.to_bytes(2, "little")
        self._unpack: pdo_mapping.Unpack
        self._pending: bytes | None
        self._length: int
        self._event_us: int
        self._supervised: bool

    @property
    def reconfigures(self) -> bool:
        """Whether a received frame of the RPDO can change the CAN-IDs of the slave.

        The CAN-IDs stand in communication objects. An RPDO can change them if it is an MPDO, or if
        a communication object is mapped to it.
        """
        entries = (slot.entry for slot in self.mapping.slots())
        return self.mapping.count in (DAM_MPDO, SAM_MPDO) or any(
            entry is not None and entry.index in COMMUNICATION_AREA for entry in entries
        )

    @property
    def synchronous(self) -> bool:
        """Whether the RPDO takes effect with SYNC."""
        return self.parameters.transmission_type in SYNCHRONOUS

    def listen(self) -> Handler | None:
        """Prepare the RPDO to receive frames.

        Returns:
            The handler of its frames, or None if the RPDO does not exist.
        """
        target = self._target() if self.parameters.valid else None
        if target is None:
            self.stop()
            return None
        self._unpack, self._length = target
        self._event_us = self.parameters.event_us
        # Without an active error or a deadline, a frame of the right length needs no check: this
        # common case is one comparison in `_take` and `_keep`.
        self._supervised = bool(self._errors or self._event_us)
        if self.synchronous:
            return self._keep
        self._pending = None
        return self._take

    def restart(self) -> None:
        """Clear errors and pending frames."""
        self._errors: set[int] = set()
        self._dam: pdo_mapping.DamConsumer | None = None
        self.stop()

    def stop(self) -> None:
        """Drop the frame that waits for SYNC, and the deadline."""
        self._pending, self.deadline_us = None, NEVER

    def sync(self) -> None:
        """Write the newest frame since the last SYNC to the objects."""
        data, self._pending = self._pending, None
        if data is not None:
            self._deliver(data)

    def expire(self) -> None:
        """Report that the deadline of the RPDO has passed."""
        self.deadline_us = NEVER
        self._break(EmcyCode.RPDO_TIMEOUT)

    def _target(self) -> _Target | None:
        count = self.mapping.count
        if count == DAM_MPDO:
            self._dam = self._dam or pdo_mapping.DamConsumer(self._consumer.node)
            return self._dam.unpack, MAX_PDO_BYTES
        if count == SAM_MPDO:
            return pdo_mapping.SamConsumer(self._consumer.node.dictionary).unpack, MAX_PDO_BYTES
        slots = self.mapping.slots()
        return (
            (pdo_mapping.make_unpack(slots), (pdo_mapping.total_bits(slots) + 7) // 8)
            if slots
            else None
        )

    def _take(self, frame: CanFrame) -> None:
        """Handle a frame at once."""
        data = frame[1]
        if (len(data) == self._length and not self._supervised) or self._passes(data):
            self._deliver(data)

    def _keep(self, frame: CanFrame) -> None:
        """Store a frame for the next SYNC."""
        data = frame[1]
        # Synchronous window (1007h): a frame that comes later than so long after SYNC is
        # dropped.
        if self._consumer.window_is_over:
            return
        if (len(data) == self._length and not self._supervised) or self._passes(data):
            self._pending = data

    def _deliver(self, data: bytes) -> None:
        self._unpack(data)
        for notify in self._consumer.on_rpdo:
            notify(self.number)

    def _passes(self, data: bytes) -> bool:
        """Check length and time; return whether the frame can be used."""
        # Too short: not used (8210h). Too long: used, and the bytes behind ignored (8220h).
        if len(data) < self._length:
            self._break(EmcyCode.PDO_TOO_SHORT)
            return False
        if len(data) > self._length:
            self._break(EmcyCode.PDO_TOO_LONG)
        else:
            self._mend(EmcyCode.PDO_TOO_SHORT, EmcyCode.PDO_TOO_LONG)
        self._mend(EmcyCode.RPDO_TIMEOUT)
        if self._event_us:
            self.deadline_us = self._consumer.node.now_us + self._event_us
            self._consumer.await_deadline(self.deadline_us)
        return True

    def _break(self, code: int) -> None:
        self._supervised = True
        if code not in self._errors:
            self._errors.add(code)
            self._consumer.node.emergency(code, ErrorRegister.COMMUNICATION, self._text)

    def _mend(self, *codes: int) -> None:
        for code in codes:
            if code in self._errors:
                self._errors.remove(code)
                self._consumer.node.emergency_clear(code, self._text)
        self._supervised = bool(self._errors or self._event_us)

    def _changed(self, entry: Entry) -> None:
        if entry.sub == EVENT_TIMER:
            self.deadline_us = NEVER
        self._consumer.changed()


# PDO consumer: all RPDOs of a slave (CiA 301, PDO).

_SYNCHRONOUS_WINDOW_LENGTH: Final = 0x1007


class PdoConsumer(Service):
    """Receives the RPDOs of a slave in Operational, and writes their data to the mapped objects.

    Synchronous RPDOs are kept until the next SYNC. On SYNC they are written to their objects in the
    order of their numbers, before the synchronous TPDOs of the same SYNC are made. An RPDO belongs
    to a SYNC if it was before the SYNC on the bus, even if both arrive in the same tick.

    Attributes:
        rpdos: RPDOs that the dictionary has.
        on_rpdo: functions that are called with the number of an RPDO when its objects have been
            written.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self.on_rpdo: list[Callable[[int], None]] = []
        self.rpdos = [
            Rpdo(self, index - _RPDO_PARAMETERS[0] + 1)
            for index in node.dictionary.within(_RPDO_PARAMETERS)
        ]
        self._synchronous: tuple[Rpdo, ...] = ()
        self._window_us, self._window_end_us, self._due_us = 0, NEVER, NEVER
        window = node.dictionary.find(_SYNCHRONOUS_WINDOW_LENGTH)
        if window is not None:
            self._window_changed(window)
            window.watch(self._window_changed)
        if self.rpdos or window is not None:  # avoids a call for each SYNC
            node.sync_handlers.append(self._sync)

    @property
    def window_is_over(self) -> bool:
        """Whether the synchronous window of the last SYNC has passed (1007h)."""
        return self.node.now_us > self._window_end_us

    def start(self) -> None:
        """Clear errors and the time of the last SYNC."""
        self._window_end_us = self._due_us = NEVER
        for rpdo in self.rpdos:
            rpdo.restart()

    def handlers(self, state: NmtState) -> Iterator[tuple[int, Handler]]:
        """Listen to the RPDOs that exist."""
        if state is not NmtState.OPERATIONAL:
            return
        # `listen` also prepares the mapping: rewiring is what makes a new mapping count.
        listening = [(rpdo, rpdo.listen()) for rpdo in self.rpdos]
        self._synchronous = tuple(
            rpdo for rpdo, handler in listening if handler is not None and rpdo.synchronous
        )
        for rpdo, handler in listening:
            if handler is not None:
                yield rpdo.parameters.can_id, handler

    def reconfigured_by(self, state: NmtState) -> Iterator[int]:
        """Yield the CAN-IDs of RPDOs that may write communication objects, and of the SYNC."""
        if state is not NmtState.OPERATIONAL:
            return
        rpdos = [rpdo for rpdo in self.rpdos if rpdo.parameters.valid and rpdo.reconfigures]
        yield from (rpdo.parameters.can_id for rpdo in rpdos)
        # SYNC hands over what synchronous RPDOs hold, so it can reconfigure what they can.
        sync = self.node.dictionary.find(COB_ID_SYNC)
        if sync is not None and any(rpdo.synchronous for rpdo in rpdos):
            yield sync.number & CAN_ID_MASK

    def state_changed(self, old: NmtState, new: NmtState) -> None:
        """Drop received data when the node leaves Operational."""
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
        """Schedule a deadline, unless an earlier one is scheduled."""
        if due_us < self._due_us:
            self._due_us = due_us
            self.schedule(due_us)

    def changed(self) -> None:
        """Listen according to the changed communication parameters."""
        if self.node.state is NmtState.OPERATIONAL:
            self.node.rewire()

    def _sync(self, counter: int) -> None:
        for rpdo in self._synchronous:
            rpdo.sync()
        if self._window_us:
            self._window_end_us = self.node.now_us + self._window_us

    def _window_changed(self, window: Entry) -> None:
        """Restart the synchronous window at each SYNC."""
        self._window_us = window.number
