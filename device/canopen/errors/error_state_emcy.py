"""What a slave does about its CAN controller's fault confinement (CiA 301, emergency object)."""

from __future__ import annotations

from tickrig.device.canopen.core.service import Service
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.wire.can_error import ErrorState
from tickrig.wire.canopen.emcy import EmcyCode, ErrorRegister


class ErrorStateEmcy(Service):
    """Reports error-passive (8120h) and that bus-off is over (8140h).

    8120h is cleared when the controller is error-active again. Bus-off is a
    communication error (1029h). 8140h is sent when it is over, and cleared at once:
    nothing is wrong then.

    Not emulated: when and whether a controller recovers is its own business.

    Attributes:
        state: what the controller reported last.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self.state = ErrorState.ACTIVE

    def power_on(self) -> None:
        """Begin error-active."""
        self.state = ErrorState.ACTIVE

    def booted(self) -> None:
        """Report anew, after the boot-up message, what is still so."""
        if self.state is ErrorState.PASSIVE:
            self.schedule(self.node.now_us + 1)

    def tick(self, now_us: int) -> None:
        """Report error-passive."""
        self._report_passive()

    def bus_state(self, state: ErrorState) -> None:
        """Report a change."""
        node, old, self.state = self.node, self.state, state
        if old is state:
            return
        if state is ErrorState.BUS_OFF:
            node.communication_error()
            return
        if old is ErrorState.BUS_OFF:
            node.emergency(EmcyCode.BUS_OFF_RECOVERED, ErrorRegister.COMMUNICATION)
            node.emergency_clear(EmcyCode.BUS_OFF_RECOVERED)
        if state is ErrorState.PASSIVE:
            self._report_passive()
        else:
            node.emergency_clear(EmcyCode.CAN_PASSIVE)

    def _report_passive(self) -> None:
        self.node.emergency(EmcyCode.CAN_PASSIVE, ErrorRegister.COMMUNICATION)
