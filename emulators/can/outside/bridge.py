"""Join an emulated CAN bus with a port of the outside world."""

from __future__ import annotations

from collections import deque
from typing import Final, Protocol

from tickrig.emulators.can.end import CanEnd
from tickrig.emulators.rig.port import Port
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.instant import NEVER

HANDOVER_US: Final = 1_000
"""What has arrived is handed out at least this often."""


class CanBridge:
    """One end of an emulated bus, handed to the outside: one bus of python-can.

    The nodes of the rig hear each other on their own wire, and the outside
    hears each of their frames once. Frames from outside are put on the wire as
    one more node would send them, so they take their time there as well.

    Args:
        end: an end of the wire that no station has.
        outside: the outside.
    """

    def __init__(self, end: CanEnd, outside: Port[Frames]) -> None:
        self._end, self._outside = end, outside
        self._looked_us = 0

    @property
    def due_us(self) -> int:
        """When frames are to be handed out."""
        due_us = self._end.due_us
        return due_us if due_us == NEVER else -(-due_us // HANDOVER_US) * HANDOVER_US

    def take_in(self, now_us: int, /) -> None:
        """Put what the outside sent since the last look on the wire.

        It may have been sent at any time since then, so it is taken as sent
        right after that look: a host is not charged a tick for being polled.
        """
        if frames := self._outside.poll(now_us):
            self._end.send(self._looked_us, frames)
        self._looked_us = now_us

    def give_out(self, now_us: int, /) -> None:
        """Hand what has arrived by now to the outside."""
        if frames := self._end.poll(now_us):
            self._outside.send(now_us, frames)


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
