"""Join an emulated CAN bus with a port of the outside world."""

from __future__ import annotations

from typing import Final, Protocol

from tickrig.emulators.can.end import CanEnd
from tickrig.emulators.rig.port import Port
from tickrig.host.links.echo import EchoFilter
from tickrig.host.text.log import log_of
from tickrig.wire.can import Frames
from tickrig.wire.instant import NEVER

_logger = log_of(__name__)

_HANDOVER_US: Final = 1_000
"""Longest period between two deliveries of received frames."""
_OF_NODES: Final = frozenset((*range(0x081, 0x100), *range(0x581, 0x600), *range(0x701, 0x780)))
"""CAN-IDs of EMCYs, SDO answers and heartbeats, each of which only one CANopen node sends."""


class CanBridge:
    """Connects an emulated bus with a real bus that python-can opens.

    The nodes of the rig communicate on their own emulated wire. Each of their frames is sent once
    to the real bus. Frames from the real bus are sent on the emulated wire as if an additional node
    sent them. So each of these frames also occupies the emulated wire for the length of the frame.

    If a program on the real bus sends frames of a node that is also in the rig, one warning is
    logged. The usual cause is a second emulator of the same node.

    Args:
        end: connection to the emulated bus, made by `CanWire.end`. No node uses this connection.
        outside: port of the bus outside.
        name: name of the real bus in messages.
    """

    def __init__(self, end: CanEnd, outside: Port[Frames], name: str = "CAN bus") -> None:
        self._end, self._outside, self._name = end, outside, name
        self._looked_us = 0
        self._own = set[int]()
        self._doubled = False

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
            if not self._doubled:
                self._find_doubled(frames)
        self._looked_us = now_us

    def give_out(self, now_us: int, /) -> None:
        """Deliver the frames that have arrived by now to the outside."""
        if frames := self._end.poll(now_us):
            self._outside.send(now_us, frames)
            self._own |= _of_nodes(frames)

    def _find_doubled(self, frames: Frames) -> None:
        """Log a warning if frames from the real bus have a CAN-ID of a node in the rig."""
        for can_id in sorted(self._own & _of_nodes(frames)):
            self._doubled = True
            text = "%s: another program also sends %03Xh: is node %d emulated twice on this bus?"
            _logger.warning(text, self._name, can_id, can_id & 0x7F)
            return


def _of_nodes(frames: Frames) -> set[int]:
    """Return the CAN-IDs in frames that only one node sends."""
    plain = (frame for frame in frames if not frame.remote and not frame.extended)
    return {frame.can_id for frame in plain if frame.can_id in _OF_NODES}


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
