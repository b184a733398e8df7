"""PDO communication parameter, 1400h.. and 1800h.. (CiA 301, PDO communication parameter)."""

from __future__ import annotations

from typing import Final

from tickrig.device.canopen.core.abort import SdoAbort, whole_number
from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.entry import Entry, OnEntry
from tickrig.device.twin import Part
from tickrig.wire.canopen.cob_id import CAN_ID_MASK, EXTENDED, FLAG_30, INVALID, is_restricted
from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.canopen.sdo.abort import AbortCode

SYNCHRONOUS: Final = range(241)
"""Transmission types 0 to 240."""

RTR_SYNCHRONOUS: Final = 252
RTR_EVENT: Final = 253
EVENT_DRIVEN: Final = range(254, 256)

RPDO_TYPES: Final = frozenset((*SYNCHRONOUS, *EVENT_DRIVEN))
TPDO_TYPES: Final = frozenset((*SYNCHRONOUS, RTR_SYNCHRONOUS, RTR_EVENT, *EVENT_DRIVEN))
"""All others are reserved (CiA 301, transmission type)."""

COB_ID, TYPE, INHIBIT_TIME, RESERVED, EVENT_TIMER, SYNC_START = range(1, 7)
"""Sub-indices. The reserved one (CiA 301, 7.5.2.37) is there only where an EDS describes it."""

MAX_SYNC_START: Final = 240
_NOT_IN_A_CAN_ID: Final = EXTENDED | 0x1FFF_F800


class PdoParameters(Part):
    """When and under which CAN-ID a PDO goes over the bus.

    The CAN-ID, the inhibit time and the SYNC start value change only while the
    PDO is invalid, transmission type and event timer at any time. Bit 30 may
    change while it is valid. What a write breaks is answered with 0609 0030h.

    Not emulated: PDOs with a 29-bit CAN-ID; bit 29 is refused.

    Args:
        dictionary: with or without these objects.
        index: of the communication parameter.
        types: transmission types that such a PDO may have.
        changed: called with each entry that has another value now.
    """

    def __init__(
        self,
        dictionary: Dictionary,
        index: int,
        types: frozenset[int],
        changed: OnEntry,
    ) -> None:
        self._types = types
        self._entries: dict[int, Entry] = {}
        check = self._check
        for entry in dictionary.object(index):
            if COB_ID <= entry.sub <= SYNC_START:
                self._entries[entry.sub] = entry
                entry.guard = check
                entry.watch(changed)

    @property
    def valid(self) -> bool:
        """Whether the PDO exists, with a CAN-ID that it may have."""
        cob_id = self._number(COB_ID, INVALID)
        return not cob_id & (INVALID | _NOT_IN_A_CAN_ID) and not is_restricted(cob_id & CAN_ID_MASK)

    @property
    def can_id(self) -> int:
        """The CAN-ID."""
        return self._number(COB_ID) & CAN_ID_MASK

    @property
    def answers_rtr(self) -> bool:
        """Whether a remote frame fetches the TPDO: bit 30 is 0."""
        return not self._number(COB_ID) & FLAG_30

    @property
    def transmission_type(self) -> int:
        """The transmission type; a PDO without one is event-driven."""
        return self._number(TYPE, EVENT_DRIVEN[-1])

    @property
    def inhibit_us(self) -> int:
        """Least time between two event-driven TPDOs."""
        return self._number(INHIBIT_TIME) * 100

    @property
    def event_us(self) -> int:
        """Event timer of a TPDO, deadline of an RPDO; 0 for none."""
        return self._number(EVENT_TIMER) * 1_000

    @property
    def sync_start(self) -> int:
        """SYNC start value, 0 for none."""
        return self._number(SYNC_START)

    def _number(self, sub: int, otherwise: int = 0) -> int:
        entry = self._entries.get(sub)
        return otherwise if entry is None else entry.number

    def _check(self, entry: Entry, value: Value) -> None:
        match entry.sub:
            case 1:  # COB-ID
                self._check_cob_id(whole_number(value))
            case 2 if value not in self._types:
                raise SdoAbort(AbortCode.VALUE_RANGE)
            case 3 | 6 if self.valid:  # inhibit time, SYNC start value
                raise SdoAbort(AbortCode.VALUE_RANGE)
            case 6 if whole_number(value) > MAX_SYNC_START:
                raise SdoAbort(AbortCode.VALUE_RANGE)
            case _:
                return

    def _check_cob_id(self, cob_id: int) -> None:
        if cob_id & _NOT_IN_A_CAN_ID:
            raise SdoAbort(AbortCode.VALUE_RANGE)
        if cob_id & INVALID:
            return
        can_id = cob_id & CAN_ID_MASK
        if is_restricted(can_id) or (self.valid and can_id != self.can_id):
            raise SdoAbort(AbortCode.VALUE_RANGE)
