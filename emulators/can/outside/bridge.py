"""Join an emulated CAN bus with a port of the outside world."""

from __future__ import annotations

from typing import Final, Protocol

from tickrig.emulators.can.end import CanEnd
from tickrig.emulators.rig.port import Port
from tickrig.host.links.echo import EchoFilter
from tickrig.wire.can import Frames
from tickrig.wire.instant import NEVER

_HANDOVER_US: Final = 1_000
"""Longest period between two deliveries of received frames."""


class CanBridge:
    """Connects an emulated bus with a real bus that python-can opens.

    The nodes of the rig communicate on their own emulated wire. Each of their frames is sent once
    to the real bus. Frames from the real bus are sent on the emulated wire as if an additional node
    sent them. So each of these frames also occupies the emulated wire for the length of the frame.

    Args:
        end: connection to the emulated bus, made by `CanWire.end`. No node uses this connection.
        outside: port of the bus outside.
    """

    def __init__(self, end: CanEnd, outside: Port[Frames]) -> None:
        self._end, self._outside = end, outside
        self._looked_us = 0

    @property
    def due_us(self) -> int:
        """The time of the next delivery."""
        due_us = self._end.due_us
        return due_us if due_us == NEVER else -(-due_us // _HANDOVER_US) * _HANDOVER_US

    def take_in(self, now_us: int, /) -> None:
        """Send on the emulated bus the frames that the real bus has received since the last poll.

        The exact time at which such a frame arrived is unknown. It lies between the last poll and
        now. Each frame is treated as if it had arrived right after the last poll. With a later
        time, a host outside would get each answer up to a tick later.
        """
        if frames := self._outside.poll(now_us):
            self._end.send(self._looked_us, frames)
        self._looked_us = now_us

    def give_out(self, now_us: int, /) -> None:
        """Deliver the frames that have arrived by now to the outside."""
        if frames := self._end.poll(now_us):
            self._outside.send(now_us, frames)


class CountingPort(Port[Frames], Protocol):
    """An outside bus that counts the frames it could not accept."""

    @property
    def lost(self) -> int:
        """Number of frames that could not be accepted."""
        ...


class PortBefore:
    """Base class of ports that change or watch the traffic of another port.

    This class forwards all traffic unchanged.

    Args:
        port: port to which all traffic is forwarded.
    """

    def __init__(self, port: CountingPort) -> None:
        self._port = port

    @property
    def lost(self) -> int:
        """Frames dropped because the adapter did not accept them."""
        return self._port.lost

    @property
    def due_us(self) -> int:
        """Arrival time of the next traffic."""
        return self._port.due_us

    def poll(self, now_us: int, /) -> Frames:
        """Read the frames that other nodes have sent."""
        return self._port.poll(now_us)

    def send(self, now_us: int, traffic: Frames, /) -> None:
        """Send frames."""
        self._port.send(now_us, traffic)


class WithoutEcho(PortBefore):
    """A port that drops the echo of its own frames, for python-can's udp_multicast bus.

    That bus also delivers frames to their sender.

    Args:
        port: the port on the bus.
    """

    def __init__(self, port: CountingPort) -> None:
        super().__init__(port)
        self._echo = EchoFilter()

    def poll(self, now_us: int, /) -> Frames:
        """Read the frames that other nodes have sent."""
        self._echo.expire(now_us)
        return tuple(frame for frame in super().poll(now_us) if not self._echo.take(frame))

    def send(self, now_us: int, traffic: Frames, /) -> None:
        """Send frames, and record them as expected echo."""
        self._echo.sent(now_us, traffic)
        super().send(now_us, traffic)
