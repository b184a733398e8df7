"""What the transmission types of TPDOs do (CiA 301, transmission type)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.device.canopen.pdo.tpdo import Tpdo


class TpdoMode:
    """A TPDO that does nothing by itself; a remote frame fetches it.

    Attributes:
        due_us: when it wants to be run.
        synchronous: whether it wants to hear of SYNC.
        timed: whether it ever wants to be run.
        on_sync: called with the counter of each SYNC, 0 if it has none.
    """

    synchronous = timed = False

    def __init__(self, tpdo: Tpdo) -> None:
        self.tpdo, self.due_us = tpdo, NEVER
        self.on_sync: Callable[[int], None] = _ignore

    def request(self) -> None:
        """Hear of an event."""

    def run(self, now_us: int) -> None:
        """Do what is due."""

    def retime(self) -> None:
        """Follow another event timer."""

    def answer(self) -> None:
        """Send what a remote frame asks for."""
        self.tpdo.transmit()


class Silent(TpdoMode):
    """A TPDO that does not exist, or carries nothing."""

    def answer(self) -> None:
        """Send nothing."""


class SynchronousAcyclic(TpdoMode):
    """Type 0: sent with the SYNC after an event, and with the first one."""

    synchronous = True

    def __init__(self, tpdo: Tpdo) -> None:
        super().__init__(tpdo)
        self._marked = True
        self.on_sync = self._send_if_marked
        for entry in tpdo.entries:
            tpdo.watch(entry, self.request)

    def request(self) -> None:
        """Send with the next SYNC."""
        self._marked = True

    def _send_if_marked(self, counter: int) -> None:
        if self._marked:
            self._marked = False
            self.tpdo.transmit()


class SynchronousCyclic(TpdoMode):
    """Types 1 to 240: sent with each n-th SYNC, the n-th one is the first.

    With a SYNC start value, and if SYNC carries a counter, the first is the one
    whose counter has that value, as in CANopenNode.
    """

    synchronous = True

    def __init__(self, tpdo: Tpdo) -> None:
        super().__init__(tpdo)
        self._period = self._left = tpdo.parameters.transmission_type
        self._start = tpdo.parameters.sync_start
        self.on_sync = self._await_start if self._start else self._counting

    @property
    def _counting(self) -> Callable[[int], None]:
        return self._each if self._period == 1 else self._nth

    def _await_start(self, counter: int) -> None:
        if counter in (0, self._start):
            self._left = 1 if counter else self._period
            self.on_sync = self._counting
            self.on_sync(counter)

    def _each(self, counter: int) -> None:
        self.tpdo.transmit()

    def _nth(self, counter: int) -> None:
        self._left -= 1
        if not self._left:
            self._left = self._period
            self.tpdo.transmit()


class RtrSynchronous(TpdoMode):
    """Type 252: sampled with SYNC, and when it begins; sent on a remote frame."""

    synchronous = True

    def __init__(self, tpdo: Tpdo) -> None:
        super().__init__(tpdo)
        self._sample = tpdo.pack()
        self.on_sync = self._take

    def answer(self) -> None:
        """Send the sample."""
        self.tpdo.send(self._sample)

    def _take(self, counter: int) -> None:
        self._sample = self.tpdo.pack()


class EventDriven(TpdoMode):
    """Types 254 and 255: sent on an event or when the event timer has elapsed, and at first.

    Not earlier than the inhibit time after the last one, then with the newest data.
    """

    timed = True

    def __init__(self, tpdo: Tpdo) -> None:
        super().__init__(tpdo)
        self._inhibit_us = tpdo.parameters.inhibit_us
        self._marked, self._retimed, self._free_us, self.due_us = True, False, 0, 0
        for entry in tpdo.entries:
            tpdo.watch(entry, self.request)

    def request(self) -> None:
        """Send as soon as the inhibit time allows."""
        if not self._marked:
            self._marked, self.due_us = True, self._free_us
            self.tpdo.producer.wake(self.due_us)

    def run(self, now_us: int) -> None:
        """Send, or wait for the end of the inhibit time or of another event timer."""
        if self._retimed and not self._marked:
            self._time_anew(now_us)
        elif now_us < self._free_us:
            self._marked, self.due_us = True, self._free_us
        else:
            self._marked, self._free_us = False, now_us + self._inhibit_us
            self._time_anew(now_us)
            self.tpdo.transmit()

    def retime(self) -> None:
        """Start the event timer anew with the next run."""
        if not self._marked:
            self._retimed, self.due_us = True, self.tpdo.node.now_us
            self.tpdo.producer.wake(self.due_us)

    def _time_anew(self, now_us: int) -> None:
        """Start the event timer; it runs from each transmission."""
        event_us = self.tpdo.parameters.event_us
        self._retimed, self.due_us = False, now_us + event_us if event_us else NEVER


def _ignore(counter: int) -> None:
    """Do nothing on SYNC."""
