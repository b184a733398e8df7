"""Error behaviour (CiA 301, object dictionary; object 1029h)."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

from tickrig._compiled import mypyc_attr
from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.core.service import ALIVE, Service
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.canopen.sdo.abort import AbortCode

ERROR_BEHAVIOUR: Final = 0x1029
COMMUNICATION_ERROR: Final = 1
OUTPUT_ERROR: Final = 2
INPUT_ERROR: Final = 3
"""Sub-indices; output and input errors are those of CiA 401."""


class Behaviour(IntEnum):
    """NMT state after an error."""

    PRE_OPERATIONAL = 0  # only from Operational
    NO_CHANGE = 1
    STOPPED = 2


@mypyc_attr(allow_interpreted_subclasses=True)
class ErrorBehaviour(Service):
    """Changes the NMT state on a communication error, or on an error of the device.

    Without its sub-index of 1029h a communication error is as with 0, another
    error changes nothing. It acts after the EMCY producer, so that the EMCY is sent
    before the slave is Stopped. Values that mean nothing are refused with 0609 0030h.

    Not emulated: sub-indices of other profiles and of manufacturers; an application
    may write to `node.enter` what it wants.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self._behaviours: dict[int, Entry] = {}
        self._errors: list[int] = []
        for error in (COMMUNICATION_ERROR, OUTPUT_ERROR, INPUT_ERROR):
            entry = node.dictionary.find(ERROR_BEHAVIOUR, error)
            if entry is not None:
                entry.guard = _known
                self._behaviours[error] = entry

    def start(self) -> None:
        """Know of no error."""
        self._errors.clear()

    def communication_error(self) -> None:
        """Act in this tick."""
        self.act(COMMUNICATION_ERROR)

    def act(self, error: int) -> None:
        """Act in this tick on an error, given by its sub-index."""
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
        communication = error == COMMUNICATION_ERROR
        return Behaviour.PRE_OPERATIONAL if communication else Behaviour.NO_CHANGE

    def _change(self, behaviour: int) -> None:
        node = self.node
        if behaviour == Behaviour.PRE_OPERATIONAL and node.state is NmtState.OPERATIONAL:
            node.enter(NmtState.PRE_OPERATIONAL)
        elif behaviour == Behaviour.STOPPED and node.state in ALIVE:
            node.enter(NmtState.STOPPED)


def _known(entry: Entry, value: Value) -> None:
    if value not in tuple(Behaviour):
        raise SdoAbort(AbortCode.VALUE_RANGE)
