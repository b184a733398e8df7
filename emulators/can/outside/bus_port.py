"""A bus of python-can as a port of a rig in real time."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Final

import can

from tickrig.device.twin import NonCopyable
from tickrig.emulators.can.outside.bridge import CountingPort, WithoutEcho
from tickrig.host.links.can_link import BusReceiver, close_bus, reason_of, to_frame, to_message
from tickrig.host.links.echo import ECHOING
from tickrig.host.links.link import LinkClosed
from tickrig.host.text.log import log_of
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.instant import NEVER

FRAMES_A_POLL: Final = 1_024
"""Largest number of frames read at once, so that a busy bus cannot stop the clock."""

_logger = log_of(__name__)


class CanBusPort(NonCopyable):
    """A `Port[Frames]` on a real or virtual bus; it never blocks.

    Frames that the adapter does not accept at once are queued, up to `queue_frames`, and sent in
    order. Frames that do not fit into the queue are dropped and counted.

    Args:
        bus: open bus, which has no other readers.
        name: name of the bus in messages.
        queue_frames: size of the queue.
        gone: function that is called with a text when the bus can no longer be read. It returns the
            exception to raise.

    Attributes:
        lost: number of frames dropped because the adapter did not accept them.
        errors: number of received error frames.
        reads: object that reads the bus, and counts the frames that its driver could not read.
    """

    why_not_copied = "it is a bus of this machine"
    due_us: Final = NEVER  # only the bus knows when traffic arrives

    def __init__(
        self,
        bus: can.BusABC,
        name: str = "CAN bus",
        queue_frames: int = 4_096,
        gone: Callable[[str], Exception] = LinkClosed,
    ) -> None:
        self._bus, self._name, self._queue_frames = bus, name, queue_frames
        self.reads = BusReceiver(bus, name, ends=(), gone=gone)
        self._unsent: deque[CanFrame] = deque()
        self.lost = self.errors = 0
        self._failed = ""

    @property
    def failed(self) -> str:
        """Reason why the CAN adapter last failed to send or read, or "" if there was no error."""
        return self.reads.last or self._failed

    def poll(self, now_us: int, /) -> Frames:
        """Read without blocking.

        Raises:
            LinkClosed: 100 reads in a row failed over 1 s.
        """
        self._flush()
        frames = []
        for _ in range(FRAMES_A_POLL):
            message = self.reads.receive(0)
            if message is None:
                break
            frame = to_frame(message)
            if frame is None:
                self.errors += message.is_error_frame
            else:
                frames.append(frame)
        return tuple(frames)

    def send(self, now_us: int, traffic: Frames, /) -> None:
        """Send the frames that the adapter accepts; queue the other frames."""
        room = self._queue_frames - len(self._unsent)
        self.lost += max(0, len(traffic) - room)
        self._unsent += traffic[:room]
        self._flush()

    def close(self) -> None:
        """Close the bus."""
        close_bus(self._bus)

    def _flush(self) -> None:
        try:
            while self._unsent:
                self._bus.send(to_message(self._unsent[0]), timeout=0)
                self._unsent.popleft()
            self._note("")
        except Exception as error:  # drivers raise what they like
            self._note(reason_of(error))

    def _note(self, failed: str) -> None:
        """Record a failure, and log one warning instead of one in every tick."""
        if failed and not self._failed:
            _logger.warning("%s: %s; what it does not take is kept", self._name, failed)
        self._failed = failed


def port_on(
    bus: can.BusABC,
    interface: str,
    name: str = "CAN bus",
    gone: Callable[[str], Exception] = LinkClosed,
) -> CountingPort:
    """Return the port on an open bus, without the echo of some interfaces."""
    port = CanBusPort(bus, name, gone=gone)
    return WithoutEcho(port) if interface in ECHOING else port
