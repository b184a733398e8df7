"""One receive PDO (CiA 301, PDO; 1400h.. and 1600h..)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.core.service import Handler
from tickrig.device.canopen.core.slave import COMMUNICATION_AREA
from tickrig.device.canopen.pdo.mpdo import DamConsumer, SamConsumer
from tickrig.device.canopen.pdo.pdo_mapping import PdoMapping
from tickrig.device.canopen.pdo.pdo_packing import Unpack, make_unpack, total_bits
from tickrig.device.canopen.pdo.pdo_parameters import (
    EVENT_TIMER,
    RPDO_TYPES,
    SYNCHRONOUS,
    PdoParameters,
)
from tickrig.device.twin import Part
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.eds.object_table import Access
from tickrig.wire.canopen.emcy import EmcyCode, ErrorRegister
from tickrig.wire.canopen.pdo import DAM_MPDO, MAX_PDO_BYTES, SAM_MPDO
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.device.canopen.pdo.pdo_consumer import PdoConsumer

RPDO_PARAMETERS: Final = range(0x1400, 0x1600)
RPDO_MAPPINGS: Final = 0x1600

_Target = tuple[Unpack, int]
"""What takes the bytes, and how many it needs."""


class Rpdo(Part):
    """Gives what it receives to the mapped objects, at once or with the next SYNC.

    A frame with too few bytes is not used: EMCY 8210h. One with too many is used
    up to the length of the mapping: EMCY 8220h. The next right one clears both.
    The event timer is its deadline, EMCY 8250h; it runs anew from each frame
    that can be used. These EMCYs carry the number of the RPDO. A synchronous one
    that comes after the synchronous window (1007h) is thrown away.

    Args:
        consumer: the service that it belongs to.
        number: 1..512.

    Attributes:
        deadline_us: when the next frame is late.
    """

    def __init__(self, consumer: PdoConsumer, number: int) -> None:
        self.number, self._consumer = number, consumer
        offset, dictionary = number - 1, consumer.node.dictionary
        self.parameters = PdoParameters(
            dictionary, RPDO_PARAMETERS[offset], RPDO_TYPES, self._changed
        )
        self.mapping = PdoMapping(dictionary, RPDO_MAPPINGS + offset, Access.RPDO, self.parameters)
        self._text = number.to_bytes(2, "little")
        self._unpack: Unpack
        self._pending: bytes | None
        self._length: int
        self._event_us: int
        self._supervised: bool

    @property
    def reconfigures(self) -> bool:
        """Whether it may write a communication object: an MPDO, or one is mapped."""
        entries = (slot.entry for slot in self.mapping.slots())
        return self.mapping.count in (DAM_MPDO, SAM_MPDO) or any(
            entry is not None and entry.index in COMMUNICATION_AREA for entry in entries
        )

    @property
    def synchronous(self) -> bool:
        """Whether it acts with SYNC."""
        return self.parameters.transmission_type in SYNCHRONOUS

    def listen(self) -> Handler | None:
        """Prepare to receive; return the handler of its frames, None if it does not exist."""
        target = self._target() if self.parameters.valid else None
        if target is None:
            self.stop()
            return None
        self._unpack, self._length = target
        self._event_us = self.parameters.event_us
        self._supervised = bool(self._errors or self._event_us)
        if self.synchronous:
            return self._keep
        self._pending = None
        return self._take

    def restart(self) -> None:
        """Know of no error and no frame."""
        self._errors: set[int] = set()
        self._dam: DamConsumer | None = None
        self.stop()

    def stop(self) -> None:
        """Forget what waits for SYNC, and the deadline."""
        self._pending, self.deadline_us = None, NEVER

    def sync(self) -> None:
        """Give the objects what has come since the last SYNC; the newest frame counts."""
        data, self._pending = self._pending, None
        if data is not None:
            self._deliver(data)

    def expire(self) -> None:
        """Report that its deadline has passed."""
        self.deadline_us = NEVER
        self._break(EmcyCode.RPDO_TIMEOUT)

    def _target(self) -> _Target | None:
        count = self.mapping.count
        if count == DAM_MPDO:
            self._dam = self._dam or DamConsumer(self._consumer.node)
            return self._dam.unpack, MAX_PDO_BYTES
        if count == SAM_MPDO:
            return SamConsumer(self._consumer.node.dictionary).unpack, MAX_PDO_BYTES
        slots = self.mapping.slots()
        return (make_unpack(slots), (total_bits(slots) + 7) // 8) if slots else None

    def _take(self, frame: CanFrame) -> None:
        """Use a frame at once."""
        data = frame[1]
        if (len(data) == self._length and not self._supervised) or self._passes(data):
            self._deliver(data)

    def _keep(self, frame: CanFrame) -> None:
        """Keep a frame for the next SYNC."""
        data = frame[1]
        if self._consumer.window_is_over:
            return
        if (len(data) == self._length and not self._supervised) or self._passes(data):
            self._pending = data

    def _deliver(self, data: bytes) -> None:
        self._unpack(data)
        for notify in self._consumer.on_rpdo:
            notify(self.number)

    def _passes(self, data: bytes) -> bool:
        """Judge length and time. Returns: whether the frame can be used."""
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
