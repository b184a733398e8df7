"""Join an emulated CAN bus with a port of the outside world."""

from __future__ import annotations

from typing import Final, Protocol

from tickrig.emulators.can.end import CanEnd
from tickrig.emulators.rig.port import Port
from tickrig.host.links.echo import EchoFilter
from tickrig.wire.can import Frames
from tickrig.wire.instant import NEVER

_HANDOVER_US: Final = 1_000
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
        return due_us if due_us == NEVER else -(-due_us // _HANDOVER_US) * _HANDOVER_US

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


class CountingPort(Port[Frames], Protocol):
    """A bus outside that counts what it could not take."""

    @property
    def lost(self) -> int:
        """How many frames."""
        ...


class PortBefore:
    """A port that passes all on to and from the port behind it.

    Args:
        port: the port behind it.
    """

    def __init__(self, port: CountingPort) -> None:
        self._port = port

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
        return self._port.poll(now_us)

    def send(self, now_us: int, traffic: Frames, /) -> None:
        """Send."""
        self._port.send(now_us, traffic)


class WithoutEcho(PortBefore):
    """A port on the udp_multicast bus of python-can, which hears its own frames.

    Args:
        port: the port behind it.
    """

    def __init__(self, port: CountingPort) -> None:
        super().__init__(port)
        self._echo = EchoFilter()

    def poll(self, now_us: int, /) -> Frames:
        """Read what others have sent."""
        self._echo.expire(now_us)
        return tuple(frame for frame in super().poll(now_us) if not self._echo.take(frame))

    def send(self, now_us: int, traffic: Frames, /) -> None:
        """Send, and await the echo."""
        self._echo.sent(now_us, traffic)
        super().send(now_us, traffic)
