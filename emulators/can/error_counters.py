"""Fault confinement of a CAN controller: TEC, REC and the three error states."""

from __future__ import annotations

from typing import Final

from tickrig.wire.can_error import ErrorState

PASSIVE_LIMIT: Final = 128
BUS_OFF_LIMIT: Final = 256
TRANSMIT_ERROR: Final = 8
BACK_FROM_PASSIVE: Final = 119
"""REC after a good frame in a passive receiver; 119 to 127 is allowed."""


class ErrorCounters:
    """The two error counters of one node (ISO 11898-1, fault confinement).

    Not emulated: the receiver's further 8 for a dominant bit after its error
    flag, and the warning limit of 96, which is no state.

    Attributes:
        tec: transmit error counter.
        rec: receive error counter.
        state: error-active, error-passive or bus-off.
    """

    __slots__ = ("rec", "state", "tec")

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Become error-active with both counters at 0: power-on, or after bus-off."""
        self.tec = self.rec = 0
        self.state = ErrorState.ACTIVE

    @property
    def clean(self) -> bool:
        """Whether a good frame would change nothing."""
        return not (self.tec or self.rec)

    def transmitted(self) -> None:
        """Count a frame that went well."""
        if self.tec:
            self.tec -= 1
            self._note()

    def received(self) -> None:
        """Count a frame that came well."""
        if self.rec:
            self.rec = (
                min(self.rec - 1, BACK_FROM_PASSIVE) if self._receiver_passive else self.rec - 1
            )
            self._note()

    def transmit_failed(self) -> None:
        """Count an error while transmitting."""
        self.tec += TRANSMIT_ERROR
        self._note()

    def receive_failed(self) -> None:
        """Count an error while receiving; a passive receiver's counter stays where it is."""
        if not self._receiver_passive:
            self.rec += 1
            self._note()

    def not_acknowledged(self) -> None:
        """Count a frame that nobody acknowledged; it makes nobody bus-off (exception A)."""
        if self.state is ErrorState.ACTIVE:
            self.transmit_failed()

    @property
    def _receiver_passive(self) -> bool:
        return self.rec >= PASSIVE_LIMIT

    def _note(self) -> None:
        if self.tec >= BUS_OFF_LIMIT:
            self.state = ErrorState.BUS_OFF
        elif self.tec >= PASSIVE_LIMIT or self._receiver_passive:
            self.state = ErrorState.PASSIVE
        else:
            self.state = ErrorState.ACTIVE
