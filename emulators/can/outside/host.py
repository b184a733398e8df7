"""A host on the bus of a rig in virtual time."""

from __future__ import annotations

from collections import deque
from threading import get_ident
from typing import Final, NoReturn

from tickrig.emulators.can.end import CanEnd
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_waits import Looks, OneThread
from tickrig.host.links.link import LinkClosed, LinkError, LinkTimeout, StampedFrames
from tickrig.wire.can import CanFrame, ErrorFrame, Frames
from tickrig.wire.instant import NEVER

_CHUNK_US: Final = 1_000_000
"""Time that the rig runs at once if there is no timeout."""


_INSTEAD: Final = (
    "take bench.canopen_network() in place of canopen.Network().connect(), poll in place of a"
    " can.Notifier"
)

_LOOKING: Final = "give recv or receive a timeout, or sleep, with the fixture bench_time"


class Repeat:
    """Frames that a host sends periodically, like the periodic task of a CAN driver.

    One frame is sent in each period, in turn.

    Attributes:
        frames: the frames. New frames are used from the next period on.
        due_us: time at which the next frame is sent, or `NEVER` after `stop`.
    """

    def __init__(self, frames: Frames, period_us: int, due_us: int) -> None:
        self.frames, self.due_us = frames, due_us
        self._period_us, self._sent = period_us, 0

    def stop(self) -> None:
        """Stop sending."""
        self.due_us = NEVER

    def take(self) -> Frames:
        """Return the frame that is due."""
        frame = self.frames[self._sent % len(self.frames)]
        self._sent += 1
        self.due_us += self._period_us
        return (frame,)


