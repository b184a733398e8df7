"""A link to a bus that gives back what was sent, made one that does not."""

from __future__ import annotations

from collections import deque
from typing import Final

from tickrig.host.links.stamped_link import Stamped, StampedLink
from tickrig.wire.can import CanFrame, Frames

ECHO_US: Final = 1_000_000
"""An echo that has not come by then was lost."""


class EchoFreeLink:
    """A `StampedLink` on the udp_multicast bus of python-can, which hears its own frames.

    A frame of somebody else that is the same as one whose echo is awaited is taken
    for the echo, and the echo for it.

    Args:
        link: the link behind it.
    """

    def __init__(self, link: StampedLink) -> None:
        self._link = link
        self._awaited: deque[tuple[int, CanFrame]] = deque()

    @property
    def now_us(self) -> int:
        """The clock of the link behind it."""
        return self._link.now_us

    def send(self, traffic: Frames, /) -> None:
        """Send, and await the echo."""
        self._awaited += [(self.now_us, frame) for frame in traffic]
        self._link.send(traffic)

    def receive(self, timeout_us: int, /) -> Frames:
        """Return what others sent; nothing, maybe before its time, if it was all echo."""
        return tuple(frame for _, frame in self.hear(timeout_us)[1])

    def hear(self, timeout_us: int, /) -> tuple[int, Stamped]:
        """Return a time, and what others sent by then."""
        now_us, heard = self._link.hear(timeout_us)
        while self._awaited and self._awaited[0][0] < now_us - ECHO_US:
            self._awaited.popleft()
        return now_us, tuple((at_us, frame) for at_us, frame in heard if not self._is_echo(frame))

    def close(self) -> None:
        """Close the link behind it."""
        self._link.close()

    def _is_echo(self, frame: CanFrame) -> bool:
        for place, (_, awaited) in enumerate(self._awaited):
            if awaited == frame:
                del self._awaited[place]
                return True
        return False
