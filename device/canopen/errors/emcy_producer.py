"""EMCY producer with error register and error history (CiA 301, emergency object)."""

from __future__ import annotations

from typing import Final

from tickrig._compiled import mypyc_attr
from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.device.canopen.core.cob_id_rules import check_emcy_cob_id, is_valid
from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.core.service import ALIVE, Service
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.twin import Part
from tickrig.wire.can_error import ErrorState
from tickrig.wire.canopen.cob_id import CAN_ID_MASK
from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.canopen.emcy import TEXT_BYTES, Emcy, EmcyCode, ErrorRegister
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.canopen.sdo.abort import AbortCode

ERROR_REGISTER: Final = 0x1001
PRE_DEFINED_ERROR_FIELD: Final = 0x1003
COB_ID_EMCY: Final = 0x1014
INHIBIT_TIME_EMCY: Final = 0x1015

QUEUE_LENGTH: Final = 16
"""EMCY messages that wait; more are lost, as in a real device."""


@mypyc_attr(allow_interpreted_subclasses=True)
class EmcyProducer(Service):
    """Reports errors, once when they occur and once when they are gone (0000h).

    An error is known by its code and its text. 1001h is the sum of the errors
    that are there, with the generic bit as long as there is one. Each error that
    goes is reported, with the register that is left. In Stopped and in bus-off the
    messages wait; they are sent afterwards. A reset forgets errors and messages:
    who still sees the cause has to raise it again.

    Not emulated: 29-bit CAN-IDs.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        find = node.dictionary.find
        self._register, self._cob_id = find(ERROR_REGISTER), find(COB_ID_EMCY)
        self._inhibit = find(INHIBIT_TIME_EMCY)
        self._history = ErrorHistory(node.dictionary)
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
        """Take the bus for sound."""
        self._bus_off = False

    def start(self) -> None:
        """Know of no error."""
        self._active.clear()
        self._queue.clear()
        self._free_us = 0

    def emergency(self, code: int, register: int, text: bytes) -> None:
        """Note and report an error that was not there."""
        key = code & 0xFFFF, _padded(text)
        if key not in self._active:
            self._active[key] = register
            self._history.note(*key)
            self._queue_message(*key)

    def emergency_clear(self, code: int, text: bytes | None) -> None:
        """Report that an error is gone, if it was there."""
        gone = [
            key
            for key in self._active
            if key[0] == code and (text is None or key[1] == _padded(text))
        ]
        for key in gone:
            del self._active[key]
            self._queue_message(EmcyCode.NO_ERROR, key[1])

    def state_changed(self, old: NmtState, new: NmtState) -> None:
        """Send what had to wait in Stopped."""
        if self._queue:
            self.schedule(self._free_us)

    def bus_state(self, state: ErrorState) -> None:
        """Wait in bus-off; send afterwards."""
        self._bus_off = state is ErrorState.BUS_OFF
        if self._queue:
            self.schedule(self._free_us)

    def tick(self, now_us: int) -> None:
        """Send what the inhibit time lets pass."""
        cob_id = self._cob_id
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
        if len(self._queue) < QUEUE_LENGTH:
            self._queue.append(Emcy(code, register, text).encode())
        self.schedule(self._free_us)


class ErrorHistory(Part):
    """Keeps the latest errors, the newest at sub-index 1.

    Sub-index 0 counts them; 0 written to it forgets them all, other values are
    refused with 0609 0030h. A sub-index without an error is answered with
    0800 0024h. A field is the error code with the first two manufacturer-specific
    bytes above it. That an error is gone is not noted.

    Args:
        dictionary: with or without 1003h.
    """

    def __init__(self, dictionary: Dictionary) -> None:
        self._count = dictionary.find(PRE_DEFINED_ERROR_FIELD)
        self._fields = dictionary.elements(PRE_DEFINED_ERROR_FIELD)
        if self._count is not None:
            self._count.guard = _only_zero
            for field in self._fields:
                field.source = self._read

    def note(self, code: int, text: bytes) -> None:
        """Put an error at the top; the oldest one falls out when all fields are full."""
        if self._count is None or not self._fields:
            return
        count = min(self._count.number + 1, len(self._fields))
        for sub in reversed(range(1, count)):
            self._fields[sub].assign(self._fields[sub - 1].data)
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
