"""Echoes of sent frames, and their separation from frames of other nodes."""

from __future__ import annotations

from collections import deque
from typing import Final

from tickrig.host.links.link import StampedFrames, StampedLink
from tickrig.wire.can import CanFrame, Frames

ECHOING: Final = ("udp_multicast",)
"""Interfaces that always return sent frames."""

ECHO_US: Final = 1_000_000
"""Time after which an echo counts as lost."""


class EchoFilter:
    """Filter that recognizes the host's own frames on a bus that returns them as an echo.

    If another node sends an equal frame that arrives before the echo, the filter takes this frame
    for the echo, and the echo for the frame of the other node.
    """

    def __init__(self) -> None:
        self._sent: deque[tuple[int, CanFrame]] = deque()
        self._awaited: dict[CanFrame, deque[int]] = {}  # by frame: a look does not take longer

    def sent(self, now_us: int, traffic: Frames) -> None:
        """Expect the echo of frames sent now."""
        for frame in traffic:
            self._sent.append((now_us, frame))
            self._awaited.setdefault(frame, deque()).append(now_us)

    def expire(self, now_us: int) -> None:
        """Stop expecting echoes of frames sent more than `ECHO_US` ago."""
        while self._sent and self._sent[0][0] < now_us - ECHO_US:
            sent_us, frame = self._sent.popleft()
            if frame in self._awaited and self._awaited[frame][0] <= sent_us:
                self.take(frame)

    def take(self, frame: CanFrame) -> bool:
        """Return whether a received frame is the echo of a sent frame.

        Each sent frame has one echo. If a frame was sent once and is received twice, the result is
        True for the first and False for the second.
        """
        if frame not in self._awaited:
            return False
        times = self._awaited[frame]
        times.popleft()
        if not times:
            del self._awaited[frame]
        return True


class EchoFreeLink:
    """`StampedLink` that removes the echo of its own frames, for python-can's udp_multicast bus.

    Args:
        link: link whose received frames include the frames that it has sent.
    """

    def __init__(self, link: StampedLink) -> None:
        self._link, self._echo = link, EchoFilter()

    @property
    def now_us(self) -> int:
        """Time on the clock of the link."""
        return self._link.now_us

    def send(self, traffic: Frames, /) -> None:
        """Send frames, and expect their echo."""
        self._echo.sent(self.now_us, traffic)
        self._link.send(traffic)

    def receive(self, timeout_us: int, /) -> Frames:
        """Wait for frames, and return those of other nodes.

        If only echoes arrive, the result is empty. Then this method may return before the timeout.
        """
        return tuple(frame for _, frame in self.receive_stamped(timeout_us)[1])

    def receive_stamped(self, timeout_us: int, /) -> tuple[int, StampedFrames]:
        """Return a time, and the frames of other nodes up to this time."""
        now_us, received = self._link.receive_stamped(timeout_us)
        self._echo.expire(now_us)
        return now_us, tuple(
            (at_us, frame) for at_us, frame in received if not self._echo.take(frame)
        )

    def close(self) -> None:
        """Close the link."""
        self._link.close()


def free_of_echo(link: StampedLink, interface: str) -> StampedLink:
    """Return a link that does not return the echo of the frames it has sent.

    If the interface has no echo, the result is the given link.
    """
    return EchoFreeLink(link) if interface in ECHOING else link
