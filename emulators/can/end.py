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
"""Frames that an end keeps, going out and as many coming in; more are lost and counted."""


@in_kernel
def _ignore(at_us: int) -> None:
    """Wake nobody: nobody ticks at this end."""


_NEW_IN_TWINS: Final[Mapping[str, object]] = {
    **dict.fromkeys(("on_error_state", "_device", "_error_aware")),
    "wake": _ignore,
}
"""A rig attaches its devices anew."""


class CanEnd(EndFields):
    """One node on a `CanWire`; a `WirePort[Frames]`.

    Frames leave in the order in which they were given. A frame is received by
    every other end of the bus whose filter lets it through.

    Attributes:
        wire: the bus.
        number: place among the ends of the bus.
        controller: error counters and error state.
        waiting: how many frames have not left.
        next: the first of them, if there are any.
        room: how many may wait; none while the node is bus-off.
        held: no frame of it starts before this, in units of the segment.
        arrived_us: when the first frame that waits here had ended, `NEVER` if none does.
        lost: frames that found a queue or inbox full, or the node bus-off.
        unfiltered: its filter is out of use until it is polled.
        on_error_state: called with the time and the new state when the error state changes.
        auto_recovery: it leaves bus-off by itself, as most drivers let it.
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
        """Return the state that a twin begins with."""
        return state_of(self, _NEW_IN_TWINS)

    def __copy__(self) -> NoReturn:
        """Refuse: a shallow copy would share its parts with the original."""
        raise TypeError("CanEnd cannot be copied by copy.copy: use copy.deepcopy")

    def __deepcopy__(self, memo: dict[int, Any]) -> CanEnd:
        """Return a twin, which has in common with other twins what the originals have."""
        return twin(self, memo)

    @property
    def accepts(self) -> bus_device.Accepted:
        """CAN-IDs that are received; a change holds for frames that end after it."""
        return self._accepts

    @accepts.setter
    def accepts(self, accepts: bus_device.Accepted) -> None:
        self._accepts = accepts
        self.segment.routes.forget()

    @property
    def due_us(self) -> int:
        """When the next frame will have arrived, or earlier: its receivers are not known yet."""
        return self.arrived_us if self._first else self.wire.due_us

    @property
    def inbox(self) -> Frames:
        """The frames that wait here."""
        return self._first + tuple([frame for _, frame in self._more or ()])

    def attach(self, device: Device[Any], wake: Callable[[int], None], /) -> None:
        """Take the filter from a device, tell it the error state, say when a frame has arrived."""
        self.wake = wake
        if bus_device.is_filtering(device):
            self._device = device
            device.on_accepts.append(self._refilter)
            self._refilter()
        if bus_device.is_error_aware(device):
            self._error_aware = device

    @in_kernel
    def poll(self, now_us: int, /) -> Frames:
        """Take the frames that had ended by `now_us`."""
        if self.segment.now_us < now_us:
            self.wire.advance(now_us)
        if self.unfiltered:
            self.unfiltered = False
            self.segment.routes.unfiltered.remove(self)
        frames = self._first
        if frames:
            if self._more is not None:
                frames = self.inbox
            self._empty()
        return frames

    def poll_stamped(self, now_us: int) -> tuple[tuple[int, CanFrame], ...]:
        """Take the same frames, each with the time at which it had ended."""
        self.wire.advance(now_us)
        if not self._first and not self.unfiltered:  # mostly: a fifth of what a host's wait costs
            return ()
        stamps = self.arrived_us, *(at_us for at_us, _ in self._more or ())
        return tuple(zip(stamps, self.poll(now_us), strict=False))

    @in_kernel
    def send(self, now_us: int, traffic: Frames, /) -> None:
        """Queue frames behind those that have not left."""
        if traffic:
            self.segment.send(self, now_us, traffic)

    @in_kernel
    def enqueue(self, frames: Frames) -> None:
        """Let frames wait behind those that do."""
        behind = frames
        if not self.waiting:  # mostly one: without a queue two objects less are touched
            self.next, behind = frames[0], frames[1:]
        if behind:
            self._behind = self._behind or deque()
            self._behind.extend(behind)
        self.waiting += len(frames)

    def take(self) -> CanFrame:
        """Take the first of the frames that wait: it was sent."""
        frame = self.next
        self.waiting -= 1
        if self._behind:
            self.next = self._behind.popleft()
        return frame

    def drop(self) -> None:
        """Lose what waits to be sent."""
        self.waiting, self._behind = 0, None

    def recover(self, now_us: int) -> None:
        """Leave bus-off: after 128 times 11 recessive bits the node is error-active again."""
        self.segment.recover(self, now_us)

    @in_kernel
    def receive(self, at_us: int, frame: CanFrame, alone: Frames) -> None:
        """Take a frame from the bus; `alone` are it and no other, made once for all who take it."""
        if not self._first:  # one of all ends' objects is touched, not six: 5 % of eight buses
            self._first, self.arrived_us = alone, at_us
            self.wake(at_us)
            self.segment.received = True
        elif not self._take_more(at_us, frame):
            return
        if frame[0] in self._reconfigured_by:
            self.pass_all()

    def _take_more(self, at_us: int, frame: CanFrame) -> bool:
        """Take a frame behind others that wait, if it fits."""
        if self._more is None:
            self._more = []
        elif len(self._more) >= _QUEUE_FRAMES - 1:
            self.lost += 1
            return False
        self._more.append((at_us, frame))
        return True

    def _empty(self) -> None:
        self._first, self._more, self.arrived_us = (), None, NEVER

    def pass_all(self) -> None:
        """Open the filter until the next poll: the device will listen to nobody knows what."""
        if not self.unfiltered:
            self.unfiltered = True
            self.segment.routes.unfiltered.append(self)

    def _refilter(self) -> None:
        """Follow what the device listens to."""
        if self._device is not None:
            self.accepts = self._device.accepts
            self._reconfigured_by = self._device.reconfigured_by

    def forget(self) -> None:
        """Lose what waits to be sent and to be polled, as a node without power does."""
        self.drop()
        self._empty()

    def open(self, *, on_bus: bool) -> None:
        """Let it send, or not; then what waits is lost."""
        self.room = _QUEUE_FRAMES if on_bus else 0
        if not on_bus:
            self.lost += self.waiting
            self.drop()

    def error_state_changed(self, at_us: int) -> None:
        """Tell whoever wants to know."""
        if self._error_aware is not None:
            self._error_aware.bus_state(self.controller.state)
        if self.on_error_state is not None:
            self.on_error_state(at_us, self.controller.state)
        if self.auto_recovery and self.controller.state is ErrorState.BUS_OFF:
            self.recover(at_us)
        self.wake(at_us)
        self.segment.received = True


class Babbler(CanEnd):
    """A node that always has its frame to send: it does not care for its error state either.

    It is here, for no compiled class derives from one whose fields are those of the kernel.
    """

    __slots__ = ()

    def take(self) -> CanFrame:
        """Keep the frame."""
        return self.next

    def drop(self) -> None:
        """Keep it too."""
