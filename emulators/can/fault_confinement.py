"""Fault confinement: the error counters of all nodes, and their return from bus-off."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Final

from tickrig.device.twin import Part
from tickrig.wire.can import ErrorState
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.emulators.can.end import CanEnd

_PASSIVE_LIMIT: Final = 128
_BUS_OFF_LIMIT: Final = 256
_TRANSMIT_ERROR: Final = 8
_BACK_FROM_PASSIVE: Final = 119
"""REC after a good frame in a passive receiver; the standard allows 119 to 127."""


class ErrorCounters(Part):
    """The two error counters of one node (ISO 11898-1, fault confinement).

    Two rules of the standard are not emulated. First, the receive error counter grows by 8 if a
    receiver sees a dominant bit directly after its own error flag. Second, a node gives a warning
    if one of its counters reaches 96.

    Attributes:
        tec: transmit error counter.
        rec: receive error counter.
        state: error-active, error-passive or bus-off.
    """

    __slots__ = ("rec", "state", "tec")

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Become error-active with both counters at 0, at power-on or after bus-off."""
        self.tec = self.rec = 0
        self.state = ErrorState.ACTIVE

    @property
    def clean(self) -> bool:
        """Whether a good frame leaves the counters unchanged."""
        return not (self.tec or self.rec)

    def transmitted(self) -> None:
        """Count a successful transmission."""
        if self.tec:
            self.tec -= 1
            self._note()

    def received(self) -> None:
        """Count a successful reception."""
        if self.rec:
            self.rec = (
                min(self.rec - 1, _BACK_FROM_PASSIVE) if self._receiver_passive else self.rec - 1
            )
            self._note()

    def transmit_failed(self) -> None:
        """Count an error while transmitting."""
        self.tec += _TRANSMIT_ERROR
        self._note()

    def go_off(self) -> None:
        """Become bus-off at once."""
        self.tec = _BUS_OFF_LIMIT
        self._note()

    def receive_failed(self) -> None:
        """Count an error while receiving; the counter of a passive receiver is unchanged."""
        if not self._receiver_passive:
            self.rec += 1
            self._note()

    def not_acknowledged(self) -> None:
        """Count an unacknowledged frame, which never leads to bus-off (exception A)."""
        if self.state is ErrorState.ACTIVE:
            self.transmit_failed()

    @property
    def _receiver_passive(self) -> bool:
        return self.rec >= _PASSIVE_LIMIT

    def _note(self) -> None:
        if self.tec >= _BUS_OFF_LIMIT:
            self.state = ErrorState.BUS_OFF
        elif self.tec >= _PASSIVE_LIMIT or self._receiver_passive:
            self.state = ErrorState.PASSIVE
        else:
            self.state = ErrorState.ACTIVE


class FaultConfinement(Part):
    """Updates the error counters and error states of all nodes of a bus.

    Args:
        ends: the connections of all nodes to the bus.
        changed: function that is called whenever the error state of a node changes. Its arguments
            are the time and the connection of the node.

    Attributes:
        marked: connections of the nodes with an error counter that is not 0. While there are none,
            the bus need not count frames without errors.
    """

    def __init__(self, ends: list[CanEnd], changed: Callable[[int, CanEnd], None]) -> None:
        self._ends, self._changed = ends, changed
        self.marked: list[CanEnd] = []

    def sent(self, at_us: int, senders: list[CanEnd]) -> None:
        """Count a good frame."""
        marked, self.marked = self.marked, []
        for end in marked:
            good = ErrorCounters.transmitted if end in senders else ErrorCounters.received
            self.count(at_us, end, good)

    def failed(self, at_us: int, senders: list[CanEnd]) -> None:
        """Count an error frame that all nodes have received."""
        self.failed_to_send(at_us, senders)
        for end in self._ends:
            if end not in senders:
                self.count(at_us, end, ErrorCounters.receive_failed)

    def failed_to_send(self, at_us: int, senders: Iterable[CanEnd]) -> None:
        """Count an error that only the senders have detected."""
        for end in senders:
            self.count(at_us, end, ErrorCounters.transmit_failed)

    def unheard(self, at_us: int, senders: list[CanEnd]) -> None:
        """Count an unacknowledged frame."""
        for end in senders:
            self.count(at_us, end, ErrorCounters.not_acknowledged)

    def count(self, at_us: int, end: CanEnd, event: Callable[[ErrorCounters], None]) -> None:
        """Update the error counters of one node, and report its error state if it has changed.

        A node in bus-off counts nothing until it is restarted.

        Args:
            at_us: time of the event.
            end: connection of the node to the bus.
            event: method of `ErrorCounters` that counts the event.
        """
        controller = end.controller
        state = controller.state
        if state is ErrorState.BUS_OFF and event is not ErrorCounters.restart:
            return
        event(controller)
        if not controller.clean and end not in self.marked:
            self.marked.append(end)
        if controller.state is not state:
            self._changed(at_us, end)

    def join(self, end: CanEnd) -> None:
        """Add an end from another segment, with its counters."""
        if not end.controller.clean:
            self.marked.append(end)

    def leave(self, end: CanEnd) -> None:
        """Remove an end that is no longer on the bus."""
        if end in self.marked:
            self.marked.remove(end)


_SEQUENCES: Final = 128
_SEQUENCE_BITS: Final = 11
"""A node returns after 128 times 11 recessive bits in a row (ISO 11898-1, bus-off recovery)."""


class Recovery(Part):
    """Recovery from bus-off: counts sequences of 11 recessive bits for each node that waits.

    Args:
        bit: length of a bit. All times in this class are in the same unit.

    Attributes:
        active: whether any node waits.
    """

    def __init__(self, bit: int) -> None:
        self._sequence = _SEQUENCE_BITS * bit
        self._waiting: dict[int, tuple[CanEnd, int, int]] = {}  # end, sequences left, since
        self.active = False

    def begin(self, end: CanEnd, now: int) -> None:
        """Let a node in bus-off wait until it may send again.

        If the node waits already, nothing happens.
        """
        self._waiting.setdefault(end.number, (end, _SEQUENCES, now))
        self.active = True

    def leave(self, end: CanEnd) -> None:
        """Cancel the wait of a node."""
        self._waiting.pop(end.number, None)
        self.active = bool(self._waiting)

    @property
    def due(self) -> int:
        """Time at which the first node will return if the bus stays recessive."""
        return min(
            (since + left * self._sequence for _, left, since in self._waiting.values()),
            default=NEVER,
        )

    def interrupt(self, at: int, until: int) -> None:
        """Interrupt the counting, because a frame starts on the bus.

        For each waiting node, the sequences of 11 recessive bits before the frame are counted.

        Args:
            at: time of the first dominant bit of the frame.
            until: time at which the bus is recessive again. From this time on, further sequences
                are counted.
        """
        for number, (end, left, since) in self._waiting.items():
            seen = max(0, at - since) // self._sequence
            self._waiting[number] = (end, left - seen, max(since, until))

    def take(self, now: int) -> list[CanEnd]:
        """Return the nodes that have returned by `now`."""
        back = [
            end
            for end, left, since in self._waiting.values()
            if since + left * self._sequence <= now
        ]
        for end in back:
            self.leave(end)
        return back
