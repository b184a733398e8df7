"""A segment of a CAN bus, which determines the next frame and the time at which it is sent."""

# Theory of operation.
#
# Six modules form one machine:
#   - `wire`: the interface for users;
#   - `segment`: which frame is sent next, and when;
#   - `transmission_outcomes`: the outcome of a transmission;
#   - `arbitration`: which node sends the next frame;
#   - `end`: the queue, the filter and the inbox of a node;
#   - `fault_confinement`: the error counters.
# The module `faults` holds the armed faults.
#
# Times on a segment are whole units. A bit and a microsecond are both multiples of the unit. Only
# time stamps are rounded, up to the next microsecond. So the times of consecutive frames add up
# without error.
#
# A segment has one plan. The plan holds the frame that is on the bus or is sent next, its start
# and end, and the method for its outcome (`_finish`; None means `_deliver`). The plan is valid
# while `_stale` is False. `_due_us` is the time at which its end of frame has passed. `advance`
# carries out the plan, reports changed error states, and makes the next plan.
#   - A plan may be withdrawn until its first bit is sent: a node that sends at that very time still
#     takes part in the arbitration. After that bit the plan no longer changes, except that a node
#     that leaves the bus aborts it.
#   - `CanArbiter.heads` is a heap of the first frames of all queues, by priority, then by node.
#     Nodes that send the same identifier win together. `free` is the time from which the bus is
#     free. Some nodes have to wait longer (`held`): after a delay, or as a passive node after its
#     own frame. Such a node makes the arbiter `slow`.
#   - `_plan` uses a short path if one frame wins on a bus without faults. `_judge` determines all
#     other outcomes: sending is impossible, a collision, no acknowledgement, an armed fault.
#     Random numbers are drawn once for a frame, however often the frame is planned
#     (`CanFaults.judge`, `spend`).
#   - A node that is alone and error-passive repeats its frame endlessly. `_repeating` stops the
#     planning until something changes (`_recount`).
#   - A return from bus-off is also a plan: its end may be that of 128 sequences of recessive bits.
# `_deliver` is the short path for the outcome: without counters, faults and recovery a frame goes
# directly to the ends that `CanRoutes` lists for its identifier. These ends share one tuple.
#
# An end that receives its first frame wakes its station and sets `received`. Then
# `advance_until_received` returns, because the rig may now have an earlier tick. A frame that may
# change which CAN-IDs a device accepts (`reconfigured_by`) opens the filter of its end until the
# next poll.
#
# A disconnected end is on its own segment (`CanWire._apart`). No node acknowledges its frames
# there.
#
# Segment, arbiter, routes and ends have the fields of the kernel, see `emulators/rig/kernel.py`.
# If the kernel was built, `_plan`, `advance` and `send` run in C while `_sound` is True, and call
# the methods here for everything else. Events that may end the sound state set `_sound` to False:
# `_recount`, and each plan that does not end in `_deliver`. `_is_sound` is called before the next
# plan.

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Final

from tickrig.device.twin import Listeners
from tickrig.emulators.can.arbitration import dominant
from tickrig.emulators.can.fault_confinement import ErrorCounters
from tickrig.emulators.can.faults import CanFaults, FaultVerdict
from tickrig.emulators.can.transmission_outcomes import (
    RECESSIVE_BITS,
    Observer,
    TransmissionOutcomes,
)
from tickrig.emulators.rig.kernel import in_kernel
from tickrig.wire.can import INTERFRAME_BITS, CanFrame, ErrorState, Frames, frame_bits, kept_bits
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.emulators.can.end import CanEnd

_ERROR_BITS: Final = 6 + RECESSIVE_BITS  # an error flag, and what follows it
_ECHO_BITS: Final = 6  # the error flags of the others, which begin when the first one ends
_HEADER_BITS: Final = 19  # from start of frame to DLC


def _first_difference(frames: Sequence[CanFrame]) -> int:
    """Return the bit at which frames of one priority first differ, counted without stuff bits."""
    control = 39 if frames[0].extended else 19
    if len({frame.dlc for frame in frames}) > 1:
        return control
    least, most = (int.from_bytes(pick(f.data for f in frames), "big") for pick in (min, max))
    return control + 8 * frames[0].dlc - (least ^ most).bit_length()