class CanHost:
    """A host on an emulated bus in virtual time: while the host waits, the time advances.

    The class implements the protocol `StampedLink`.

    Args:
        rig: the rig to advance.
        end: connection of the host to a bus of the rig, made by `CanWire.end`. No device of the rig
            uses this connection.
        thread: thread that uses the link. None means the thread that makes the link.
        hears_own: whether the host also receives its own frames, after they have been on the bus.
    """

    def __init__(
        self, rig: Rig, end: CanEnd, thread: OneThread | None = None, *, hears_own: bool = False
    ) -> None:
        self._rig, self._end, self._closed = rig, end, False
        self._hears_own, self._unsent, self._own = hears_own, deque[CanFrame](), set[int]()
        if hears_own:
            end.wire.observers.append(self._observe)
        self._thread, self._looks = thread or OneThread(), Looks()
        rig.move_on(end.wire)
        self._inbox: deque[tuple[int, CanFrame]] = deque()
        self._repeats: list[Repeat] = []

    @property
    def now_us(self) -> int:
        """The rig's time."""
        return self._rig.now_us

    def send(self, traffic: Frames, /) -> None:
        """Queue frames; no time passes."""
        if self._closed or self._thread.ident != get_ident() or self._thread.refused:
            self._refuse()
        if self._hears_own:
            self._put(self._rig.now_us, traffic)
        else:
            self._end.send(self._rig.now_us, traffic)

    def is_own(self, at_us: int) -> bool:
        """Return whether this host itself sent a frame that it has received.

        Only one frame can end at a time, so the end time identifies the frame. The host remembers
        the end times of its own frames, and this method removes the given time. Therefore call the
        method only once for each frame.

        Args:
            at_us: time at which the frame ended.
        """
        own = at_us in self._own
        self._own.discard(at_us)
        return own

    def repeat(self, frames: Frames, period_us: int) -> Repeat:
        """Send frames periodically: one frame now and one in each period, in turn.

        The frames are sent whenever any code advances the rig's time.

        Args:
            frames: frames to send. After the last one, the first one is sent again.
            period_us: time between two frames on the clock of the rig.

        Returns:
            An object that can change or stop the transmission.
        """
        if period_us < 1 or not frames:
            raise ValueError(f"{len(frames)} frames each {period_us} us; at least 1 frame and 1 us")
        repeat = Repeat(frames, period_us, self.now_us)
        self.send(repeat.take())
        if not self._repeats:
            self._rig.watchers.append(self._send_due)
        self._repeats.append(repeat)
        self._wake()
        return repeat

    def receive(self, timeout_us: int, /) -> Frames:
        """Wait until a frame has arrived; return all received frames."""
        return tuple(frame for _, frame in self.receive_stamped(timeout_us)[1])

    def receive_stamped(self, timeout_us: int, /) -> tuple[int, StampedFrames]:
        """Wait until a frame has arrived; return the time and all received frames."""
        first = self.take(timeout_us)
        received = () if first is None else (first, *self._inbox)
        self._inbox.clear()
        return self._rig.now_us, received

    def take(self, timeout_us: int | None, *, more: bool = False) -> tuple[int, CanFrame] | None:
        """Wait for a frame, and return it with its time.

        Args:
            timeout_us: longest wait; None for no limit.
            more: whether this call continues the wait of an earlier call. The rig limits the number
                of waits (`host_limit`). A call that continues a wait is not counted again.

        Returns:
            Time and frame, or None after the timeout.

        Raises:
            LinkClosed: the link was closed.
            LinkError: a second thread uses the link, or the host polls in a loop that would never
                end, because the time does not advance.
            LinkTimeout: there is no timeout, and no event is left that could end the wait.
        """
        if self._closed or self._thread.ident != get_ident() or self._thread.refused:
            self._refuse()
        rig, inbox = self._rig, self._inbox
        deadline_us = NEVER if timeout_us is None else rig.now_us + max(0, timeout_us)
        while not inbox:
            inbox += self._end.poll_stamped(rig.now_us)
            if not inbox:
                if rig.now_us >= deadline_us:
                    if timeout_us is not None and timeout_us <= 0:
                        self._look()
                    return None
                if rig.now_us >= rig.host_limit.due_us and not more:
                    rig.host_limit.count(rig.now_us)
                rig.run_to(deadline_us if deadline_us < NEVER else self._chunk_us(), self._end)
        return inbox.popleft()

    def close(self) -> None:
        """Close the link; the rig is unchanged."""
        self._closed = True
        if self._repeats:
            self._rig.watchers.remove(self._send_due)
        self._repeats.clear()
        if self._hears_own:
            self._end.wire.observers.remove(self._observe)
            self._hears_own = False

    def _put(self, now_us: int, traffic: Frames) -> None:
        """Queue frames, and record the accepted frames if the host receives its own frames."""
        lost = self._end.lost
        self._end.send(now_us, traffic)
        if self._hears_own:
            self._unsent += traffic[: len(traffic) - (self._end.lost - lost)]

    def _observe(self, at_us: int, frame: CanFrame | ErrorFrame) -> None:
        """Receive a frame that has just left the queue."""
        waiting = self._end.waiting
        while len(self._unsent) > waiting + 1:  # lost, as by a controller that was bus-off
            self._unsent.popleft()
        if len(self._unsent) > waiting and isinstance(frame, CanFrame) and self._unsent[0] == frame:
            self._unsent.popleft()
            self._own.add(at_us)
            self._end.receive(at_us, frame, (frame,))

    def _look(self) -> None:
        """Count a poll without result; a wait that has timed out does not count."""
        if refusal := self._looks.refusal(self.now_us, _LOOKING):
            raise LinkError(refusal)

    def _chunk_us(self) -> int:
        """Return the time that the rig runs at once if there is no timeout."""
        if self._rig.next_us == NEVER:
            raise LinkTimeout("nothing will ever happen on this bus, and no timeout was given")
        return self._rig.next_us + _CHUNK_US

    def _wake(self) -> None:
        """Stop the rig when the next periodic frame is due."""
        self._repeats = [repeat for repeat in self._repeats if repeat.due_us < NEVER]
        if self._repeats:
            due_us = min(repeat.due_us for repeat in self._repeats)
            self._rig.event_queue.wake(("repeat", id(self)), due_us)
        else:
            self._rig.watchers.remove(self._send_due)

    def _send_due(self, now_us: int) -> None:
        """Send due frames; called after each step of the rig."""
        due = [repeat for repeat in self._repeats if repeat.due_us <= now_us]
        for repeat in due:
            self._put(now_us, repeat.take())
        if due or all(repeat.due_us == NEVER for repeat in self._repeats):
            self._wake()

    def _refuse(self) -> NoReturn:
        if self._closed:
            raise LinkClosed("the link was closed")
        raise LinkError(self._thread.refusal("bus", _INSTEAD))
