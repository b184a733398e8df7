"""A node's end of an emulated CAN bus: queue, acceptance filter, inbox, error counters."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Final, NoReturn

from tickrig.device.core import Device
from tickrig.device.twin import state_of, twin
from tickrig.emulators.can import bus_device
from tickrig.emulators.can.fault_confinement import ErrorCounters
from tickrig.emulators.rig.kernel import EndFields, in_kernel
from tickrig.wire.can import CanFrame, ErrorState, Frames
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.emulators.can.wire import CanWire

_QUEUE_FRAMES: Final = 4_096
"""Capacity of each queue of an end, out and in; further frames are lost and counted."""


@in_kernel
def _ignore(at_us: int) -> None:
    """Wake no device, because no device ticks at this end."""


_NEW_IN_TWINS: Final[Mapping[str, object]] = {
    **dict.fromkeys(("on_error_state", "_device", "_error_aware")),
    "wake": _ignore,
}
"""Attributes of an end in a twin; a rig attaches its devices again."""


class CanEnd(EndFields):
    """One node on a `CanWire`; a `WirePort[Frames]`.

    Frames are sent in the order of their queue. Every other end of the bus whose filter passes a
    frame receives it.

    Attributes:
        wire: the bus.
        number: index among the ends of the bus.
        controller: error counters and error state.
        waiting: number of frames that were not sent yet.
        next: first frame that was not sent yet, if any.
        room: number of further frames that may wait, which is 0 while the node is bus-off.
        held: earliest start of the node's next frame, in units of the segment.
        arrived_us: end of the first received frame in the inbox, or `NEVER` if the inbox is empty.
        lost: number of frames lost because a queue or inbox was full, or the node was bus-off.
        unfiltered: whether the filter of this end is disabled until the next poll.
        on_error_state: function that is called with the time and the new state when the error state
            changes.
        auto_recovery: whether the node leaves bus-off automatically, as with most drivers.
    """

    __slots__ = ()

    def __init__(self, wire: CanWire, number: int, accepts: bus_device.Accepted = None) -> None:
        self.wire, self.number, self._accepts = wire, number, accepts
        self.segment = wire.bus
        self.controller = ErrorCounters()
        self.next: CanFrame
        self._behind: deque[CanFrame] | None = None  # those behind it; seldom there are any
        self._first: Frames = ()  # the frame that waits longest, as all its receivers have it
        self._more: list[tuple[int, CanFrame]] | None = None  # those behind it, with their times
        self.arrived_us = NEVER
        self.waiting, self.room, self.held, self.lost = 0, _QUEUE_FRAMES, 0, 0
        self.unfiltered = False
        self._reconfigured_by: frozenset[int] = frozenset()
        self.wake: Callable[[int], None] = _ignore
        self.on_error_state: Callable[[int, ErrorState], None] | None = None
        self.auto_recovery = False
        self._device: bus_device.Filtering | None = None
        self._error_aware: bus_device.ErrorAware | None = None

    def __getstate__(self) -> object:
        """Return the initial state of a twin."""
        return state_of(self, _NEW_IN_TWINS)

    def __copy__(self) -> NoReturn:
        """Raise TypeError, because a shallow copy would share its parts with the original."""
        raise TypeError("CanEnd cannot be copied by copy.copy: use copy.deepcopy")

    def __deepcopy__(self, memo: dict[int, Any]) -> CanEnd:
        """Return a twin; twins of one deepcopy share the parts that their originals share."""
        return twin(self, memo)

    @property
    def accepts(self) -> bus_device.Accepted:
        """Accepted CAN-IDs; a change applies to frames that end after the change."""
        return self._accepts

    @accepts.setter
    def accepts(self, accepts: bus_device.Accepted) -> None:
        self._accepts = accepts
        self.segment.routes.forget()

    @property
    def due_us(self) -> int:
        """Earliest time at which the next frame may arrive, while its receivers are unknown."""
        return self.arrived_us if self._first else self.wire.due_us

    @property
    def inbox(self) -> Frames:
        """The received frames that wait here."""
        return self._first + tuple([frame for _, frame in self._more or ()])

    def attach(self, device: Device[Any], wake: Callable[[int], None], /) -> None:
        """Connect a device to this end of the bus.

        The end then uses the filter of the device, reports error states to it, and calls `wake`
        when a frame arrives.

        Args:
            device: the device.
            wake: function that is called with the time at which a frame arrives.
        """
        self.wake = wake
        if bus_device.is_filtering(device):
            self._device = device
            device.on_accepts.append(self._refilter)
            self._refilter()
        if bus_device.is_error_aware(device):
            self._error_aware = device

    @in_kernel
    def poll(self, now_us: int, /) -> Frames:
        """Return the frames that ended by `now_us`."""
        if self.segment.now_us < now_us:
            self.wire.advance(now_us)
        if self.unfiltered:
            self.unfiltered = False
            self.segment.routes.unfiltered.remove(self)
        frames = self._first
        if frames:
            if self._more is not None:
                frames = self.inbox
            self._first, self._more, self.arrived_us = (), None, NEVER
        return frames

    def poll_stamped(self, now_us: int) -> tuple[tuple[int, CanFrame], ...]:
        """Return the frames that have arrived by `now_us`, each with the time at which it ended."""
        if self.segment.now_us < now_us:
            self.wire.advance(now_us)
        if not self._first and not self.unfiltered:  # mostly: a fifth of what a host's wait costs
            return ()
        at_us, more = self.arrived_us, self._more or ()
        return (*zip((at_us,), self.poll(now_us), strict=False), *more)

    @in_kernel
    def send(self, now_us: int, traffic: Frames, /) -> None:
        """Queue frames for sending."""
        if traffic:
            self.segment.send(self, now_us, traffic)

    def enqueue(self, frames: Frames) -> None:
        """Append frames to the queue."""
        behind = frames
        if not self.waiting:  # mostly one: without a queue two objects less are touched
            self.next, behind = frames[0], frames[1:]
        if behind:
            if self._behind is None:
                self._behind = deque()
            self._behind.extend(behind)
        self.waiting += len(frames)

    def take(self) -> CanFrame:
        """Remove the first frame of the queue after sending."""
        frame = self.next
        self.waiting -= 1
        if self._behind:
            self.next = self._behind.popleft()
        return frame

    def drop(self) -> None:
        """Drop the frames that wait to be sent."""
        self.waiting, self._behind = 0, None

    def recover(self, now_us: int) -> None:
        """Leave bus-off: after 128 times 11 recessive bits the node is error-active again."""
        self.segment.recover(self, now_us)

    @in_kernel
    def receive(self, at_us: int, frame: CanFrame, alone: Frames) -> None:
        """Receive a frame from the bus, and wake the device.

        Args:
            at_us: time at which the frame ended.
            frame: the frame.
            alone: the same frame as a tuple with one element. To save time, all receivers store
                this tuple, and none makes its own.
        """
        if not self._first:  # one of all ends' objects is touched, not six: 5 % of eight buses
            self._first, self.arrived_us = alone, at_us
            self.wake(at_us)
            self.segment.received = True
        elif not self._take_more(at_us, frame):
            return
        if frame[0] in self._reconfigured_by:
            self.pass_all()

    def _take_more(self, at_us: int, frame: CanFrame) -> bool:
        """Append a received frame, if there is room."""
        if self._more is None:
            self._more = []
        elif len(self._more) >= _QUEUE_FRAMES - 1:
            self.lost += 1
            return False
        self._more.append((at_us, frame))
        return True

    def pass_all(self) -> None:
        """Disable the filter until the next poll, because the device may change its CAN-IDs."""
        if not self.unfiltered:
            self.unfiltered = True
            self.segment.routes.unfiltered.append(self)

    def _refilter(self) -> None:
        """Update the filter from the device."""
        if self._device is not None:
            self.accepts = self._device.accepts
            self._reconfigured_by = self._device.reconfigured_by

    def forget(self) -> None:
        """Drop sent and received frames that wait, as a node without power does."""
        self.drop()
        self._first, self._more, self.arrived_us = (), None, NEVER

    def open(self, *, on_bus: bool) -> None:
        """Enable or disable sending; when sending is disabled, the waiting frames are dropped."""
        self.room = _QUEUE_FRAMES if on_bus else 0
        if not on_bus:
            self.lost += self.waiting
            self.drop()

    def error_state_changed(self, at_us: int) -> None:
        """Report a change of the error state."""
        if self._error_aware is not None:
            self._error_aware.bus_state(self.controller.state)
        if self.on_error_state is not None:
            self.on_error_state(at_us, self.controller.state)
        if self.auto_recovery and self.controller.state is ErrorState.BUS_OFF:
            self.recover(at_us)
        self.wake(at_us)
        self.segment.received = True


class Babbler(CanEnd):
    """A faulty node ("babbling idiot") that sends all the time and ignores its error state."""

    # In the module of `CanEnd`: a class in a module that mypyc compiles cannot derive from `CanEnd`
    # while the optional kernel in C defines its fields.

    __slots__ = ()

    def take(self) -> CanFrame:
        """Keep the frame in the queue."""
        return self.next

    def drop(self) -> None:
        """Keep the frame in the queue."""
