"""A stretch of CAN bus on which all hear each other: what is sent when, and how it ends."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from math import gcd
from typing import TYPE_CHECKING, Final

from tickrig.device.twin import Cache, Listeners
from tickrig.emulators.can.arbitration import CanArbiter, dominant, first_difference
from tickrig.emulators.can.fault_confinement import ErrorCounters, FaultConfinement, Recovery
from tickrig.emulators.can.faults import CanFaults, Verdict
from tickrig.emulators.can.routes import CanRoutes
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.can_bits import INTERFRAME_BITS, frame_bits
from tickrig.wire.can_error import BIT_ERROR, NO_ACK, ErrorFrame, ErrorState
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.emulators.can.end import CanEnd

Observer = Callable[[int, CanFrame | ErrorFrame], None]
"""Told each frame and each error frame with the time at which it had ended."""

RECESSIVE_BITS: Final = 8 + INTERFRAME_BITS  # from the ACK or error delimiter to the next frame
ERROR_BITS: Final = 6 + RECESSIVE_BITS  # an error flag, and what follows it
ECHO_BITS: Final = 6  # the error flags of the others, which begin when the first one ends
SUSPEND_BITS: Final = 8  # a passive node's wait after it has sent
HEADER_BITS: Final = 19  # from start of frame to DLC
KEPT_SPANS: Final = 32_768
KEPT_LENGTHS: Final = 8_192


class CanSegment:
    """A bus in virtual time, moved on by whoever looks at it.

    Time inside is counted in units of which a bit and a microsecond are whole
    multiples; only time stamps are rounded, up to the next microsecond. Which
    frame goes next is a plan until its first bit is out: a frame sent at that
    very time still takes part in the arbitration.

    Attributes:
        unit: units in a microsecond.
        bit: units in a bit.
        now_us: how far the bus was moved on.
        routes: the ends and who of them receives what.
        busy: from when to when the latest frames kept the bus busy, in units.
        shorted: nobody can send.
        heard: a frame woke a station since `advance_until_heard` was called.
    """

    def __init__(
        self, bit_rate: int, start_us: int, faults: CanFaults, observers: Listeners[Observer]
    ) -> None:
        common = gcd(bit_rate, 1_000_000)
        self.unit, self.bit = bit_rate // common, 1_000_000 // common
        self.now_us, self.shorted, self.heard = start_us, False, False
        self.routes = CanRoutes()
        self.busy: deque[tuple[int, int]] = deque(maxlen=KEPT_SPANS)
        self._faults, self._observers = faults, observers
        self._confinement = FaultConfinement(self.routes.ends, self._state_changed)
        self._recovery = Recovery(self.bit)
        self._arbiter = CanArbiter(start_us * self.unit)
        self._on_bus = 0  # ends that acknowledge
        self._repeating = False  # a node is alone, and nothing changes any more
        self._news: list[tuple[int, CanEnd]] = []  # whose error state changed when
        self._lengths: Cache[CanFrame, int] = Cache()
        self._stale = True  # the plan that follows is to be made
        self._winners: list[CanEnd] = []
        self._start = self._free = self._due_us = NEVER
        self._finish: Callable[[], None] = self._come_back

    @property
    def due_us(self) -> int:
        """When the frame that is on the bus, or goes next, will have ended."""
        if self._stale:
            self._plan()
        return self._due_us

    @property
    def present(self) -> tuple[int, int]:
        """From when to when the frame that is on the bus keeps it busy, in units."""
        return (self._start, self._free) if self._winners else (0, 0)

    def advance(self, now_us: int) -> None:
        """Let everything end that ends by `now_us`."""
        while self.advance_until_heard(now_us):
            pass
        self.now_us = max(self.now_us, now_us)

    def advance_until_heard(self, until_us: int) -> bool:
        """Let everything end up to the first frame that wakes a station; False if none did."""
        self.heard = False
        if self._stale:
            self._plan()
        while self._due_us <= until_us:
            self._finish()
            self._stale = True
            if self._news:
                self._tell_news()
            if self._stale:
                self._plan()
            if self.heard:
                return True
        return False

    def send(self, end: CanEnd, now_us: int, frames: Frames) -> None:
        """Queue the frames of one node."""
        if self.now_us < now_us:
            self.advance(now_us)
        now, queue = now_us * self.unit, end.queue
        if (excess := len(queue) + len(frames) - end.room) > 0:
            end.lost += excess
            frames = frames[: len(frames) - excess]
        if not frames:
            return
        if self._start >= now:
            self._withdraw()
        if self._faults.active and (delay_us := self._faults.delay_us(end.number)):
            end.held, self._arbiter.slow = now + delay_us * self.unit, True
        waiting = bool(queue)
        queue.extend(frames)
        if not waiting:
            self._enter(end, now)

    def join(self, end: CanEnd, now_us: int) -> None:
        """Let an end take part from now on."""
        self.routes.ends.append(end)
        if end.unfiltered:
            self.routes.unfiltered.append(end)
        end.segment = self
        self._confinement.join(end)
        self.disturb(now_us)
        if end.queue:
            end.held = 0
            self._enter(end, now_us * self.unit)

    def leave(self, end: CanEnd, now_us: int) -> None:
        """Let an end take part no longer; a frame of it on the bus is broken off."""
        self.disturb(now_us)
        if end in self._winners:
            self._withdraw()
            self._arbiter.free = now_us * self.unit + (ECHO_BITS + ERROR_BITS) * self.bit
        self._arbiter.remove(end)
        self.routes.ends.remove(end)
        if end.unfiltered:
            self.routes.unfiltered.remove(end)
        self._confinement.leave(end)
        self._recovery.leave(end)
        self._recount(now_us)

    def recover(self, end: CanEnd, now_us: int) -> None:
        """Let a node that is bus-off wait for its return."""
        self.disturb(now_us)
        if end.controller.state is ErrorState.BUS_OFF:
            busy = self._start < now_us * self.unit
            quiet = self._free - RECESSIVE_BITS * self.bit if busy else now_us * self.unit
            self._recovery.begin(end, quiet)

    def disturb(self, now_us: int) -> None:
        """Plan anew what has not begun at `now_us`: something around it has changed."""
        self.advance(now_us)
        if self._start >= now_us * self.unit:
            self._withdraw()
        self._recount(now_us)

    def _recount(self, now_us: int) -> None:
        """Count who acknowledges; a node that was alone begins anew."""
        states = [end.controller.state for end in self.routes.ends]
        self._on_bus = len(states) - states.count(ErrorState.BUS_OFF)
        self.routes.forget()
        if self._repeating:
            self._repeating, self._stale = False, True
            self._arbiter.free = max(self._arbiter.free, now_us * self.unit)

    def _enter(self, end: CanEnd, now: int) -> None:
        arbiter = self._arbiter
        if not arbiter.heads and not self._winners and arbiter.free < now:
            arbiter.free = now
        arbiter.enter(end, now)

    def _withdraw(self) -> None:
        """Take the plan back."""
        self._arbiter.put_back(self._winners)
        self._winners, self._stale, self._start = [], True, NEVER

    def _plan(self) -> None:
        """Find out what ends next, and when."""
        self._stale = False
        arbiter = self._arbiter
        if arbiter.heads and not self._repeating:
            if arbiter.slow or self.shorted:
                self._start, self._winners = arbiter.take_waiting(everybody=self.shorted)
            else:
                self._start, self._winners = arbiter.free, arbiter.take()
            frame = self._winners[0].queue[0]
            bits = self._lengths.get(frame) or self._length(frame)
            if self._on_bus > 1 and not self._faults.active and len(self._winners) == 1:
                self._settle(self._deliver, bits)
            else:
                self._judge(frame, bits)
        else:
            self._start = self._due_us = NEVER
        if self._recovery.active and self._recovery.due <= self._start:
            self._plan_return()

    def _plan_return(self) -> None:
        """Let the node that is back first be what ends next."""
        self._withdraw()
        self._stale, self._start = False, self._recovery.due
        self._finish, self._due_us = self._come_back, -(-self._start // self.unit)

    def _length(self, frame: CanFrame) -> int:
        if len(self._lengths) >= KEPT_LENGTHS:
            self._lengths.clear()
        bits = self._lengths[frame] = frame_bits(frame)
        return bits

    def _judge(self, frame: CanFrame, bits: int) -> None:
        """Plan a transmission that may fail."""
        if self.shorted:  # recessive for good: each start of frame is a bit error
            self._settle(self._fail_alone, 1 + ERROR_BITS)
        elif any(end.queue[0] != frame for end in self._winners):
            self._collide()
        elif self._on_bus <= len(self._winners):
            self._settle(self._go_unheard, bits - RECESSIVE_BITS + ERROR_BITS)
        else:
            self._suffer(bits)

    def _suffer(self, bits: int) -> None:
        """Plan a transmission on a bus with faults."""
        match self._faults.judge():
            case Verdict.SENT:
                self._settle(self._deliver, bits)
            case Verdict.DROPPED:
                self._settle(self._drop, bits)
            case Verdict.DUPLICATED:
                self._settle(self._duplicate, bits - INTERFRAME_BITS + ECHO_BITS + ERROR_BITS)
            case Verdict.CORRUPTED:
                turned = HEADER_BITS + self._faults.place % (bits - HEADER_BITS - RECESSIVE_BITS)
                self._settle(self._fail, turned + ECHO_BITS + ERROR_BITS)

    def _collide(self) -> None:
        """Plan what happens when several send one identifier with different contents."""
        frames = [end.queue[0] for end in self._winners]
        heard = dominant(frames)
        losers = [end for end in self._winners if end.queue[0] != heard]
        if all(end.controller.state is ErrorState.PASSIVE for end in losers):
            self._settle(self._override, self._length(heard))
        else:
            self._settle(self._fail, first_difference(frames) + ECHO_BITS + ERROR_BITS)

    def _settle(self, finish: Callable[[], None], bits: int) -> None:
        """Enter what the plan ends in, and how long it keeps the bus busy."""
        self._finish = finish
        self._free = free = self._start + bits * self.bit
        self._due_us = -((INTERFRAME_BITS * self.bit - free) // self.unit)

    # What a plan ends in.

    def _deliver(self) -> None:
        """Hand a frame to all that accept it."""
        at_us, winners = self._due_us, self._winners
        frame = winners[0].queue[0]
        self._take_off(frame)
        for end in self.routes.receivers(frame):
            if end not in winners:
                end.receive(at_us, frame)

    def _drop(self) -> None:
        """Let a frame be acknowledged, and lost."""
        self._take_off(self._winners[0].queue[0])

    def _duplicate(self) -> None:
        """Hand a frame out that its sender will send again."""
        at_us, winners = self._due_us, self._winners
        frame = winners[0].queue[0]
        for end in self.routes.receivers(frame):
            if end not in winners:
                end.receive(at_us, frame)
        self._tell(frame)
        self._confinement.failed_to_send(at_us, winners)
        self._end_attempt()

    def _override(self) -> None:
        """Let the dominant frame through; the error flags of passive nodes are not heard."""
        frame = dominant([end.queue[0] for end in self._winners])
        losers = [end for end in self._winners if end.queue[0] != frame]
        self._winners = [end for end in self._winners if end not in losers]
        self._confinement.failed_to_send(self._due_us, losers)
        self._suspend(losers)
        self._arbiter.put_back(losers)
        self._deliver()

    def _fail(self) -> None:
        """Tell all that a frame was broken; its senders will send again."""
        self._confinement.failed(self._due_us, self._winners)
        self._tell(BIT_ERROR)
        self._end_attempt()

    def _fail_alone(self) -> None:
        """The same, but nobody else hears anything."""
        self._confinement.failed_to_send(self._due_us, self._winners)
        self._tell(BIT_ERROR)
        self._end_attempt()

    def _go_unheard(self) -> None:
        """Find nobody to acknowledge; once that changes nothing more, it is not looked at."""
        passive = all(end.controller.state is ErrorState.PASSIVE for end in self._winners)
        self._confinement.unheard(self._due_us, self._winners)
        self._tell(NO_ACK)
        self._end_attempt()
        self._repeating = passive

    def _come_back(self) -> None:
        """Let nodes return from bus-off."""
        for end in self._recovery.take(self._start):
            self._confinement.count(self._due_us, end, ErrorCounters.restart)

    def _take_off(self, frame: CanFrame) -> None:
        """Take a frame that went well from its queues."""
        for end in self._winners:
            end.queue.popleft()
        if self._confinement.marked:
            self._confinement.sent(self._due_us, self._winners)
        self._tell(frame)
        self._end_attempt()

    def _end_attempt(self) -> None:
        """Let the bus be free for the next frame."""
        self._arbiter.free = self._free
        self.busy.append((self._start, self._free))
        if self._confinement.marked:
            self._suspend(self._winners)
        if self._recovery.active:
            self._recovery.interrupt(self._start, self._free - RECESSIVE_BITS * self.bit)
        if self._faults.active:
            self._faults.spend()
        self._arbiter.put_back(self._winners)
        self._winners = []

    def _suspend(self, senders: list[CanEnd]) -> None:
        """Let passive nodes that have sent wait for the others."""
        for end in senders:
            if end.controller.state is ErrorState.PASSIVE:
                end.held = max(end.held, self._free + SUSPEND_BITS * self.bit)
                self._arbiter.slow = True

    def _tell(self, heard: CanFrame | ErrorFrame) -> None:
        for observe in self._observers:
            observe(self._due_us, heard)

    def _state_changed(self, at_us: int, end: CanEnd) -> None:
        end.open(on_bus=end.controller.state is not ErrorState.BUS_OFF)
        self._recount(at_us)
        self._news.append((at_us, end))

    def _tell_news(self) -> None:
        news, self._news = self._news, []
        for at_us, end in news:
            end.error_state_changed(at_us)
