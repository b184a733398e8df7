"""Outcomes of a transmission on a CAN bus: delivery, error frames, return from bus-off."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from math import gcd
from typing import TYPE_CHECKING, Final

from tickrig.device.twin import Cache, Listeners
from tickrig.emulators.can.arbitration import CanArbiter, dominant
from tickrig.emulators.can.fault_confinement import ErrorCounters, FaultConfinement, Recovery
from tickrig.emulators.can.faults import CanFaults
from tickrig.emulators.rig.kernel import BusyFields, RoutesFields, SegmentFields, in_kernel
from tickrig.wire.can import BIT_ERROR, INTERFRAME_BITS, NO_ACK, CanFrame, ErrorFrame, ErrorState
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.emulators.can.end import CanEnd


# Busy times and load of a bus.

KEPT_SPANS: Final = 32_768


class BusyTime(BusyFields):
    """Records when a bus was busy, to compute its load.

    Frames that follow each other without a gap are stored as one time span. Only the latest spans
    are kept. Times are whole numbers in a unit that the caller chooses.
    """

    __slots__ = ()

    def __init__(self) -> None:
        self._since = self._until = 0
        self._spans: deque[tuple[int, int]] = deque(maxlen=KEPT_SPANS)

    def note(self, since: int, until: int) -> None:
        """Add a span that starts at the end of the latest span, or later."""
        if since != self._until:
            self._spans.append((self._since, self._until))
            self._since = since
        self._until = until

    def permille(self, first: int, now: int, present: tuple[int, int]) -> int:
        """Return the share of a time span in which the bus was busy, in 0.1 %.

        Args:
            first: start of the time span.
            now: end of the time span.
            present: start and end of the frame that is on the bus now. This frame is not recorded
                yet, so the caller passes its times.
        """
        spans = (*self._spans, (self._since, self._until), present)
        busy = sum(max(0, min(until, now) - max(since, first)) for since, until in spans)
        return 1_000 * busy // (now - first) if now > first else 0


# Delivery by table: which ends of a bus receive which CAN-ID.

_EXTENDED: Final = 1 << 29
"""Flag of a 29-bit CAN-ID in a filter, as in a COB-ID (CiA 301)."""

_CACHED_ROUTES: Final = 4_096


class _CanRoutes(RoutesFields):
    """The ends of a bus and their filters, looked up once for each CAN-ID.

    Attributes:
        ends: all ends, in the order in which they joined.
        unfiltered: ends whose filter is disabled until the next poll.
    """

    __slots__ = ()

    def __init__(self) -> None:
        self.ends: list[CanEnd] = []
        self.unfiltered: list[CanEnd] = []
        self._table: Cache[int, tuple[CanEnd, ...]] = Cache()

    def forget(self) -> None:
        """Clear the cache after an end joined, left or changed its filter."""
        self._table.clear()

    def receivers(self, frame: CanFrame) -> tuple[CanEnd, ...]:
        """Return the ends that receive a frame; its sender may be among them."""
        key = frame[0] | _EXTENDED if frame[3] else frame[0]
        found = self._table.get(key)
        if found is None:
            found = self._table[key] = self._look_up(key)
        return (*found, *self._passing(key)) if self.unfiltered else found

    def _passing(self, key: int) -> Iterator[CanEnd]:
        """Yield the unfiltered ends whose filter does not accept a CAN-ID."""
        for end in self.unfiltered:
            if end.accepts is not None and key not in end.accepts:
                yield end

    def _look_up(self, key: int) -> tuple[CanEnd, ...]:
        if len(self._table) >= _CACHED_ROUTES:
            self._table.clear()
        return tuple(end for end in self.ends if end.accepts is None or key in end.accepts)


Observer = Callable[[int, CanFrame | ErrorFrame], None]
"""Function that is called with the end time of each frame or error frame, and the frame."""

RECESSIVE_BITS: Final = 8 + INTERFRAME_BITS  # from the ACK or error delimiter to the next frame
_SUSPEND_BITS: Final = 8  # a passive node's wait after it has sent


class TransmissionOutcomes(SegmentFields):
    """The possible outcomes of a transmission on an emulated bus, each as a method.

    The methods deliver frames, and update queues and error counters of the nodes. `CanSegment`
    plans the transmission and chooses the method for its outcome. All times are whole numbers of a
    unit. The unit depends on the bit rate: both a bit and a microsecond last a whole number of
    units. Therefore the times are exact. Only the time stamps of frames, which are in microseconds,
    are rounded up.

    Attributes:
        unit: number of units in a microsecond.
        bit: number of units in a bit.
        routes: the ends and their filters.
        busy: the latest busy times of the bus, in units.
    """

    __slots__ = ()

    def __init__(
        self,
        bit_rate: int,
        faults: CanFaults,
        observers: Listeners[Observer],
        on_traffic: Listeners[Callable[[], None]],
    ) -> None:
        common = gcd(bit_rate, 1_000_000)
        self.unit, self.bit = bit_rate // common, 1_000_000 // common
        self.routes = _CanRoutes()
        self.busy = BusyTime()
        self._faults, self._observers, self._on_traffic = faults, observers, on_traffic
        self._confinement = FaultConfinement(self.routes.ends, self._state_changed)
        self._recovery = Recovery(self.bit)
        self._arbiter = CanArbiter()
        self._on_bus = 0  # ends that acknowledge
        self._repeating = False  # a node is alone, and nothing changes any more
        self._news: list[tuple[int, CanEnd]] = []  # whose error state changed when
        self._stale = True  # the plan that follows is to be made
        self._winners: list[CanEnd] = []
        self._start = self._due_us = NEVER  # of the plan, as the next
        self._free = 0
        self._sound = False  # frames are delivered and nothing else; only the kernel asks
        self._announced = False  # that something may end earlier, since it was asked when

    @in_kernel
    def _deliver(self) -> None:
        """Deliver a frame of one sender on an intact bus to all receivers (fast path)."""
        winners, confinement = self._winners, self._confinement
        if len(winners) > 1 or confinement.marked or self._faults.active or self._recovery.active:
            self._deliver_and_count()
            return
        at_us, (sender,), arbiter = self._due_us, winners, self._arbiter
        frame = sender.take()
        for observe in self._observers:
            observe(at_us, frame)
        arbiter.free = self._free
        self.busy.note(self._start, self._free)
        if sender.waiting:
            arbiter.push(sender)
        self._winners = []
        routes = self.routes
        receivers = None if frame[3] or routes.unfiltered else routes._table.get(frame[0])
        if receivers is None:
            receivers = routes.receivers(frame)
        if receivers:
            alone = (frame,)
            for end in receivers:
                if end is not sender:
                    end.receive(at_us, frame, alone)

    def _deliver_and_count(self) -> None:
        """Deliver a frame to all receivers, and update error counters and recovery."""
        at_us, winners = self._due_us, self._winners
        frame = winners[0].next
        self._take_off(frame)
        for end in self.routes.receivers(frame):
            if end not in winners:
                end.receive(at_us, frame, (frame,))

    def _drop(self) -> None:
        """Acknowledge a frame, but deliver it to no node."""
        at_us, frame = self._due_us, self._winners[0].next
        self._take_off(frame)
        for hear in self._faults.listeners:
            hear(at_us, frame)

    def _duplicate(self) -> None:
        """Deliver a frame that its sender will send again."""
        at_us, winners = self._due_us, self._winners
        frame = winners[0].next
        for end in self.routes.receivers(frame):
            if end not in winners:
                end.receive(at_us, frame, (frame,))
        self._notify(frame)
        self._confinement.failed_to_send(at_us, winners)
        self._end_attempt()

    def _override(self) -> None:
        """Deliver the dominant frame; error flags of passive nodes are not seen."""
        frame = dominant([end.next for end in self._winners])
        losers = [end for end in self._winners if end.next != frame]
        self._winners = [end for end in self._winners if end not in losers]
        self._confinement.failed_to_send(self._due_us, losers)
        self._suspend(losers)
        self._arbiter.put_back(losers)
        self._deliver()

    def _fail(self) -> None:
        """Signal an error frame to all nodes; its senders will send again."""
        self._confinement.failed(self._due_us, self._winners)
        self._notify(BIT_ERROR)
        self._end_attempt()

    def _fail_alone(self) -> None:
        """Signal an error frame that only the senders detect; they will send again."""
        self._confinement.failed_to_send(self._due_us, self._winners)
        self._notify(BIT_ERROR)
        self._end_attempt()

    def _go_unheard(self) -> None:
        """Handle a missing acknowledgement; stop planning once repeats change nothing."""
        passive = all(end.controller.state is ErrorState.PASSIVE for end in self._winners)
        self._confinement.unheard(self._due_us, self._winners)
        self._notify(NO_ACK)
        self._end_attempt()
        self._repeating = passive

    def _come_back(self) -> None:
        """Let nodes return from bus-off."""
        for end in self._recovery.take(self._start):
            self._confinement.count(self._due_us, end, ErrorCounters.restart)

    def _take_off(self, frame: CanFrame) -> None:
        """Remove a successful frame from the queues of its senders."""
        for end in self._winners:
            end.take()
        if self._confinement.marked:
            self._confinement.sent(self._due_us, self._winners)
        self._notify(frame)
        self._end_attempt()

    def _end_attempt(self) -> None:
        """Mark the bus free for the next frame."""
        self._arbiter.free = self._free
        self.busy.note(self._start, self._free)
        if self._confinement.marked:
            self._suspend(self._winners)
        if self._recovery.active:
            self._recovery.interrupt(self._start, self._free - RECESSIVE_BITS * self.bit)
        if self._faults.active:
            self._faults.spend()
        self._arbiter.put_back(self._winners)
        self._winners = []

    def _suspend(self, senders: list[CanEnd]) -> None:
        """Delay passive nodes that have sent."""
        for end in senders:
            if end.controller.state is ErrorState.PASSIVE:
                end.held = max(end.held, self._free + _SUSPEND_BITS * self.bit)
                self._arbiter.slow = True

    def _notify(self, received: CanFrame | ErrorFrame) -> None:
        for observe in self._observers:
            observe(self._due_us, received)

    def _state_changed(self, at_us: int, end: CanEnd) -> None:
        end.open(on_bus=end.controller.state is not ErrorState.BUS_OFF)
        self._recount(at_us)
        self._news.append((at_us, end))

    def _notify_changes(self) -> None:
        news, self._news = self._news, []
        for at_us, end in news:
            end.error_state_changed(at_us)

    def _recount(self, now_us: int) -> None:
        """Count the acknowledging ends; a node that was alone starts again."""
        states = [end.controller.state for end in self.routes.ends]
        self._sound = False
        self._on_bus = len(states) - states.count(ErrorState.BUS_OFF)
        self.routes.forget()
        if self._repeating:
            self._repeating = False
            self._arbiter.free = max(self._arbiter.free, now_us * self.unit)
            self._plan_anew()

    def _plan_anew(self) -> None:
        """Discard the plan; report that the next event may be earlier."""
        self._stale = True
        if not self._announced:
            self._announced = True
            for tell in self._on_traffic:
                tell()
