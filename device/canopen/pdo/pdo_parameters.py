"""Communication parameters of PDOs, and the transmission types of TPDOs."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, ClassVar, Final

from tickrig.device.canopen.dictionary import Dictionary, Entry, OnEntry, SdoAbort, whole_number
from tickrig.device.twin import Part
from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.canopen.nmt import CAN_ID_MASK, EXTENDED, FLAG_30, INVALID, is_restricted
from tickrig.wire.canopen.sdo_frame import AbortCode
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.device.canopen.pdo.tpdo import Tpdo

# PDO communication parameter, 1400h.. and 1800h.. (CiA 301, PDO communication parameter).

SYNCHRONOUS: Final = range(241)
"""Transmission types 0 to 240."""

RTR_SYNCHRONOUS: Final = 252
RTR_EVENT: Final = 253
EVENT_DRIVEN: Final = range(254, 256)

RPDO_TYPES: Final = frozenset((*SYNCHRONOUS, *EVENT_DRIVEN))
TPDO_TYPES: Final = frozenset((*SYNCHRONOUS, RTR_SYNCHRONOUS, RTR_EVENT, *EVENT_DRIVEN))
"""Transmission types of TPDOs; all other types are reserved (CiA 301, transmission type)."""

COB_ID, TYPE, INHIBIT_TIME, RESERVED, EVENT_TIMER, SYNC_START = range(1, 7)
"""Sub-indices. The reserved sub-index (CiA 301, 7.5.2.37) exists only if an EDS describes it."""

_MAX_SYNC_START: Final = 240
_NOT_IN_A_CAN_ID: Final = EXTENDED | 0x1FFF_F800


class PdoParameters(Part):
    """The communication parameters of a PDO: CAN-ID, transmission type and timing.

    The CAN-ID, the inhibit time and the SYNC start value can be changed only while the PDO is
    invalid. The transmission type, the event timer and bit 30 of the COB-ID can always be changed.
    A write that breaks these rules is refused with 0609 0030h.

    PDOs with a 29-bit CAN-ID are not emulated, so bit 29 of the COB-ID is refused.

    Args:
        dictionary: dictionary of the slave, in which the objects of the PDO may be missing.
        index: index of the communication parameter.
        types: allowed transmission types.
        changed: function that is called with each entry whose value has changed.
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
        """Whether the PDO exists and has an allowed CAN-ID."""
        cob_id = self._number(COB_ID, INVALID)
        # The default in an EDS may be a value that a write could not set. A PDO with such a
        # default does not exist.
        return not cob_id & (INVALID | _NOT_IN_A_CAN_ID) and not is_restricted(cob_id & CAN_ID_MASK)

    @property
    def can_id(self) -> int:
        """The CAN-ID."""
        return self._number(COB_ID) & CAN_ID_MASK

    @property
    def answers_rtr(self) -> bool:
        """Whether the TPDO can be requested by a remote frame: bit 30 is 0."""
        return not self._number(COB_ID) & FLAG_30

    @property
    def transmission_type(self) -> int:
        """The transmission type; a PDO without a transmission type is event-driven."""
        return self._number(TYPE, EVENT_DRIVEN[-1])

    @property
    def inhibit_us(self) -> int:
        """Minimum time between two event-driven TPDOs."""
        return self._number(INHIBIT_TIME) * 100

    @property
    def event_us(self) -> int:
        """Event timer of a TPDO, or deadline of an RPDO; 0 means none."""
        return self._number(EVENT_TIMER) * 1_000

    @property
    def sync_start(self) -> int:
        """SYNC start value; 0 means none."""
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
            case 6 if whole_number(value) > _MAX_SYNC_START:
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


# Behaviour of the transmission types of TPDOs (CiA 301, transmission type).


class TpdoMode(Part):
    """Decides when a TPDO is sent. There is a subclass for each group of transmission types.

    The base class sends the TPDO only in answer to a remote frame.

    Attributes:
        due_us: time at which `run` must be called.
        synchronous: whether the mode reacts to SYNC.
        timed: whether the mode ever needs a call of `run`.
        on_change: whether a change of a mapped object is an event.
        on_sync: function that is called with the counter of each SYNC, or with 0 if the SYNC has no
            counter.
    """

    __slots__ = ("due_us", "on_sync", "sender")

    synchronous: ClassVar[bool] = False
    timed: ClassVar[bool] = False
    on_change: ClassVar[bool] = False

    def __init__(self, sender: Tpdo) -> None:
        self.sender, self.due_us = sender, NEVER
        self.on_sync: Callable[[int], None] = _ignore

    def request(self, entry: Entry | None = None) -> None:
        """Handle an event that may send the TPDO.

        Args:
            entry: mapped object that has changed, or None for an event that the application raised.
        """

    def run(self, now_us: int) -> None:
        """Do the work that is due."""

    def retime(self, now_us: int) -> None:
        """Apply a changed event timer."""

    def answer(self) -> None:
        """Answer a remote frame."""
        self.sender.send()