class CanSegment(TransmissionOutcomes):
    """A bus in virtual time, advanced by each access.

    The choice of the next frame may change until its first bit is sent: a frame that a node sends
    at that very time still takes part in the arbitration.

    Args:
        bit_rate: bit rate in bit/s.
        start_us: start time.
        faults: the armed faults.
        observers: functions that are called with each frame that ends.
        on_traffic: functions that are called when a frame may end earlier than the previous
            `due_us`.

    Attributes:
        now_us: present time of the bus.
        shorted: whether sending is impossible.
        received: whether a frame has woken a station since `advance_until_received` was called.
        whole: whether all ends of the wire are on this segment.
    """

    __slots__ = ()

    def __init__(
        self,
        bit_rate: int,
        start_us: int,
        faults: CanFaults,
        observers: Listeners[Observer],
        on_traffic: Listeners[Callable[[], None]],
    ) -> None:
        super().__init__(bit_rate, faults, observers, on_traffic)
        self.now_us, self.shorted = start_us, False
        self.received, self.whole = False, True
        self._finish: Callable[[], None] | None = None  # of the plan; None for `_deliver`

    @property
    def due_us(self) -> int:
        """End of the present or next frame."""
        if self._stale:
            self._plan()
        if self._due_us == NEVER:
            self._announced = False
        return self._due_us

    @property
    def present(self) -> tuple[int, int]:
        """Start and end of the present frame's busy time, in units of the segment."""
        return (self._start, self._free) if self._winners else (0, 0)

    @in_kernel
    def advance(self, now_us: int) -> None:
        """Advance to `now_us`."""
        if self._stale:
            self._plan()
        while self._due_us <= now_us:
            self.advance_until_received(now_us)
        self.now_us = max(self.now_us, now_us)

    @in_kernel
    def advance_until_received(self, until_us: int) -> bool:
        """Advance to the first frame that wakes a station; return False if none did."""
        self.received = False
        if self._stale:
            self._plan()
        while self._due_us <= until_us:
            (self._finish or self._deliver)()
            self._stale = True
            if self._news:
                self._notify_changes()
            if self._stale:
                if self._arbiter.heads or self._recovery.active:
                    self._plan()
                else:
                    self._stale, self._start = False, NEVER
                    self._due_us = NEVER
            if self.received:
                return True
        return False

    @in_kernel
    def send(self, end: CanEnd, now_us: int, frames: Frames) -> None:
        """Queue the frames of one node."""
        if self.now_us < now_us:
            self.advance(now_us)
        now, idle = now_us * self.unit, not end.waiting
        if (excess := end.waiting + len(frames) - end.room) > 0:
            end.lost += excess
            frames = frames[: len(frames) - excess]
        if not frames:
            return
        if self._start >= now and not self._stale:
            if self._winners or not self._announced:
                self._withdraw()
            self._stale = True
        if self._faults.active and (delay_us := self._faults.delay_us(end.number)):
            end.held, self._arbiter.slow = now + delay_us * self.unit, True
        if idle and len(frames) == 1:  # mostly
            end.next, end.waiting = frames[0], 1
        else:
            end.enqueue(frames)
        if idle:
            self._enter(end, now)

    def join(self, end: CanEnd, now_us: int) -> None:
        """Add an end."""
        self.routes.ends.append(end)
        if end.unfiltered:
            self.routes.unfiltered.append(end)
        end.segment = self
        self._confinement.join(end)
        self._arbiter.join(end)
        self.disturb(now_us)
        if end.waiting:
            end.held = 0
            self._enter(end, now_us * self.unit)

    def leave(self, end: CanEnd, now_us: int) -> None:
        """Remove an end; its frame on the bus is aborted."""
        self.disturb(now_us)
        if end in self._winners:
            self._withdraw()
            self._arbiter.free = now_us * self.unit + (_ECHO_BITS + _ERROR_BITS) * self.bit
        self._arbiter.leave(end)
        self.routes.ends.remove(end)
        if end.unfiltered:
            self.routes.unfiltered.remove(end)
        self._confinement.leave(end)
        self._recovery.leave(end)
        self._recount(now_us)

    def force_off(self, end: CanEnd, now_us: int) -> None:
        """Force a node into bus-off, as after 32 errors in a row.

        If the node is sending a frame, the frame is aborted.

        Args:
            end: connection of the node to the bus.
            now_us: present time.
        """
        self.disturb(now_us)
        if end in self._winners:
            self._withdraw()
            self._arbiter.free = now_us * self.unit + (_ECHO_BITS + _ERROR_BITS) * self.bit
        self._arbiter.leave(end)
        self._arbiter.join(end)
        self._confinement.count(now_us, end, ErrorCounters.go_off)
        self._notify_changes()

    def recover(self, end: CanEnd, now_us: int) -> None:
        """Start the recovery of a node from bus-off."""
        self.disturb(now_us)
        if end.controller.state is ErrorState.BUS_OFF:
            now = now_us * self.unit
            quiet = self._free - RECESSIVE_BITS * self.bit if self._winners else now
            self._recovery.begin(end, quiet)

    def disturb(self, now_us: int) -> None:
        """Plan the next transmission again, because nodes or faults of the bus have changed.

        A transmission that has started before `now_us` is not changed.
        """
        self.advance(now_us)
        if self._start >= now_us * self.unit:
            self._withdraw()
        self._recount(now_us)

    def _enter(self, end: CanEnd, now: int) -> None:
        arbiter = self._arbiter
        if not arbiter.heads and not self._winners and arbiter.free < now:
            arbiter.free = now
        end.held = max(end.held, now)
        arbiter.push(end)

    def _withdraw(self) -> None:
        """Withdraw the plan."""
        self._arbiter.put_back(self._winners)
        self._winners, self._start = [], NEVER
        self._plan_anew()

    def _is_sound(self) -> bool:
        """Return whether only plain deliveries are possible."""
        unsound = self._faults.active or self._confinement.marked or self._recovery.active
        slow = self._arbiter.slow or self.shorted or self._repeating
        return self._on_bus > 1 and not (unsound or slow)

    @in_kernel
    def _plan(self) -> None:
        """Determine the transmission or return that ends next, and its end."""
        self._stale = False
        arbiter = self._arbiter
        if arbiter.heads and not self._repeating:
            if arbiter.slow or self.shorted:
                self._start, winners = arbiter.take_waiting(everybody=self.shorted)
            else:
                self._start, winners = arbiter.free, arbiter.take()
            self._winners = winners
            frame = winners[0].next
            bits = kept_bits(frame) if type(frame[1]) is bytes else frame_bits(frame)
            if self._on_bus > 1 and not self._faults.active and len(winners) == 1:
                self._finish = None
                self._free = free = self._start + bits * self.bit
                self._due_us = -((INTERFRAME_BITS * self.bit - free) // self.unit)
            else:
                self._judge(frame, bits)
        else:
            self._start = self._due_us = NEVER
        if self._recovery.active and self._recovery.due <= self._start:
            self._plan_return()

    def _plan_return(self) -> None:
        """Plan the earliest return from bus-off, if no transmission ends before."""
        self._arbiter.put_back(self._winners)
        self._winners, self._start = [], self._recovery.due
        self._finish, self._due_us = self._come_back, -(-self._start // self.unit)

    def _judge(self, frame: CanFrame, bits: int) -> None:
        """Plan a transmission that may fail."""
        if self.shorted:  # recessive for good: each start of frame is a bit error
            self._settle(self._fail_alone, 1 + _ERROR_BITS)
        elif any(end.next != frame for end in self._winners):
            self._collide()
        elif self._on_bus <= len(self._winners):
            self._settle(self._go_unheard, bits - RECESSIVE_BITS + _ERROR_BITS)
        else:
            self._suffer(bits)

    def _suffer(self, bits: int) -> None:
        """Plan a transmission on a bus with faults."""
        match self._faults.judge([end.number for end in self._winners]):
            case FaultVerdict.SENT:
                self._settle(self._deliver, bits)
            case FaultVerdict.DROPPED:
                self._settle(self._drop, bits)
            case FaultVerdict.DUPLICATED:
                self._settle(self._duplicate, bits - INTERFRAME_BITS + _ECHO_BITS + _ERROR_BITS)
            case FaultVerdict.CORRUPTED:
                turned = _HEADER_BITS + self._faults.place % (bits - _HEADER_BITS - RECESSIVE_BITS)
                self._settle(self._fail, turned + _ECHO_BITS + _ERROR_BITS)

    def _collide(self) -> None:
        """Plan the collision of nodes that send one identifier with different contents."""
        frames = [end.next for end in self._winners]
        received = dominant(frames)
        losers = [end for end in self._winners if end.next != received]
        if all(end.controller.state is ErrorState.PASSIVE for end in losers):
            self._settle(self._override, frame_bits(received))
        else:
            self._settle(self._fail, _first_difference(frames) + _ECHO_BITS + _ERROR_BITS)

    def _settle(self, finish: Callable[[], None], bits: int) -> None:
        """Store the outcome of the plan, and its busy time."""
        self._finish = finish
        self._free = free = self._start + bits * self.bit
        self._due_us = -((INTERFRAME_BITS * self.bit - free) // self.unit)
