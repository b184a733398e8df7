"""A CAN bus that gives back what was sent, made one that does not."""

from __future__ import annotations

from collections import deque
from typing import Final, Protocol

from tickrig.emulators.rig.port import Port
from tickrig.wire.can import CanFrame, Frames

ECHO_US: Final = 1_000_000
"""An echo that has not come by then was lost."""


class CountingPort(Port[Frames], Protocol):
    """A bus outside that counts what it could not take."""

    @property
    def lost(self) -> int:
        """How many frames."""
        ...


class WithoutEcho:
    """A port on the udp_multicast bus of python-can, which hears its own frames.

    A frame from outside that is the same as one whose echo is awaited is taken
    for the echo, and the echo for it.

    Args:
        port: the port behind it.
    """

    def __init__(self, port: CountingPort) -> None:
        self._port = port
        self._awaited: deque[tuple[int, CanFrame]] = deque()

    @property
    def lost(self) -> int:
        """Frames dropped because the adapter took none."""
        return self._port.lost

    @property
    def due_us(self) -> int:
        """When the next traffic arrives."""
        return self._port.due_us

    def poll(self, now_us: int, /) -> Frames:
        """Read what others have sent."""
        while self._awaited and self._awaited[0][0] < now_us - ECHO_US:
            self._awaited.popleft()
        return tuple(frame for frame in self._port.poll(now_us) if not self._is_echo(frame))

    def send(self, now_us: int, traffic: Frames, /) -> None:
        """Send, and await the echo."""
        self._awaited += [(now_us, frame) for frame in traffic]
        self._port.send(now_us, traffic)

    def _is_echo(self, frame: CanFrame) -> bool:
        for place, (_, awaited) in enumerate(self._awaited):
            if awaited == frame:
                del self._awaited[place]
                return True
        return False