class Silent(TpdoMode):
    """A TPDO that does not exist or has no mapped objects."""

    def answer(self) -> None:
        """Send nothing."""


class SynchronousAcyclic(TpdoMode):
    """Transmission type 0: the TPDO is sent with a SYNC, but only after an event.

    The TPDO is also sent with the first SYNC after it has become active. A TPDO becomes active when
    the slave enters Operational or when one of its parameters, except the event timer, is changed.
    """

    synchronous: ClassVar[bool] = True
    on_change: ClassVar[bool] = True

    def __init__(self, sender: Tpdo) -> None:
        super().__init__(sender)
        self._marked = True
        self.on_sync = self._send_if_marked

    def request(self, entry: Entry | None = None) -> None:
        """Mark the TPDO to be sent with the next SYNC."""
        self._marked = True

    def _send_if_marked(self, counter: int) -> None:
        if self._marked:
            self._marked = False
            self.sender.send()


class SynchronousCyclic(TpdoMode):
    """Transmission types 1 to 240: the TPDO is sent with every n-th SYNC.

    The SYNCs are counted from the moment when the TPDO becomes active. If a SYNC start value is set
    and SYNC has a counter, the TPDO is sent first with the SYNC whose counter has that value, as in
    CANopenNode.
    """

    __slots__ = ("_left", "_period", "_start")

    synchronous: ClassVar[bool] = True

    def __init__(self, sender: Tpdo) -> None:
        super().__init__(sender)
        self._period = self._left = sender.parameters.transmission_type
        self._start = sender.parameters.sync_start
        self.on_sync = self._await_start if self._start else self._counting

    @property
    def _counting(self) -> Callable[[int], None]:
        return self._each if self._period == 1 else self._nth

    def _await_start(self, counter: int) -> None:
        if counter in (0, self._start):
            # The SYNC with the start value is the first transmission; without a counter the
            # n-th is.
            self._left = 1 if counter else self._period
            self.on_sync = self._counting
            self.on_sync(counter)

    def _each(self, counter: int) -> None:
        self.sender.send()

    def _nth(self, counter: int) -> None:
        self._left -= 1
        if not self._left:
            self._left = self._period
            self.sender.send()


class RtrSynchronous(TpdoMode):
    """Transmission type 252: a remote frame is answered with the data sampled at the latest SYNC.

    The data are also sampled once when the TPDO becomes active. Before the first SYNC, an answer
    contains these data.
    """

    synchronous: ClassVar[bool] = True

    def __init__(self, sender: Tpdo) -> None:
        super().__init__(sender)
        self._sample = sender.pack()
        self.on_sync = self._take

    def answer(self) -> None:
        """Send the sample."""
        self.sender.send(self._sample)

    def _take(self, counter: int) -> None:
        self._sample = self.sender.pack()


class EventDriven(TpdoMode):
    """Transmission types 254 and 255: the TPDO is sent on an event and by the event timer.

    The TPDO is also sent when it becomes active, for example when the node enters Operational.
    After a transmission the next one waits until the inhibit time has passed. The TPDO then
    contains the newest data.
    """

    timed: ClassVar[bool] = True
    on_change: ClassVar[bool] = True

    def __init__(self, sender: Tpdo) -> None:
        super().__init__(sender)
        self._inhibit_us = sender.parameters.inhibit_us
        self._marked, self._retimed, self._free_us, self.due_us = True, False, 0, 0

    def request(self, entry: Entry | None = None) -> None:
        """Schedule the TPDO for the end of the inhibit time."""
        if not self._marked:
            self._marked, self.due_us = True, self._free_us
            self.sender.wake(self.due_us)

    def run(self, now_us: int) -> None:
        """Send the TPDO if the inhibit time is over; otherwise wait for its end.

        If only the time of the event timer was changed, this method restarts the timer and sends no
        TPDO.
        """
        if self._retimed and not self._marked:
            self._time_anew(now_us)
        elif now_us < self._free_us:
            self._marked, self.due_us = True, self._free_us
        else:
            # Cleared before sending: an event that the transmission itself causes belongs to the
            # next one.
            self._marked, self._free_us = False, now_us + self._inhibit_us
            self._time_anew(now_us)
            self.sender.send()

    def retime(self, now_us: int) -> None:
        """Restart the event timer with the next run."""
        if not self._marked:
            self._retimed, self.due_us = True, now_us
            self.sender.wake(self.due_us)

    def _time_anew(self, now_us: int) -> None:
        """Start the event timer, which runs from each transmission."""
        event_us = self.sender.parameters.event_us
        self._retimed, self.due_us = False, now_us + event_us if event_us else NEVER


def _ignore(counter: int) -> None:
    """Do nothing on SYNC."""
