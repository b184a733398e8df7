"""The error counters of all nodes of a bus."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from tickrig.emulators.can.error_counters import ErrorCounters
from tickrig.wire.can_error import ErrorState

if TYPE_CHECKING:
    from tickrig.emulators.can.end import CanEnd


class FaultConfinement:
    """Counts what went well and what failed; a good frame costs nothing on a sound bus.

    Args:
        ends: all ends of the bus.
        changed: told the time and the end whenever an error state changes.

    Attributes:
        marked: ends with a counter that is not 0.
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
        """Count an error frame that all nodes saw."""
        self.failed_to_send(at_us, senders)
        for end in self._ends:
            if end not in senders:
                self.count(at_us, end, ErrorCounters.receive_failed)

    def failed_to_send(self, at_us: int, senders: Iterable[CanEnd]) -> None:
        """Count an error that only its senders saw."""
        for end in senders:
            self.count(at_us, end, ErrorCounters.transmit_failed)

    def unheard(self, at_us: int, senders: list[CanEnd]) -> None:
        """Count a frame that nobody acknowledged."""
        for end in senders:
            self.count(at_us, end, ErrorCounters.not_acknowledged)

    def count(self, at_us: int, end: CanEnd, event: Callable[[ErrorCounters], None]) -> None:
        """Let something happen to one node's counters, and tell if its state changed."""
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
        """Take an end up that comes from elsewhere, with its counters."""
        if not end.controller.clean:
            self.marked.append(end)

    def leave(self, end: CanEnd) -> None:
        """Forget an end that is no longer on the bus."""
        if end in self.marked:
            self.marked.remove(end)
