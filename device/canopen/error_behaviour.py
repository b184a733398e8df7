"""Error behaviour (CiA 301, object dictionary; object 1029h)."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

from tickrig.device.canopen.abort import SdoAbort
from tickrig.device.canopen.service import ALIVE, Service
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.wire.canopen.abort import AbortCode
from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.canopen.nmt import NmtState

ERROR_BEHAVIOUR: Final = 0x1029
COMMUNICATION_ERROR: Final = 1
"""Sub-index for communication errors; the others belong to device profile and manufacturer."""


class Behaviour(IntEnum):
    """NMT state after an error."""

    PRE_OPERATIONAL = 0  # only from Operational
    NO_CHANGE = 1
    STOPPED = 2


class ErrorBehaviour(Service):
    """Changes the NMT state on a communication error.

    Without 1029h it is as with 0. It acts after the EMCY producer, so that the
    EMCY is sent before the slave is Stopped. Values that mean nothing are
    refused with 0609 0030h.

    Not emulated: errors of device profile and manufacturer, sub-index 2 and above;
    an application may write to `node.enter` what it wants.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self._behaviour = node.dictionary.find(ERROR_BEHAVIOUR, COMMUNICATION_ERROR)
        if self._behaviour is not None:
            self._behaviour.guard = _known

    def communication_error(self) -> None:
        """Act in this tick."""
        self.schedule(self.node.now_us)

    def tick(self, now_us: int) -> None:
        """Change the NMT state."""
        node = self.node
        value = self._behaviour.number if self._behaviour is not None else 0
        if value == Behaviour.PRE_OPERATIONAL and node.state is NmtState.OPERATIONAL:
            node.enter(NmtState.PRE_OPERATIONAL)
        elif value == Behaviour.STOPPED and node.state in ALIVE:
            node.enter(NmtState.STOPPED)


def _known(value: Value) -> None:
    if value not in tuple(Behaviour):
        raise SdoAbort(AbortCode.VALUE_RANGE)
